"""The fields and calls that all photodiode sensors share, whatever their readings are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.plugins.ranges import Percent, check_ranges

from .limits import (
    Bits,
    Code,
    Crosstalk,
    DarkCurrent,
    Exposure,
    LineTime,
    Noise,
    Pitch,
    Pixels,
    Power,
    QuantumEfficiency,
    Target,
    Temperature,
)
from .readout.converter import check_codes, check_reading
from .readout.shot import expected_electrons, take_shot
from .sampling.pixel_grid import pixel_counts, pixel_need
from .sensor_model import SensorModel
from .spectral.colour_filter_array import cell
from .spectral.quantum_efficiency import narrow
from .spectral.response import ask, full_scale_e
from .timing import auto_exposure


@dataclass(frozen=True)
class ImagingSensor:
    """A sensor with photodiodes under a colour filter array; an architecture adds `model`."""

    exposure_s: Exposure = 0.016
    pitch_um: Pitch = 3.75
    rows: Pixels = 0  # 0: fill the camera's field; else a centred crop
    columns: Pixels = 0
    cfa: str = "RGGB"  # repeated pattern of filters, rows parted by / where it is no square
    peak_qe: QuantumEfficiency = 0.65  # scale of the spectral curves, electrons per photon
    infrared_cut: bool = True  # blocking filter of the camera module
    qe_csv: str = ""  # own curves: wavelength_nm and one column per filter
    temperature_c: Temperature = 60.0
    bits: Bits = 12  # of the linear code; 0: converter off, raw is electrons
    black_dn: Code = 64.0  # assumption
    noise: bool = True  # False: means only, no random or fixed pattern

    # rolling shutter, from row to row: 1650 clocks of 74.25 MHz (assumption); 0: global shutter
    line_time_s: LineTime = 22.2e-6

    # --- exposure solved from the light; `exposure_s` counts only where it is fixed ---
    exposure_rule: Literal["fixed", "centre", "histogram", "highlights"] = (
        "fixed"  # docs/explanation/sensors.md, Automatic exposure
    )
    exposure_target: Target = 0.5  # metered level / full scale
    exposure_min_s: Exposure = 1e-5
    exposure_max_s: Exposure = 0.033  # a frame at 30 Hz

    # --- off unless a preset knows them: no data sheet of ours states them ---
    # of a pixel's light at 550 nm, to the 4 neighbours
    optical_crosstalk_percent: Crosstalk = 0.0
    # that share grows as the wavelength to this power (assumption: as diffraction)
    optical_crosstalk_power: Power = 1.0
    electrical_crosstalk_percent: Crosstalk = 0.0  # of a pixel's electrons, to the 8 neighbours
    # of the charge beyond the well, along the column; the rest is drained
    blooming_percent: Percent = 0.0
    hot_percent: Percent = 0.0  # of the pixels, persistent
    # mean over the hot pixels of their extra dark charge, at 60 C (assumption)
    hot_dark_e_per_s: DarkCurrent = 1000.0
    row_e: Noise = 0.0  # rms over rows of the offset, persistent
    row_noise_e: Noise = 0.0  # rms over rows of the offset, new in every reading
    # of the pixels read 5 times as noisy as the rest; the rms stays
    read_tail_percent: Percent = 0.0
    inl_dn: Code = 0.0  # largest distance of the converter from a straight line
    companding: tuple[tuple[Code, Code], ...] = ()  # knees [linear DN, companded DN]; none: linear

    def input_files(self):
        """Return the user's own curves, if they are named: their content is part of a run's
        name.
        """
        return (self.qe_csv,) if self.qe_csv else ()

    def __post_init__(self):
        check_ranges(self)
        auto_exposure.check(self)
        self.model()

    def diode_terms(self) -> dict:
        """Return the fields of a `Photodiode` that all photodiodes share."""
        return {
            name: getattr(self, name)
            for name in ("blooming_percent", "hot_percent", "hot_dark_e_per_s")
        }

    def reading_terms(self) -> dict:
        """Return the fields of a `Reading` that all readings share."""
        return {
            name: getattr(self, name)
            for name in ("row_e", "row_noise_e", "read_tail_percent", "inl_dn", "companding")
        }

    def assemble(self, photodiodes, readings, **more) -> SensorModel:
        """Return the model of these photodiodes and readings."""
        readings, photodiodes = tuple(readings), tuple(photodiodes)
        for reading in readings:
            check_reading(reading)
            check_codes(reading, photodiodes[reading.diode])
        return SensorModel(
            self.exposure_s,
            self.pitch_um,
            self.rows,
            self.columns,
            self.cfa,
            tuple(photodiodes),
            readings,
            peak_qe=self.peak_qe,
            infrared_cut=self.infrared_cut,
            qe_csv=self.qe_csv,
            temperature_c=self.temperature_c,
            noise=self.noise,
            optical_crosstalk_percent=self.optical_crosstalk_percent,
            optical_crosstalk_power=self.optical_crosstalk_power,
            electrical_crosstalk_percent=self.electrical_crosstalk_percent,
            line_time_s=self.line_time_s,
            **more,
        )

    def model(self) -> SensorModel:
        """Return what the sensor is made of."""
        raise NotImplementedError

    def __call__(self, light, generator):
        """Return captures of one shot, at the exposure solved for this light unless it is fixed."""
        if self.exposure_rule != "fixed":
            return auto_exposure.exposed(self, light, generator)
        return self.take(light, generator)

    def take(self, light, generator):
        """Return captures of one shot at `exposure_s`."""
        return take_shot(self.model(), light, generator)

    def full_scale_e(self) -> list[float]:
        """Return the electrons of every capture at which it stops measuring light."""
        return full_scale_e(self.model())

    def expected(self, light):
        """Return mean electrons (capture, y, x), dark charge included."""
        return expected_electrons(self.model(), light)

    def shot_form(self) -> ShotForm:
        """Return the names of the captures and the filter array, known before a shot."""
        names = tuple(reading.capture for reading in self.model().readings)
        return ShotForm(names, cell(self.cfa))

    def check_field(self, width_m: float, height_m: float):
        """Refuse a field, in metres on the sensor plane, that the pixels do not fit into."""
        pixel_counts(width_m, height_m, self.pitch_um, self.rows, self.columns)

    def pixel_need(self, width_m: float, height_m: float):
        """Return what the pixels over an image of this size, in metres, take in memory, as
        `isethdr_core.pipeline.memory.Need`.
        """
        return pixel_need(self.model(), width_m, height_m)

    def narrow(self, demand):
        """Return the demand for what the sensor sees, its window and no outer band in which it is
        blind, and with its response.
        """
        model = self.model()
        return ask(
            model,
            narrow(model, demand),
            self.exposure_s if self.exposure_rule == "fixed" else self.exposure_max_s,
        )

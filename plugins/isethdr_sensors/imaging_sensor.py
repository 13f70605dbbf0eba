"""The fields and calls that all photodiode sensors share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.plugins.ranges import Percent, Share, check_ranges
from isethdr_core.sequence.exposure import Exposure as FrameExposure

from .limits import (
    Bits,
    Code,
    Crosstalk,
    DarkCurrent,
    DefectCurrent,
    DesignAngle,
    Exposure,
    Flicker,
    GainFactor,
    ImageHeight,
    LampRatio,
    LineTime,
    Mismatch,
    Noise,
    NoiseVoltage,
    Pitch,
    Pixels,
    Power,
    QuantumEfficiency,
    Speed,
    Target,
    Temperature,
)
from .noise.read_noise import input_referred_e
from .readout import chip_combination
from .readout.converter import check_codes, check_reading
from .readout.shot import expected_electrons, take_shot
from .sampling import microlens
from .sampling.pixel_grid import pixel_counts, pixel_need
from .sensor_model import SensorModel
from .spectral.colour_filter_array import cell
from .spectral.quantum_efficiency import narrow
from .spectral.response import ask, full_scale_e
from .timing import auto_exposure
from .timing.exposure_limits import exposure_limits
from .timing.exposure_timing import shot_time_s

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand
    from isethdr_core.pipeline.memory import Need
    from isethdr_core.runs.seeds import Generator
    from isethdr_core.sequence.exposure import SettledExposure

    from .sensor_model import Photodiode, Reading
    from .timing.auto_exposure import Automatic


@dataclass(frozen=True)
class ImagingSensor:
    """A sensor with photodiodes under a colour filter array. A subclass defines `model`."""

    THREAD_SAFE: ClassVar[bool] = True

    exposure_s: Exposure = 0.016  # exposure time; used where exposure_rule is fixed
    pitch_um: Pitch = 3.75  # pixel pitch
    rows: Pixels = 0  # number of pixel rows: 0 fills the camera's field, less is a centred crop
    # number of pixel columns: 0 fills the camera's field, less is a centred crop
    columns: Pixels = 0
    # repeated pattern of colour filters; rows separated by / where the pattern is not square
    cfa: str = "RGGB"
    # scale of the built-in quantum efficiency curves, electrons per photon; not used with qe_csv
    peak_qe: QuantumEfficiency = 0.65
    # ultraviolet and infrared blocking filter of the camera module; also applied to qe_csv
    infrared_cut: bool = True
    # file with own quantum efficiency curves: wavelength_nm and one column per filter
    qe_csv: str = ""
    temperature_c: Temperature = 60.0  # temperature of the sensor, which sets the dark current
    bits: Bits = 12  # bits of the linear code; 0 switches the converter off: raw is electrons
    black_dn: Code = 64.0  # black level (assumption)
    noise: bool = True  # false: mean values only, without random noise and fixed pattern

    # time from row to row of the rolling shutter: 1650 clocks of 74.25 MHz (assumption); 0 is a
    # global shutter
    line_time_s: LineTime = 22.2e-6

    # --- automatic exposure; `exposure_s` counts only with the rule `fixed` ---
    # rule of the automatic exposure; docs/explanation/sensors.md, Automatic exposure
    exposure_rule: Literal["fixed", "centre", "histogram", "percentile", "highlights"] = "fixed"
    exposure_target: Target = 0.5  # metered level / full scale at which the automatic exposure aims
    exposure_min_s: Exposure = 1e-5  # shortest exposure time of the automatic exposure
    # longest exposure time of the automatic exposure: a frame at 30 Hz
    exposure_max_s: Exposure = 0.033
    exposure_percentile: Percent = 95.0  # percentile of pixels that the rule `percentile` meters
    # level from which a pixel counts as a lamp / 95th percentile of the pixels; the rule
    # `highlights` ignores lamps
    exposure_lamp_ratio: LampRatio = 100.0
    # speed of the camera in metres per second: the exposure is limited so that an object 5 m to the
    # side and 20 m ahead moves by at most 2 pixels; 0 sets no limit
    exposure_speed_m_s: Speed = 0.0
    # frequency of lamps that must not flicker: the exposure is rounded down to whole periods; 0
    # sets no limit
    exposure_flicker_hz: Flicker = 0.0
    # factor by which automatic gain may raise the analog gain, once the exposure is at its limit
    auto_gain_max: GainFactor = 1.0

    # --- effects that are off unless a preset sets them ---
    # chief-ray angle for which the microlenses are shifted: points [image height mm, degrees], from
    # [0, 0]; empty: pixels respond to all angles alike
    microlens_cra_deg: tuple[tuple[ImageHeight, DesignAngle], ...] = ()
    # response of a pixel, relative to the largest, to light that deviates from that angle: points
    # [degrees, response], from [0, 1]
    microlens_response: tuple[tuple[Mismatch, Share], ...] = ()
    # share of a pixel's light at 550 nm that reaches its 4 neighbours
    optical_crosstalk_percent: Crosstalk = 0.0
    # optical crosstalk is proportional to wavelength^power (assumption: diffraction)
    optical_crosstalk_power: Power = 1.0
    # share of a pixel's electrons that diffuse to its 8 neighbours
    electrical_crosstalk_percent: Crosstalk = 0.0
    # share of the charge beyond the full well that spills along the column; the rest is drained
    blooming_percent: Percent = 0.0
    hot_percent: Percent = 0.0  # share of hot pixels; persistent
    # mean extra dark current of the hot pixels at 60 C (assumption)
    hot_dark_e_per_s: DarkCurrent = 1000.0
    row_e: Noise = 0.0  # rms over rows of the offset; persistent
    row_noise_e: Noise = 0.0  # rms over rows of the offset; new in every reading
    # rms noise of the circuits behind the analog gain. In electrons it is this value / (conversion
    # gain x analog gain). The read noise is the root of the sum of the squares of this value in
    # electrons and of `read_noise_e`
    after_gain_noise_uv: NoiseVoltage = 0.0
    # share of pixels with 5 times the read noise of the others; the rms over all pixels does not
    # change
    read_tail_percent: Percent = 0.0
    # share of pixels with a trap that reads as random telegraph noise; persistent
    telegraph_percent: Percent = 0.0
    # mean step of these traps (assumption): a reading changes by plus the step, minus the step or 0
    telegraph_e: Noise = 0.0
    # rows behind metal that are read after the image: black level and dark charge alone
    black_rows: Pixels = 0
    # smallest extra dark current at 60 C with which a hot pixel is in the device's map of defects;
    # inf: the map is empty
    defect_e_per_s: DefectCurrent = inf
    # integral nonlinearity: largest deviation of the converter from a straight line
    inl_dn: Code = 0.0
    # knee points [linear DN, companded DN]; empty is linear
    companding: tuple[tuple[Code, Code], ...] = ()
    # bits of the linear code into which the chip combines all captures, companded by `companding`;
    # 0 keeps the captures apart; for sensors with several captures, except lofic
    combine_bits: Literal[0, 20, 24] = 0

    def input_files(self) -> tuple[Any, ...]:
        """Return the user's file of curves, if one is set. Its content is part of the name of a
        run.
        """
        return (self.qe_csv,) if self.qe_csv else ()

    def __post_init__(self) -> None:
        check_ranges(self)
        auto_exposure.check(self)
        model = self.model()
        if self.combine_bits:
            chip_combination.check(model)
        self._check_gain()

    def diode_terms(self) -> dict:
        """Return the fields of a `Photodiode` that all photodiodes share."""
        return {
            name: getattr(self, name)
            for name in ("blooming_percent", "hot_percent", "hot_dark_e_per_s")
        }

    def reading_terms(self) -> dict:
        """Return the fields of a `Reading` that all readings share."""
        terms = {
            name: getattr(self, name)
            for name in (
                "row_e",
                "row_noise_e",
                "read_tail_percent",
                "inl_dn",
                "telegraph_percent",
                "telegraph_e",
            )
        }
        return {**terms, "companding": () if self.combine_bits else self.companding}

    def read_noise(
        self, floor_e: float, conversion_gain_uv_per_e: float, analog_gain: float
    ) -> float:
        """Return the read noise of a reading, electrons rms, at its conversion and analog gain.

        Parameters
        ----------
        floor_e : part of the read noise that does not depend on the gain, electrons rms.
        conversion_gain_uv_per_e : microvolts per electron at the floating diffusion.
        analog_gain : volts per volt, a multiplier.
        """
        return input_referred_e(
            floor_e, self.after_gain_noise_uv, conversion_gain_uv_per_e, analog_gain
        )

    def assemble(
        self,
        photodiodes: Sequence[Photodiode],
        readings: Iterator[Any] | list[Reading],
        **more: Any,
    ) -> SensorModel:
        """Return the model of these photodiodes and readings.

        Parameters
        ----------
        photodiodes : the photodiodes of a pixel.
        readings : the readings of one shot, in order; each names its photodiode.
        more : further fields of the model, by name.
        """
        readings = tuple(readings)
        photodiodes = tuple(photodiodes)
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
            black_rows=self.black_rows,
            microlenses=microlens.microlenses(self.microlens_cra_deg, self.microlens_response),
            defect_e_per_s=self.defect_e_per_s,
            combine_bits=self.combine_bits,
            combine_companding=self.companding if self.combine_bits else (),
            **more,
        )

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        raise NotImplementedError

    def gained_reading(self) -> int:
        """Return the number of the reading that automatic gain amplifies and meters."""
        raise NotImplementedError

    def with_gain(self, factor: float) -> Self:
        """Return this sensor with the gain of that reading multiplied by `factor`, and automatic
        gain switched off.
        """
        raise NotImplementedError

    def _check_gain(self) -> None:
        if self.auto_gain_max == 1:
            return
        try:
            self.with_gain(self.auto_gain_max)
        except ConfigError as err:
            raise ConfigError(
                f"sensor.auto_gain_max is {self.auto_gain_max:g}, but this sensor cannot have that"
                f" gain: {err}"
            ) from None

    def check_focal_length(self, focal_length_m: float) -> None:
        """Refuse limits of the automatic exposure that contradict each other for the focal length
        of the lens.
        """
        if self.exposure_rule != "fixed":
            exposure_limits(self, focal_length_m)

    def __call__(self, light: xr.DataArray, generator: Generator | None) -> xr.Dataset:
        """Return captures of one shot, at the automatic exposure for this light, or at `exposure_s`
        with the rule `fixed`.
        """
        if self.exposure_rule != "fixed":
            return auto_exposure.exposed(self, light, generator)
        return self.take(light, generator)

    def automatic(self, light: xr.DataArray) -> Automatic:
        """Return the exposure that the sensor chooses for this light."""
        return auto_exposure.one_for_all(self, light)

    @property
    def longest_exposure_s(self) -> float | None:
        """Longest automatic exposure; None if the exposure is fixed."""
        return None if self.exposure_rule == "fixed" else self.exposure_max_s

    def settled_exposure(self, light: xr.DataArray) -> SettledExposure:
        """Return the exposure that the sensor chooses for this light, and its limits."""
        return auto_exposure.settled_exposure(self, light)

    def at_exposure(self, exposure: FrameExposure) -> Self:
        """Return this sensor with an exposure that was chosen for earlier light.

        Raises
        ------
        ConfigError : the exposure has ratios of captures, which this sensor does not have.
        """
        if exposure.ratios:
            raise ConfigError(
                f"an exposure of {type(self).__name__} has the ratios {exposure.ratios}; expected"
                " none, because only sensors with several exposures vary them; type for example"
                " ratios: []"
            )
        return auto_exposure.at_exposure(self, exposure)

    def take(self, light: xr.DataArray, generator: Generator | None) -> xr.Dataset:
        """Return captures of one shot at `exposure_s`."""
        return take_shot(self.model(), light, generator)

    def full_scale_e(self) -> list[float]:
        """Return the electrons of every capture at which it stops measuring light."""
        model = self.model()
        if self.combine_bits:
            model = chip_combination.combined_model(model)
        return full_scale_e(model)

    def expected(self, light: xr.DataArray) -> xr.DataArray:
        """Return mean electrons (capture, y, x), dark charge included."""
        return expected_electrons(self.model(), light)

    def shot_form(self) -> ShotForm:
        """Return the names of the captures and the filter array, known before a shot."""
        names = tuple(reading.capture for reading in self.model().readings)
        if self.combine_bits:
            names = (chip_combination.CAPTURE,)
        return ShotForm(names, cell(self.cfa), self.black_rows)

    def check_field(self, width_m: float, height_m: float) -> None:
        """Refuse a field, in metres on the sensor plane, that is too small for the pixels, and
        pixels beyond the table of the microlenses.
        """
        counts = pixel_counts(width_m, height_m, self.pitch_um, self.rows, self.columns)
        if lenses := self.model().microlenses:
            microlens.check_corner(lenses, *counts, self.pitch_um)

    def shot_time_s(self, width_m: float, height_m: float) -> float:
        """Return the duration, s, of a shot of an image of this size in metres. With automatic
        exposure it is that of the longest exposure.
        """
        rows, _ = pixel_counts(width_m, height_m, self.pitch_um, self.rows, self.columns)
        fixed = self.exposure_rule == "fixed"
        return shot_time_s(self.model(), rows, self.exposure_s if fixed else self.exposure_max_s)

    def pixel_need(self, width_m: float, height_m: float) -> Need:
        """Return the memory of the pixels over an image of this size, in metres, as
        `isethdr_core.pipeline.memory.Need`.
        """
        return pixel_need(self.model(), width_m, height_m)

    def narrow(self, demand: Demand) -> Demand:
        """Return the demand limited to the sensor's window, without the outer bands in which the
        sensor does not respond, and with the response of the sensor.
        """
        model = self.model()
        if self.exposure_rule == "fixed":
            return ask(model, narrow(model, demand), self.exposure_s)
        quietest = self.with_gain(self.auto_gain_max).model() if self.auto_gain_max > 1 else model
        return ask(model, narrow(model, demand), self.exposure_max_s, quietest)

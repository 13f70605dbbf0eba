"""Ideal sensor: the limit of every other sensor with its effects switched off."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from isethdr_core.pipeline.early_checks import ShotForm
from isethdr_core.plugins.ranges import check_ranges

from .limits import Exposure, FillFactor, Pitch, Pixels, QuantumEfficiency
from .readout.shot import expected_electrons, take_shot
from .sampling.pixel_grid import pixel_counts, pixel_need
from .sensor_model import Photodiode, Reading, SensorModel
from .spectral.colour_filter_array import cell
from .spectral.quantum_efficiency import narrow

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.pipeline.demand import Demand
    from isethdr_core.pipeline.memory import Need
    from isethdr_core.runs.seeds import Generator


@dataclass(frozen=True)
class IdealSensor:
    """Count electrons without noise, dark charge, saturation or rounding; raw is mean electrons.

    With cfa=W and curves=unit it counts photons.
    """

    THREAD_SAFE: ClassVar[bool] = True

    noise: ClassVar[bool] = False  # all shots are equal

    exposure_s: Exposure = 0.016  # exposure time
    pitch_um: Pitch = 3.0  # pixel pitch
    rows: Pixels = 0  # number of pixel rows: 0 fills the camera's field, less is a centred crop
    # number of pixel columns: 0 fills the camera's field, less is a centred crop
    columns: Pixels = 0
    fill_factor: FillFactor = 1.0  # photodiode area / pixel area
    # repeated pattern of colour filters; rows separated by / where the pattern is not square
    cfa: str = "RGGB"
    # quantum efficiency curves; unit is one electron per photon at every wavelength
    curves: Literal["ar0132at", "unit"] = "ar0132at"
    peak_qe: QuantumEfficiency = 1.0  # scale of the ar0132at curves, electrons per photon
    # ultraviolet and infrared blocking filter; also applied to qe_csv; not applied with curves=unit
    infrared_cut: bool = True
    # file with own quantum efficiency curves: wavelength_nm and one column per filter
    qe_csv: str = ""

    def input_files(self) -> tuple[Any, ...]:
        """Return the user's file of curves, if one is set. Its content is part of the name of a
        run.
        """
        return (self.qe_csv,) if self.qe_csv else ()

    def __post_init__(self) -> None:
        check_ranges(self)
        self.model()

    def model(self) -> SensorModel:
        """Return the photodiodes and readings of the sensor."""
        return SensorModel(
            self.exposure_s,
            self.pitch_um,
            self.rows,
            self.columns,
            self.cfa,
            (Photodiode("pixel", self.fill_factor),),
            (Reading("single"),),
            curves=self.curves,
            peak_qe=self.peak_qe,
            infrared_cut=self.infrared_cut,
            qe_csv=self.qe_csv,
            noise=False,
        )

    def __call__(self, light: xr.DataArray, generator: Generator | None = None) -> xr.Dataset:
        """Return captures of one shot; `generator` is not used."""
        return take_shot(self.model(), light, generator)

    def expected(self, light: xr.DataArray) -> xr.DataArray:
        """Return mean electrons (capture, y, x)."""
        return expected_electrons(self.model(), light)

    def shot_form(self) -> ShotForm:
        """Return the names of the captures and the filter array, known before a shot."""
        names = tuple(reading.capture for reading in self.model().readings)
        return ShotForm(names, cell(self.cfa))

    def check_field(self, width_m: float, height_m: float) -> None:
        """Refuse a field, in metres on the sensor plane, that is too small for the pixels."""
        pixel_counts(width_m, height_m, self.pitch_um, self.rows, self.columns)

    def pixel_need(self, width_m: float, height_m: float) -> Need:
        """Return the memory of the pixels over an image of this size, in metres, as
        `isethdr_core.pipeline.memory.Need`.
        """
        return pixel_need(self.model(), width_m, height_m)

    def narrow(self, demand: Demand) -> Demand:
        """Return the demand limited to the sensor's window, and without the outer bands in which
        the sensor does not respond.
        """
        return narrow(self.model(), demand)

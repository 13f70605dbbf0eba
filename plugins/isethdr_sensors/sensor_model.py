"""Sensor model: photodiodes that collect charge, and readings that convert charge to DN.

Every sensor of this plugin builds one `SensorModel` from its fields. `shot.py` works with this
model only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from isethdr_core.errors import ConfigError

from .limits import LONGEST_S
from .spectral.colour_filter_array import channels
from .spectral.spectral_curves import check_letters, read_csv


@dataclass(frozen=True)
class Photodiode:
    """One charge well. It is a centred square with the share `fill_factor` of the pixel's area."""

    name: str
    fill_factor: float = 1.0
    full_well_e: float = inf
    dark_e_per_s: float = 0.0  # mean dark current at the reference temperature
    dark_spread: float = 0.0  # rms over pixels / mean, persistent
    prnu: float = 0.0  # rms over pixels / mean, persistent
    exposure_share: float = 1.0  # exposure / the model's exposure_s
    # start of the exposure, counted from the start of the row's first exposure / the model's
    # exposure_s
    start_share: float = 0.0
    # key of the persistent maps; "": the name. Several exposures of one photodiode have the same
    # key.
    silicon: str = ""
    blooming_percent: float = 0.0  # share of the charge beyond the well that flows along the column
    hot_percent: float = 0.0  # share of hot pixels, persistent
    # mean extra dark current of the hot pixels at the reference temperature
    hot_dark_e_per_s: float = 0.0


@dataclass(frozen=True)
class Reading:
    """One capture: the charge of photodiode number `diode`, amplified and digitised."""

    capture: str
    diode: int = 0
    read_noise_e: float = 0.0
    dsnu_e: float = 0.0  # rms over pixels of the offset, persistent
    column_e: float = 0.0  # rms over columns of the offset, persistent
    gain_dn_per_e: float = 1.0
    black_dn: float = 0.0
    bits: int = 0  # 0: converter off, raw is float32
    swing_e: float = inf  # charge at the full scale of the amplifier or the converter
    row_e: float = 0.0  # rms over rows of the offset, persistent
    row_noise_e: float = 0.0  # rms over rows of the offset, new in every reading
    read_tail_percent: float = 0.0  # share of pixels with more read noise, persistent
    telegraph_percent: float = 0.0  # share of pixels with random telegraph noise, persistent
    telegraph_e: float = 0.0  # mean step of the traps of these pixels
    inl_dn: float = 0.0  # largest deviation of the converter from a straight line
    # knees (linear DN, companded DN); none: linear
    companding: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Microlenses:
    """Shift of microlenses over the image, and response of a pixel to the angle of the light."""

    # points (image height mm, degrees): the chief-ray angle for which microlenses are shifted
    design_deg: tuple[tuple[float, float], ...]
    # points (degrees between a chief ray and that angle, response relative to the largest)
    response: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class SensorModel:
    """All that one shot needs in addition to light and random numbers."""

    exposure_s: float
    pitch_um: float
    rows: int
    columns: int
    cfa: str
    photodiodes: tuple[Photodiode, ...]
    readings: tuple[Reading, ...]
    curves: str = "ar0132at"  # ar0132at, unit
    peak_qe: float = 1.0
    infrared_cut: bool = True
    qe_csv: str = ""
    temperature_c: float = 60.0
    noise: bool = True
    # share of a pixel's light at 550 nm that its neighbours collect
    optical_crosstalk_percent: float = 0.0
    optical_crosstalk_power: float = 1.0  # exponent of the wavelength to which the share grows
    # share of a pixel's electrons that its neighbours collect
    electrical_crosstalk_percent: float = 0.0
    # sensitivity of pixels written in lower case in `cfa` / that of the others
    lower_case_share: float = 1.0
    lower_case_dark: float = 1.0  # dark charge of these pixels / that of the others
    # rolling shutter: time from the start of a row to that of the next; 0: global shutter
    line_time_s: float = 0.0

    black_rows: int = 0  # number of rows without light, read after the image
    # smallest extra dark current of a pixel in the map of defects, at the reference temperature
    defect_e_per_s: float = inf
    microlenses: Microlenses | None = None  # None: pixels respond to all angles alike
    # bits of the code into which the chip combines all readings; 0: all readings leave the chip
    combine_bits: int = 0
    combine_companding: tuple[tuple[float, float], ...] = ()  # knees of that code

    def __post_init__(self) -> None:
        check(self, OF_MODEL)
        if self.qe_csv:
            read_csv(self.qe_csv)
        elif self.curves != "unit":
            check_letters(channels(self.cfa))
        for diode in self.photodiodes:
            check(diode, OF_PHOTODIODE)
        for reading in self.readings:
            check(reading, OF_READING)

    def diode_of(self, reading: Reading) -> Photodiode:
        """Return the photodiode of `reading`."""
        return self.photodiodes[reading.diode]

    def exposure_of(self, diode: Photodiode) -> float:
        """Return the exposure of `diode`, seconds."""
        return self.exposure_s * diode.exposure_share


class Limit(NamedTuple):
    """Allowed values of fields."""

    fields: tuple[str, ...]
    allowed: Callable[[float], bool]  # function of a value; false for NaN
    expected: str  # description of allowed values
    known_as: str = ""  # name of the field that users set; "": the same name


OF_MODEL = (
    Limit(("exposure_s", "pitch_um", "peak_qe"), lambda v: 0 < v < inf, "a finite number above 0"),
    Limit(
        ("exposure_s",),
        lambda v: v <= LONGEST_S,
        "at most 3600 s: dark charge alone fills a longer exposure",
    ),
    Limit(
        ("line_time_s",),
        lambda v: 0 <= v <= 1,
        "seconds from row to row within 0..1; 0 is a global shutter",
    ),
    Limit(
        ("rows", "columns"),
        lambda v: v >= 0 and v == int(v),
        "a whole number; 0 fills the camera's field",
    ),
    Limit(("temperature_c",), lambda v: -100 <= v <= 200, "degrees Celsius within -100..200"),
    Limit(
        ("optical_crosstalk_percent", "electrical_crosstalk_percent"),
        lambda v: 0 <= v <= 80,
        "percent within 0..80",
    ),
    Limit(("optical_crosstalk_power",), lambda v: -10 <= v <= 10, "an exponent within -10..10"),
    Limit(
        ("lower_case_share",),
        lambda v: 0 < v <= 1,
        "percent above 0, at most 100",
        "lower_case_percent",
    ),
)
OF_PHOTODIODE = (
    Limit(("fill_factor",), lambda v: 0 < v <= 1, "a share of the pixel's area above 0, at most 1"),
    Limit(("full_well_e",), lambda v: v > 0, "electrons, above 0"),
    Limit(
        ("exposure_share",),
        lambda v: 0 < v <= 1,
        "shares of exposure_s above 0, at most 1",
        "exposure_ratios",
    ),
    Limit(("blooming_percent", "hot_percent"), lambda v: 0 <= v <= 100, "percent within 0..100"),
    Limit(
        ("dark_e_per_s", "dark_spread", "prnu", "hot_dark_e_per_s"),
        lambda v: 0 <= v < inf,
        "a finite number, 0 or above",
    ),
)
OF_READING = (
    Limit(("read_tail_percent",), lambda v: 0 <= v <= 100, "percent within 0..100"),
    Limit(("inl_dn",), lambda v: -inf < v < inf, "a finite number of DN"),
    Limit(
        ("read_noise_e", "dsnu_e", "column_e", "row_e", "row_noise_e"),
        lambda v: 0 <= v < inf,
        "electrons, 0 or above",
    ),
)


def check(part: SensorModel | Photodiode | Reading, limits: Sequence[Limit]) -> None:
    """Raise ConfigError if a field is outside its limits.

    Parameters
    ----------
    part : object with the fields to check.
    limits : allowed values of its fields.
    """
    for limit in limits:
        for field in limit.fields:
            value = getattr(part, field)
            if not limit.allowed(value):
                name = limit.known_as or field
                raise ConfigError(
                    f"sensor.{name} is {value!r}; expected {limit.expected};"
                    f" type sensor.{name}=<number>"
                )

"""Contract: the properties that a model file states, as JSON under the key `isethdr` of its
metadata.

docs/how-to/network_isp.md has the contract as tables. `isethdr train picture` writes such files.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from isethdr_core.errors import ConfigError
from isethdr_core.onnx_session import OnnxSession, Port, shape_text
from isethdr_core.pipeline.early_checks import ShotForm

KEY = "isethdr"  # key of the contract in the file's metadata
VERSION = 1  # version of the contract
INPUTS = ("raw", "noise", "masks", "valid")
PICTURE = "xyz"
VARIANCE = "variance"
FLOAT = "tensor(float)"
MERGED = "merged"
UNKNOWN = "unknown"
# smallest and largest ratio of stated to true variance with which the variance counts as known
LEAST_RATIO = 0.8
LARGEST_RATIO = 1.25


class CalibrationPoint(BaseModel):
    """Ratio of stated to true variance on held-out scenes of one illuminance."""

    model_config = ConfigDict(frozen=True)
    lux: float = Field(ge=0)
    stated_over_true: float = Field(gt=0)


_POINTS = TypeAdapter(tuple[CalibrationPoint, ...])
_NAMES = TypeAdapter(tuple[str, ...])


class _Stated(BaseModel):
    """The JSON of a model file. It may have further keys, which are not used."""

    model_config = ConfigDict(extra="allow", allow_inf_nan=False)
    contract: int
    cfa: str = Field(min_length=1)
    channels: list[str] = Field(min_length=1)
    captures: str | list[str]
    unit_channel: str
    multiple_px: int = Field(ge=1, le=4096)
    reach_px: int | None = Field(default=None, ge=0)
    calibration: str | list[CalibrationPoint]
    quantum_efficiency: dict[str, list[float]] = {}
    wavelength_nm: list[float] = []
    range_e: tuple[float, float] | None = None


@dataclass(frozen=True)
class Contract:
    """The sensors for which a model is made, and the meaning of its inputs and outputs."""

    cfa: str  # rows of the filter array's cell, separated by /
    channels: tuple[str, ...]  # letters of the array, in the order of `masks`
    # names of the captures; empty or "merged": one mosaic, merged from all captures
    captures: tuple[str, ...]
    unit_channel: str  # the electrons of `xyz` are those of this channel for a grey in daylight
    multiple_px: int  # rows and columns of the inputs must be multiples of this number
    # largest distance from an output to an input that it depends on; inf: no limit, None: not
    # stated
    reach_px: float | None = None
    # points, also as {"lux": ..., "stated_over_true": ...}; empty or "unknown": unknown
    calibration: tuple[CalibrationPoint, ...] = ()
    # {channel: electrons per photon} at `wavelength_nm`
    quantum_efficiency: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    wavelength_nm: tuple[float, ...] = ()  # wavelengths of `quantum_efficiency`
    # smallest and largest mean level of `raw` in training
    range_e: tuple[float, float] | None = None
    other: Mapping[str, Any] = field(default_factory=dict)  # further keys, kept but not used

    def __post_init__(self) -> None:
        """Convert `captures` and `calibration` from the form that they have in a model file.

        Raises
        ------
        ConfigError : one of them has neither this form nor that of the class.
        """
        object.__setattr__(self, "captures", _names_of(self.captures))
        object.__setattr__(self, "calibration", _points_of(self.calibration))

    @classmethod
    def from_json(cls, text: str, source: str = "the model") -> Contract:
        """Return the contract that a file states.

        Parameters
        ----------
        text : JSON.
        source : the file, as the subject of messages.

        Raises
        ------
        ConfigError : the text is not JSON, has another version, or a key is missing or wrong.
        """
        try:
            stated = _Stated.model_validate(json.loads(text))
        except ValidationError as error:
            # for a union of types, the deepest location is the most specific error
            first = max(error.errors(), key=lambda one: len(one["loc"]))
            place = ".".join(map(str, first["loc"])) or "the whole"
            raise ConfigError(
                f"{source} states {KEY}.{place}: {first['msg']}, got {_short(first['input'])};"
                " expected the keys of docs/how-to/network_isp.md; export the model again"
            ) from None
        except ValueError as error:
            raise ConfigError(
                f"{source} states {KEY}={_short(text)}, which is no JSON ({error}); expected the"
                " keys of docs/how-to/network_isp.md; export the model again"
            ) from None
        return _checked(stated, source)

    def to_json(self) -> str:
        """Return the JSON that `from_json` reads."""
        stated: dict[str, Any] = {
            "contract": VERSION,
            "cfa": self.cfa,
            "channels": list(self.channels),
            "captures": list(self.captures) or MERGED,
            "unit_channel": self.unit_channel,
            "multiple_px": self.multiple_px,
        }
        if self.reach_px is not None:
            stated["reach_px"] = None if math.isinf(self.reach_px) else int(self.reach_px)
        points = [point.model_dump() for point in self.calibration]
        stated["calibration"] = points or UNKNOWN
        if self.quantum_efficiency:
            stated["quantum_efficiency"] = {k: list(v) for k, v in self.quantum_efficiency.items()}
            stated["wavelength_nm"] = list(self.wavelength_nm)
        if self.range_e is not None:
            stated["range_e"] = list(self.range_e)
        return json.dumps(stated | dict(self.other))

    @property
    def cell(self) -> np.ndarray:
        """Letters (row, column) of the filter array's cell."""
        return np.array([list(row) for row in self.cfa.split("/")])

    @property
    def planes(self) -> int:
        """Number of planes of `raw`."""
        return len(self.captures) or 1

    def worst_ratio(self) -> float | None:
        """Return the ratio of stated to true variance that is farthest from 1; None if unknown."""
        ratios = [point.stated_over_true for point in self.calibration]
        return max(ratios, key=lambda ratio: abs(math.log(ratio)), default=None)

    def variance_calibrated(self) -> bool:
        """Return whether all ratios of stated to true variance lie within 0.8 to 1.25."""
        return bool(self.calibration) and all(
            LEAST_RATIO <= point.stated_over_true <= LARGEST_RATIO for point in self.calibration
        )

    def check_ports(self, session: OnnxSession) -> None:
        """Raise ConfigError unless the inputs and outputs of a model are those of the contract."""
        shapes = {
            "raw": (1, self.planes, None, None),
            "noise": (1, self.planes, None, None),
            "masks": (1, len(self.channels), None, None),
            "valid": (1, self.planes, None, None),
        }
        names = [port.name for port in session.inputs]
        unknown = [name for name in names if name not in shapes]
        if unknown or "raw" not in names:
            raise ConfigError(
                f"{session.path} has the inputs {', '.join(names) or 'none'}; expected raw, and"
                f" any of {', '.join(INPUTS[1:])}; export the model with these names"
            )
        for port in session.inputs:
            _check_port(session, port, shapes[port.name])
        results = {port.name: port for port in session.outputs}
        if PICTURE not in results:
            raise ConfigError(
                f"{session.path} has the outputs {', '.join(results) or 'none'}; expected"
                f" {PICTURE}, and {VARIANCE} where it states one; export it with these names"
            )
        for name in (PICTURE, VARIANCE):
            if name in results:
                _check_port(session, results[name], (1, 3, None, None))

    def check_form(self, form: ShotForm, source: str) -> None:
        """Raise ConfigError unless the model is made for the captures and filters of a sensor.

        Parameters
        ----------
        form : captures and filter array of the sensor.
        source : the file, as the subject of messages.
        """
        if self.captures and self.captures != form.captures:
            raise ConfigError(
                f"{source} joins the captures {', '.join(self.captures)}; the sensor has"
                f" {', '.join(form.captures)}; expected the same, in this order; train a model for"
                " this sensor, or take one with captures: merged"
            )
        letters = np.array([list(row) for row in form.filters])
        if phase(letters, self.cell) is None:
            raise ConfigError(
                f"{source} is for the filter array {self.cfa}; the sensor has"
                f" {'/'.join(form.filters)}; expected the same array, shifted or not; type for"
                f" example sensor.cfa={self.cfa}, or train a model for this array"
            )


def phase(letters: np.ndarray, cell: np.ndarray) -> tuple[int, int] | None:
    """Return the row and column of `cell` at which an array begins; None for another array.

    Parameters
    ----------
    letters, cell : (row, column) letters of one period or more.
    """
    size = np.lcm(cell.shape, letters.shape)
    repeated = np.tile(cell, size // cell.shape)
    own = np.tile(letters, size // letters.shape)
    for row, column in np.ndindex(*cell.shape):
        if np.array_equal(np.roll(repeated, (-row, -column), (0, 1)), own):
            return row, column
    return None


def _names_of(captures: str | Iterable[str]) -> tuple[str, ...]:
    """Return the names of captures; none for the text `merged`."""
    if isinstance(captures, str) and captures == MERGED:
        return ()
    try:
        return _NAMES.validate_python(captures)
    except ValidationError:
        raise ConfigError(
            f"the contract of a model has captures={_short(captures)}; expected the names of the"
            f' captures as a tuple, or "{MERGED}"; type for example captures=("LPLG", "LPHG",'
            ' "SPLG")'
        ) from None


def _points_of(
    calibration: str | Iterable[CalibrationPoint | Mapping[str, float]],
) -> tuple[CalibrationPoint, ...]:
    """Return the points of a calibration; none for the text `unknown`."""
    # an array compares its elements with a text
    if isinstance(calibration, str) and calibration == UNKNOWN:
        return ()
    try:
        return _POINTS.validate_python(calibration)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, ("calibration", *first["loc"])))
        raise ConfigError(
            f"the contract of a model has {place}={_short(first['input'])} ({first['msg']});"
            f' expected "{UNKNOWN}", or points with lux and stated_over_true above 0; type for'
            ' example calibration=[{"lux": 0.1, "stated_over_true": 1.04}]'
        ) from None


def _checked(stated: _Stated, source: str) -> Contract:
    """Return the contract after checking that its keys are consistent with each other."""

    def refuse(key: str, wrong: object, expected: str) -> ConfigError:
        return ConfigError(
            f"{source} states {KEY}.{key}={_short(wrong)}; expected {expected}"
            " (docs/how-to/network_isp.md); export the model again"
        )

    if stated.contract != VERSION:
        raise refuse("contract", stated.contract, f"{VERSION}, which this version reads")
    rows = stated.cfa.split("/")
    if not all(rows) or len({len(row) for row in rows}) > 1:
        raise refuse("cfa", stated.cfa, "rows of equal length parted by /, as RG/GB")
    if sorted(stated.channels) != sorted({*"".join(rows)}):
        raise refuse("channels", stated.channels, f"every letter of {stated.cfa} once")
    if stated.unit_channel not in stated.channels:
        raise refuse("unit_channel", stated.unit_channel, f"one of {', '.join(stated.channels)}")
    if any(stated.multiple_px % side for side in (len(rows), len(rows[0]))):
        raise refuse("multiple_px", stated.multiple_px, f"a multiple of the cell {stated.cfa}")
    if isinstance(stated.captures, str) and stated.captures != MERGED or not stated.captures:
        raise refuse("captures", stated.captures, f'"{MERGED}" or the names of the captures')
    if isinstance(stated.calibration, str) and stated.calibration != UNKNOWN:
        raise refuse("calibration", stated.calibration, f'"{UNKNOWN}" or lux, stated_over_true')
    curves = stated.quantum_efficiency
    if curves and (
        {*curves} != {*stated.channels}
        or any(len(curve) != len(stated.wavelength_nm) for curve in curves.values())
        or np.any(np.diff(stated.wavelength_nm) <= 0)
    ):
        raise refuse(
            "quantum_efficiency",
            curves,
            "one curve per channel on rising wavelength_nm",
        )
    reach: float | None = None
    if "reach_px" in stated.model_fields_set:
        reach = math.inf if stated.reach_px is None else stated.reach_px
    return Contract(
        cfa=stated.cfa,
        channels=tuple(stated.channels),
        captures=_names_of(stated.captures),
        unit_channel=stated.unit_channel,
        multiple_px=stated.multiple_px,
        reach_px=reach,
        calibration=_points_of(stated.calibration),
        quantum_efficiency={k: tuple(v) for k, v in curves.items()},
        wavelength_nm=tuple(stated.wavelength_nm),
        range_e=stated.range_e,
        other=stated.model_extra or {},
    )


def _check_port(session: OnnxSession, port: Port, want: tuple[int | None, ...]) -> None:
    fits = len(port.shape) == len(want) and all(
        have is None or need is None or have == need for have, need in zip(port.shape, want)
    )
    if not fits or port.type != FLOAT:
        raise ConfigError(
            f"{session.path} has {port.name!r} with the shape {shape_text(port.shape)} of"
            f" {port.type}; expected {shape_text(want)} of {FLOAT}; export the model again"
        )


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."

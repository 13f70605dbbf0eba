"""Lens data: the content of a lens file of any program, in millimetres."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import zip_longest

import numpy as np

from isethdr_core.errors import ConfigError

REFERENCE_NM = 587.56
POWERS = {power: f"a{power}" for power in range(1, 31)}


@dataclass
class Row:
    """A surface and the medium behind it.

    Parameters
    ----------
    label : number of the surface in its file, for messages.
    terms : {power of r: coefficient, mm^(1 - power)} of the asphere.
    glass : name of the glass in the file; "" for air.
    automatic : whether the other program computed the semi-diameter from its field angles.
    """

    label: str
    radius_mm: float = np.inf
    thickness_mm: float = 0.0
    glass: str = ""
    conic: float = 0.0
    terms: dict[int, float] = field(default_factory=dict)
    semi_diameter_mm: float = np.inf
    automatic: bool = False
    is_stop: bool = False


@dataclass
class LensData:
    """Surfaces from front to back, without object and image; wavelength, field and aperture.

    Parameters
    ----------
    half_field_deg : largest field angle; None if the file states none above 0.
    entrance_pupil_mm, f_number : the aperture, by its diameter or by the f-number. Without both,
        the semi-diameter of the stop sets the aperture.
    far_object : whether the image distance is that of a distant object.
    glasses : {name: description} of glasses that the file itself defines; the description is an
        argument of `physics.optics.glass.index`.
    notes : differences from the file.
    """

    name: str
    source: str
    rows: list[Row]
    reference_nm: float = REFERENCE_NM
    half_field_deg: float | None = None
    entrance_pupil_mm: float | None = None
    f_number: float | None = None
    far_object: bool = True
    glasses: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


@dataclass
class Problems:
    """Surfaces of a file that cannot be imported; one error names all of them."""

    messages: list[str] = field(default_factory=list)

    def add(self, label: str, message: str) -> None:
        """Record that a surface cannot be imported."""
        self.messages.append(f"surface {label}: {message}")

    def refuse(self, path: object) -> None:
        """Raise ConfigError if anything was recorded."""
        if self.messages:
            raise ConfigError(
                f"{path} cannot be imported: {'; '.join(self.messages)}; expected centred spheres,"
                " conics and aspheres of r^3 to r^30 that refract"
            )


def number(text: str, where: str) -> float:
    """Return the number that a word of a file states.

    Parameters
    ----------
    text : word of the file.
    where : position in the file, for the error.

    Raises
    ------
    ConfigError : `text` is not a number.
    """
    try:
        value = float(text)
    except ValueError:
        raise ConfigError(f"{where} has {text!r}; expected a number") from None
    if np.isnan(value):
        raise ConfigError(f"{where} has {text!r}; expected a number")
    return value


def integer(text: str, where: str) -> int:
    """Return the whole number that a word of a file states.

    Parameters
    ----------
    text, where : as in `number`.

    Raises
    ------
    ConfigError : `text` is not a whole number.
    """
    value = number(text, where)
    if not value.is_integer():  # false for infinity as well
        raise ConfigError(f"{where} has {text!r}; expected a whole number")
    return int(value)


def unit_mm(text: str, units: Mapping[str, float], where: str) -> float:
    """Return how many millimetres the unit of length of a file has.

    Parameters
    ----------
    text : name of the unit in the file.
    units : {name in upper case: length, mm} of the known units.
    where : position in the file, for the error.

    Raises
    ------
    ConfigError : the unit is not known.
    """
    try:
        return units[text.upper()]
    except KeyError:
        raise ConfigError(
            f"{where} has the unit {text!r}; expected one of {', '.join(units)}; save the lens in"
            " millimetres in the other program"
        ) from None


def widest_deg(x_deg: Sequence[float], y_deg: Sequence[float]) -> float:
    """Return the largest angle to the axis of the field points of a file, degrees; 0 without any.

    Parameters
    ----------
    x_deg, y_deg : angles of the field points along x and y, degrees. Their tangents are the
        components of the direction. The shorter list is continued by 0.
    """
    widest = 0.0
    for x, y in zip_longest(x_deg, y_deg, fillvalue=0.0):
        if x and y and max(abs(x), abs(y)) < 90:
            angle = np.degrees(np.arctan(np.hypot(*np.tan(np.radians([x, y])))))
        else:  # along one axis, or beyond tangents
            angle = max(abs(x), abs(y))
        widest = max(widest, float(angle))
    return widest

"""Files of ANSI/IES LM-63 (1986 to 2019): candela in C planes (type C), or in level angles (A, B).

Level angles count to the right as seen from the lamp. A file of one quarter or half is completed by
its symmetry. The intensities are multiplied by the multiplier and the ballast factor of the file,
and in files of 1986 and 1991 by the ballast-lamp photometric factor; later files have a number of
another meaning in its place. The luminous opening is not used. The data after `TILT=` apply to a
luminaire that hangs tilted, and are not used.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from isethdr_core.errors import ConfigError

from .angles import WIDEST_DEG, MeasuredLamp, checked_candela, from_level, from_polar

TYPES = {1: "C", 2: "B", 3: "A"}
TILT = re.compile(r"^[ \t]*TILT=", re.MULTILINE | re.IGNORECASE)
# in the first line of files of 1995 and later
LATER = re.compile(r".*LM-63-(?!(19)?(86|91)\b)")
END_OF_FILE = "\x1a\0"  # programs of DOS end a text with the first, and fill up with the second


def read_ies(path: Path) -> MeasuredLamp:
    """Return the lamp of a file.

    Raises
    ------
    ConfigError : the file does not conform to LM-63, has intensities that are negative or
        not finite, or has no light in front of the lamp.
    """
    text = path.read_text(encoding="latin-1").rstrip(END_OF_FILE + " \r\n")
    tilt = TILT.search(text)
    if tilt is None:
        raise ConfigError(f"{path.name} has no line TILT=; expected a file of LM-63")
    kind, _, after_tilt = text[tilt.end() :].partition("\n")
    try:
        numbers = [float(v) for v in after_tilt.replace(",", " ").split()]
        if kind.strip().upper() == "INCLUDE":
            numbers = numbers[2 + 2 * int(numbers[1]) :]
        head_numbers = numbers[:13]
        numbers = numbers[13:]
        count, across, photometry = (int(head_numbers[k]) for k in (3, 4, 5))
        factor = head_numbers[2] * head_numbers[10]
        if not LATER.match(text):
            factor *= head_numbers[11] or 1.0  # 0 states no factor
        vertical, level, candela = np.split(np.array(numbers), [count, count + across])
    except (ValueError, IndexError, OverflowError):  # the last one: an infinite count
        raise ConfigError(
            f"{path.name} ends early or holds no numbers after TILT={kind.strip()}; expected 13"
            " numbers, the angles and the candela of LM-63"
        ) from None
    _check(path, vertical, level, photometry, count * across)
    if len(candela) != count * across:
        raise ConfigError(
            f"{path.name} has {len(candela)} values of candela after its angles; expected"
            f" {across} planes of {count} values each, {count * across}, as its first line of"
            " numbers says; correct the counts or the values of the file"
        )
    candela = checked_candela(path.name, factor * candela.reshape(across, count))
    if TYPES[photometry] == "C":
        planes, candela = whole_turn(level, candela)
        return from_polar(path.name, planes, vertical, candela)
    if level[0] == 0 and len(level) > 1:  # the file holds one of two equal halves
        level = np.r_[-level[:0:-1], level]
        candela = np.concatenate([candela[:0:-1], candela])
    if vertical[0] == 0 and len(vertical) > 1:
        vertical = np.r_[-vertical[:0:-1], vertical]
        candela = np.concatenate([candela[:, :0:-1], candela], 1)
    if len(level) < 2:
        raise ConfigError(
            f"{path.name} has one horizontal angle alone; expected two or more in types A and B"
        )
    return from_level(path.name, level, vertical, candela, TYPES[photometry] == "B")


def whole_turn(planes: np.ndarray, candela: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return C planes that cover 0 to 360 degrees, and their intensities (planes, angles).

    They are completed by symmetry. The angle of the last plane states it: 0 for a round pattern,
    90 for four equal quarters, 180 for two equal halves. Planes from 90 to 270 are one of two equal
    halves as well.
    """
    if len(planes) == 1:
        return np.array([0.0, 360.0]), np.repeat(candela, 2, 0)
    if planes[0] == 90:
        planes = np.r_[planes, 540 - planes[-2::-1]]
        candela = np.concatenate([candela, candela[-2::-1]])
        return np.r_[planes - 360, planes[1:]], np.concatenate([candela, candela[1:]])
    if planes[-1] == 90:
        planes = np.r_[planes, 180 - planes[-2::-1]]
        candela = np.concatenate([candela, candela[-2::-1]])
    if planes[-1] == 180:
        planes = np.r_[planes, 360 - planes[-2::-1]]
        candela = np.concatenate([candela, candela[-2::-1]])
    if planes[-1] < 360:
        planes = np.r_[planes, 360.0]
        candela = np.concatenate([candela, candela[:1]])
    return planes, candela


def _check(
    path: Path, vertical: np.ndarray, level: np.ndarray, photometry: int, values: int
) -> None:
    rising = all((np.diff(v) > 0).all() for v in (vertical, level))
    if photometry not in TYPES or not rising or not values:
        raise ConfigError(
            f"{path.name} has photometric type {photometry}, and angles that"
            f" {'rise' if rising else 'do not rise'}; expected type 1, 2 or 3 and rising angles"
        )
    if len(vertical) < 2:
        raise ConfigError(
            f"{path.name} has one vertical angle alone, {vertical[0]:g} degrees; expected two or"
            " more, since one angle is no light distribution"
        )
    widest = max(np.abs(v).max() for v in (vertical, level))
    if TYPES[photometry] != "C" and widest > WIDEST_DEG:
        raise ConfigError(
            f"{path.name} has an angle {widest:g} degrees off the axis; expected"
            f" {-WIDEST_DEG:g} to {WIDEST_DEG:g} degrees in types A and B; remove the angles behind"
            " the lamp with their values"
        )
    if TYPES[photometry] == "C" and len(level) > 1 and not _is_turn(level[0], level[-1]):
        raise ConfigError(
            f"{path.name} has C planes from {level[0]:g} to {level[-1]:g} degrees; expected planes"
            " from 0 to 90, to 180 or farther up to 360, or from 90 to 270"
        )


def _is_turn(first: float, last: float) -> bool:
    """Return whether C planes between two angles, degrees, stand for a whole turn."""
    return (first, last) == (90, 270) or first == 0 and (last == 90 or 180 <= last <= 360)

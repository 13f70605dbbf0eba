"""Conversion of the angles of photometric files to those of an `IntensityTable`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from isethdr_core.errors import ConfigError
from isethdr_core.scene import IntensityTable

WIDEST_DEG = 90.0  # largest angle of a table; light behind the lamp is left out
STEP_DEG = 1.0  # angular step of tables made from polar files


class MeasuredLamp(NamedTuple):
    """A table relative to its largest intensity, and this intensity, cd."""

    table: IntensityTable
    intensity_cd: float


def checked_candela(name: str, candela: np.ndarray) -> np.ndarray:
    """Return the intensities of a file, unchanged.

    Parameters
    ----------
    name : name of the file, for the error.
    candela : luminous intensities with all factors of the file, cd, of any shape.

    Raises
    ------
    ConfigError : a value is NaN, infinite or negative.
    """
    wrong = candela[~((candela >= 0) & np.isfinite(candela))]
    if wrong.size:
        raise ConfigError(
            f"{name} has {wrong.size} wrong intensities, such as {wrong[0]:g} cd; expected finite"
            " candela, 0 or more; correct the values or the factors of the file"
        )
    return candela


def from_polar(
    name: str, c_deg: np.ndarray, gamma_deg: np.ndarray, candela: np.ndarray
) -> MeasuredLamp:
    """Return a lamp from intensities in C planes by gamma angles. Its axis is gamma 0.

    Parameters
    ----------
    name : name of the file, for errors.
    c_deg : (planes,) increasing from 0 to 360. C0 is to the right of a lamp that looks ahead, C90
        up.
    gamma_deg : (angles,) increasing, from 0 on.
    candela : (planes, angles) luminous intensity, cd.

    Raises
    ------
    ConfigError : no light falls in front of the lamp.
    """
    side = np.arange(-WIDEST_DEG, WIDEST_DEG + STEP_DEG / 2, STEP_DEG)
    left = np.radians(side)
    up = np.radians(side)[:, None]
    ahead = np.cos(up) * np.cos(left)
    aside = np.cos(up) * np.sin(left)
    above = np.sin(up)
    gamma = np.degrees(np.arccos(np.clip(ahead, -1, 1)))
    plane = np.mod(np.degrees(np.arctan2(above, -aside)), 360)
    return _lamp(name, side, side, _looked_up(c_deg, gamma_deg, candela, plane, gamma))


def from_level(
    name: str,
    right_deg: np.ndarray,
    up_deg: np.ndarray,
    candela: np.ndarray,
    polar_axis_level: bool,
) -> MeasuredLamp:
    """Return a lamp from intensities by angles to the right and up.

    Parameters
    ----------
    name : name of the file, for errors.
    right_deg : (n,) angles to the right, degrees, increasing.
    up_deg : (m,) angles upwards, degrees, increasing.
    candela : (n, m) luminous intensity, cd.
    polar_axis_level : whether the file is of type B of LM-63, where planes turn about a level axis;
        else it is of type A, where planes turn about the vertical axis, as in a table.

    Raises
    ------
    ConfigError : as in `from_polar`.
    """
    right = np.asarray(right_deg, float)
    above = np.asarray(up_deg, float)
    value = np.asarray(candela, float)
    if not polar_axis_level:
        return _lamp(name, -right[::-1], above, value[::-1].T)
    left_nodes = -right[::-1]
    left = np.radians(left_nodes)
    up = np.radians(above)[:, None]
    x = np.degrees(np.arcsin(-np.cos(up) * np.sin(left)))
    y = np.degrees(np.arctan2(np.sin(up), np.cos(up) * np.cos(left)))
    return _lamp(name, left_nodes, above, _looked_up(right, above, value, x, y))


def _looked_up(
    first: np.ndarray,
    second: np.ndarray,
    values: np.ndarray,
    at_first: np.ndarray,
    at_second: np.ndarray,
) -> np.ndarray:
    look = RegularGridInterpolator((first, second), values, bounds_error=False, fill_value=0.0)
    return look(np.stack(np.broadcast_arrays(at_first, at_second), -1))


def _lamp(name: str, left_deg: np.ndarray, up_deg: np.ndarray, value: np.ndarray) -> MeasuredLamp:
    peak = float(np.max(value, initial=0.0))
    if peak == 0:
        raise ConfigError(
            f"{name} has no light in front of the lamp; expected some candela above 0 within"
            f" {WIDEST_DEG:g} degrees of its axis; correct the values, the factors or the angles of"
            " the file"
        )
    return MeasuredLamp(IntensityTable(left_deg, up_deg, value / peak), peak)

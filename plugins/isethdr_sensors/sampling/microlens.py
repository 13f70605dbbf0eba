"""Microlenses: the share of the light that a pixel accepts, by the angle of its chief ray.

The microlens of a pixel off the axis is shifted, so that light at its design angle falls on the
photodiode. Only part of the light at other angles does (Catrysse and Wandell 2002). The sensor has
tables of the design angle over image height, and of the response over the deviation from the design
angle. The lens states the angle of its chief rays in the attribute `chief_rays` of the light.

References
----------
P. B. Catrysse and B. A. Wandell, Optical efficiency of image sensor pixels, J. Opt. Soc. Am. A
19(8), 1610-1620 (2002). G. Agranov, V. Berezin and R. H. Tsai, Crosstalk and microlens study in a
color CMOS image sensor, IEEE Trans. Electron Devices 50(1), 4-11 (2003).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.camera_geometry import table_values
from isethdr_core.errors import ConfigError

from ..sensor_model import Microlenses

if TYPE_CHECKING:
    import xarray as xr

    from .pixel_grid import PixelGrid

CHIEF_RAYS = "chief_rays"  # attribute of light: {radius_per_focal_length, angle_deg}
# angle below which a deviation counts as 0, and relative tolerance of the ends of tables; two cubic
# curves through the same points differ by rounding
SAME_DEG = 1e-9
CONE_KEY = "cone of rays"
FIELD_POINTS = 33  # number of points from the axis to the corner
CONE_RINGS = 8  # number of rings of equal area in the exit pupil, each with 16 azimuths

Points = Sequence[Sequence[float]]


def microlenses(design_deg: Points, response: Points) -> Microlenses | None:
    """Return the microlenses of two tables; None if both are empty.

    Parameters
    ----------
    design_deg : points (image height mm, degrees), from (0, 0).
    response : points (degrees off the design angle, response), from (0, 1).

    Raises
    ------
    ConfigError : one table is missing, the first point differs, or the first numbers of the points
        do not increase.
    """
    if not design_deg and not response:
        return None
    for name, points, first, example in (
        ("microlens_cra_deg", design_deg, (0, 0), "[[0,0],[3,20]]"),
        ("microlens_response", response, (0, 1), "[[0,1],[10,0.95],[20,0.8],[40,0.4]]"),
    ):
        at = [point[0] for point in points]
        rises = all(a < b for a, b in zip(at, at[1:]))
        if len(points) < 2 or tuple(points[0]) != first or not rises:
            raise ConfigError(
                f"sensor.{name} is {[list(p) for p in points]}; expected two or more points that"
                f" rise from {list(first)}, because microlenses need both tables, microlens_cra_deg"
                f" and microlens_response; type for example sensor.{name}={example}"
            )
    return Microlenses(*(tuple((float(a), float(b)) for a, b in t) for t in (design_deg, response)))


def check_corner(lenses: Microlenses, rows: int, columns: int, pitch_um: float) -> None:
    """Raise ConfigError if pixels lie beyond the table of the design angle.

    Parameters
    ----------
    lenses : microlenses of the sensor.
    rows, columns : numbers of pixels.
    pitch_um : pixel pitch, um.
    """
    _design_deg(lenses, np.array(1e-3 * pitch_um * np.hypot(rows - 1, columns - 1) / 2))


def accepted(lenses: Microlenses, light: xr.DataArray, grid: PixelGrid) -> np.ndarray | None:
    """Return the share (y, x) of the light that each pixel accepts, 0 to 1; None if the light
    states no chief rays.

    Parameters
    ----------
    lenses : microlenses of the sensor.
    light : irradiance or photocurrent, with the attribute `chief_rays`.
    grid : centres of the pixels, m.

    Raises
    ------
    ConfigError : pixels lie beyond the table of the design angle or that of the lens, or chief rays
        deviate from the design angle by more than the table of the response covers.
    """
    if CHIEF_RAYS not in light.attrs:
        return None
    radius_mm = 1e3 * np.hypot(grid.x_m[None, :], grid.y_m[:, None])
    return _response(lenses, np.abs(_mismatch_deg(lenses, light, radius_mm)))


def state(lenses: Microlenses, light: xr.DataArray, grid: PixelGrid) -> None:
    """State in the ledger the effects that the model of the microlenses leaves out.

    Parameters
    ----------
    lenses : microlenses of the sensor.
    light : irradiance or photocurrent.
    grid : centres of the pixels, m.
    """
    if CHIEF_RAYS not in light.attrs:
        ledger.left_out(
            "response of the microlenses to the angle of the light",
            "the lens states no chief rays",
            1 - min(value for _, value in lenses.response),
            "of the light of a pixel, at the end of microlens_response",
            key=CHIEF_RAYS,
        )
        return
    corner_mm = 1e3 * float(np.hypot(np.abs(grid.x_m).max(), np.abs(grid.y_m).max()))
    mismatch_deg = _mismatch_deg(lenses, light, np.linspace(0, corner_mm, FIELD_POINTS))
    ledger.left_out(
        "angles of the rays beside the chief ray at the microlenses",
        "the model uses the response to the chief ray for all rays and wavelengths",
        _cone_error(lenses, mismatch_deg, float(light.attrs["f_number"])),
        f"of the light of a pixel, for an even cone of f/{light.attrs['f_number']:g}",
        key=CONE_KEY,
    )


def _cone_error(lenses: Microlenses, mismatch_deg: np.ndarray, f_number: float) -> float:
    """Return the largest difference between the response to a chief ray and the mean response to
    the cone of rays around it, where the latter is relative to the cone on the axis. Beyond its
    table the response is constant.
    """
    half_deg = np.degrees(np.arctan(0.5 / f_number))
    ring = half_deg * np.sqrt((np.arange(CONE_RINGS) + 0.5) / CONE_RINGS)
    turn = np.pi * (np.arange(2 * CONE_RINGS) + 0.5) / CONE_RINGS
    along, across = (np.outer(ring, f(turn)).ravel() for f in (np.cos, np.sin))
    end = lenses.response[-1][0]

    def cone(offset_deg: np.ndarray) -> np.ndarray:
        off = np.hypot(offset_deg[:, None] + along, across)
        return _response(lenses, np.minimum(off, end)).mean(axis=1)

    chief = _response(lenses, np.abs(mismatch_deg))
    return float(np.abs(cone(mismatch_deg) / cone(np.zeros(1)) - chief).max())


def _mismatch_deg(lenses: Microlenses, light: xr.DataArray, radius_mm: np.ndarray) -> np.ndarray:
    """Return the chief-ray angle of the lens minus the design angle of the microlenses, degrees."""
    table = light.attrs[CHIEF_RAYS]
    per_focal_length = np.asarray(table["radius_per_focal_length"], float)
    end_mm = float(per_focal_length[-1] * light.attrs["focal_length_mm"])
    if radius_mm.max() > end_mm * (1 + SAME_DEG):
        raise ConfigError(
            f"the lens states its chief rays up to {end_mm:.4g} mm from the axis, and the corner"
            f" pixel lies at {radius_mm.max():.4g}; expected a longer table of the lens; type fewer"
            " sensor.rows and sensor.columns, or sensor.microlens_cra_deg=[]"
            " sensor.microlens_response=[]"
        )
    at_mm = per_focal_length * light.attrs["focal_length_mm"]
    chief_deg = _curve(at_mm, table["angle_deg"], radius_mm)
    off_deg = chief_deg - _design_deg(lenses, radius_mm)
    return np.where(np.abs(off_deg) < SAME_DEG, 0.0, off_deg)


def _design_deg(lenses: Microlenses, radius_mm: np.ndarray) -> np.ndarray:
    """Return the design angle, degrees, at distances from the axis, mm."""
    heights, angles = zip(*lenses.design_deg)
    if radius_mm.max() > heights[-1] * (1 + SAME_DEG):
        raise ConfigError(
            f"sensor.microlens_cra_deg ends at {heights[-1]:g} mm, and the corner pixel lies at"
            f" {radius_mm.max():.4g} mm from the axis; expected a table that reaches it; type a"
            " further point, or fewer sensor.rows and sensor.columns"
        )
    return _curve(heights, angles, radius_mm)


def _response(lenses: Microlenses, off_deg: np.ndarray) -> np.ndarray:
    """Return the response at deviations from the design angle, degrees, 0 or above."""
    angles, values = zip(*lenses.response)
    if off_deg.max() > angles[-1] * (1 + SAME_DEG):
        raise ConfigError(
            f"sensor.microlens_response ends at {angles[-1]:g} degrees, and a chief ray is"
            f" {off_deg.max():.3g} degrees off the design angle of its pixel; expected a table that"
            " reaches it; type a further point, for example [90,0]"
        )
    return _curve(angles, values, off_deg)


def _curve(at: Sequence[float], values: Sequence[float], where: np.ndarray) -> np.ndarray:
    """Return the monotone cubic curve through points; beyond the last one it is constant."""
    # `at` may be angles or image heights; the function takes either under this name
    table = {"angle_deg": list(at), "relative": list(values)}
    return table_values(table, np.minimum(where, at[-1]))

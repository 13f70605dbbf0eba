"""Beam angle control: area lights of equal flux with beams of decreasing width, on a road.

The paper's renderer narrows an area light to the half angle c: its radiance at the angle a from the
normal is that of the light times n max(0, 1 - cot(c) tan(a)), with n = 1 / (1 - c cot(c)). This
keeps the flux of the Lambertian light: 2 pi times the integral of n (1 - cot(c) tan a) cos a sin a
from 0 to c is pi. isethdr has tables of intensity instead (docs/explanation/lamps.md); its dipped
beam is the last picture.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_scenes.photometry.families import family

from isethdr_core.display.display_view import false_colour

from .rendered_scene import write_sheet

if TYPE_CHECKING:
    from collections.abc import Callable


HALF_ANGLES_DEG = (90.0, 45.0, 22.5, 15.0, 7.5)  # 22.5, 15 and 7.5 are those of the shipped cars
FLUX_LM = 1000.0  # flux of the lamp, as of a headlamp
HEIGHT_M = 0.65  # height of the lamp over the road
DOWN_DEG = 0.57  # tilt of the lamp's axis below the horizontal: 1 %
DIPPED = "dipped_r112_b"
ROAD_X_M = (1.0, 81.0)  # range of the pictures, ahead
ROAD_Y_M = (-20.0, 20.0)  # range of the pictures, to the left
TILE_M = 0.25  # width of a tile of the pictures
LUX = (0.01, 100.0)  # range of the false colours


def paper_fig2(picture: str = "") -> list[dict[str, Any]]:
    """Repeat figure 2 of the ISETHDR paper: light of area lamps on the road, and of a dipped beam.

    Parameters
    ----------
    picture : file for the road in false colours, and the intensity over the angle (png or jpg);
        empty writes none.

    Returns
    -------
    rows with beam, axis_cd (intensity along the axis), flux_lm (integrated over all directions),
    lux_at_25_m (on the road, straight ahead), reach_1_lux_m (largest distance straight ahead with
    1 lx or more on the road).
    """
    x, y = road()
    rows = []
    views = []
    names = []
    for half_angle_deg in HALF_ANGLES_DEG:
        lux = illuminance(lambda a, c=half_angle_deg: beam_cd(a, c), x, y)
        rows.append(
            {
                "beam": f"area light, {half_angle_deg:g} degrees",
                "axis_cd": float(beam_cd(0.0, half_angle_deg)),
                "flux_lm": flux_lm(half_angle_deg),
                **ahead(lux, x),
            }
        )
        views.append(false_colour(lux[::-1], *LUX)[0])
        names.append(f"{half_angle_deg:g} degrees, {rows[-1]['axis_cd']:.3g} cd")
    lux = dipped(x, y)
    lamp = family(DIPPED)
    row = {"beam": DIPPED, "axis_cd": float(lamp.intensity_cd * lamp.table.at(0.0, 0.0))}
    rows.append(row | {"flux_lm": table_flux_lm(lamp), **ahead(lux, x)})
    views.append(false_colour(lux[::-1], *LUX)[0])
    names.append(f"{DIPPED}, isethdr")
    if picture:
        write_sheet(picture, [views[:3], views[3:]], [names[:3], names[3:]], curves)
    return rows


def beam_cd(angle_deg: np.ndarray, half_angle_deg: float) -> np.ndarray:
    """Return the intensity of the area light at angles from its normal, cd.

    Parameters
    ----------
    angle_deg : angle from the normal, degrees.
    half_angle_deg : half angle of the beam, degrees; 90 is Lambertian.
    """
    angle = np.radians(np.asarray(angle_deg, float))
    c = np.radians(half_angle_deg)
    cot = 1 / np.tan(c) if half_angle_deg < 90 else 0.0
    n = 1 / (1 - c * cot)
    inside = np.abs(angle) < min(c, np.pi / 2)
    fall = np.maximum(0.0, 1 - cot * np.tan(np.where(inside, angle, 0.0)))
    return np.where(inside, FLUX_LM / np.pi * n * fall * np.cos(angle), 0.0)


def flux_lm(half_angle_deg: float) -> float:
    """Return the flux of the area light, lm, which is the integral of its intensity over all
    directions.
    """
    edges = np.radians(np.linspace(0, half_angle_deg, 2001))
    angle = (edges[1:] + edges[:-1]) / 2
    values = beam_cd(np.degrees(angle), half_angle_deg)
    return float(np.sum(2 * np.pi * values * np.sin(angle) * np.diff(edges)))


def table_flux_lm(lamp: Any) -> float:
    """Return the flux of a lamp with a table of intensity, lm."""
    left = np.radians(np.arange(-89.5, 90.0, 0.25))
    up = np.radians(np.arange(-89.5, 90.0, 0.25))
    values = lamp.table.at(np.degrees(left), np.degrees(up)[:, None])
    step = np.radians(0.25)
    return float(lamp.intensity_cd * np.sum(values * np.cos(up)[:, None]) * step**2)


def road() -> tuple[np.ndarray, np.ndarray]:
    """Return the positions of the tiles of the road, m: x (x,) ahead, and y (y, 1) to the left."""
    x = np.arange(ROAD_X_M[0], ROAD_X_M[1], TILE_M) + TILE_M / 2
    y = np.arange(ROAD_Y_M[0], ROAD_Y_M[1], TILE_M) + TILE_M / 2
    return x, y[:, None]


def illuminance(intensity_cd: Callable[..., np.ndarray], x: np.ndarray, y: np.ndarray) -> Any:
    """Return the horizontal illuminance (y, x), lx, by a lamp at the origin, at `HEIGHT_M`.

    Parameters
    ----------
    intensity_cd : function of the angle from the axis, degrees.
    x, y : positions on the road, m.
    """
    tilt = np.radians(DOWN_DEG)
    distance = np.sqrt(x**2 + y**2 + HEIGHT_M**2)
    along = (x * np.cos(tilt) + HEIGHT_M * np.sin(tilt)) / distance
    angle = np.degrees(np.arccos(np.clip(along, -1, 1)))
    return intensity_cd(angle) * HEIGHT_M / distance**3


def dipped(x: np.ndarray, y: np.ndarray) -> Any:
    """Return the horizontal illuminance (y, x), lx, by the dipped beam.

    Parameters
    ----------
    x, y : positions on the road, m.
    """
    lamp = family(DIPPED)
    distance = np.sqrt(x**2 + y**2 + HEIGHT_M**2)
    left = np.degrees(np.arctan2(y, x))
    up = -np.degrees(np.arcsin(HEIGHT_M / distance))
    return lamp.intensity_cd * lamp.table.at(left, up) * HEIGHT_M / distance**3


def ahead(lux: np.ndarray, x: np.ndarray) -> dict[str, float]:
    """Return the figures straight ahead on the road: illuminance at 25 m, and reach of 1 lx.

    Parameters
    ----------
    lux : (y, x) horizontal illuminance, lx.
    x : (x,) distance ahead, m.
    """
    line = lux[lux.shape[0] // 2]
    bright = x[line >= 1.0]
    return {
        "lux_at_25_m": float(np.interp(25.0, x, line)),
        "reach_1_lux_m": float(bright.max()) if bright.size else 0.0,
    }


def curves(axes: Any) -> None:
    """Draw intensity against the angle from the axis."""
    angle = np.linspace(0, 60, 601)
    for half_angle_deg in HALF_ANGLES_DEG:
        values = beam_cd(angle, half_angle_deg)
        axes.semilogy(angle, np.where(values > 0, values, np.nan), label=f"{half_angle_deg:g} deg")
    lamp = family(DIPPED)
    values = lamp.intensity_cd * lamp.table.at(angle, -DOWN_DEG)
    axes.semilogy(angle, np.where(values > 0, values, np.nan), "k", label=f"{DIPPED}, to the left")
    axes.set(xlabel="degrees from the axis", ylabel="intensity, cd", xlim=(0, 60), ylim=(10, 1e5))
    axes.grid(True, color="#eee")
    axes.legend(fontsize=8)

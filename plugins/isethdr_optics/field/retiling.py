"""Retiling: detail that is lost when the light of moved tiles is shared among the tiles of the
sensor plane.

Distortion and lateral colour move the image of a tile off the grid of the sensor plane. Its light
is shared by area, and is then uniform over each tile of the grid. A pixel whose border divides a
tile of the grid then gets a wrong part of the light within that tile. The error is at most the
standard deviation within the tile times sqrt(f (1 - f)), where the pixel covers the fraction f of
the tile (`isethdr_core.physics.resampling.area.detail_error`). The deviation follows from the means
of the light and of its square.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..imaging.sensor_plane import SensorPlane
from ..psf.error_parts import term

# parts of the light that the errors act on
DETAIL = "detail within tiles"
BORDER = "light of border tiles"


def detail(plane: SensorPlane, light: np.ndarray) -> np.ndarray:
    """Return the standard deviation within each tile of the sensor plane of moved light.

    Parameters
    ----------
    plane : tiles of the sensor plane.
    light : (..., band, y, x) light on the field's tiles. The result has its unit.
    """
    out = np.empty((*light.shape[:-2], len(plane.y), len(plane.x)), light.dtype)
    even = np.ones(light.shape[-2:])
    for index in np.ndindex(light.shape[:-2]):
        band = index[-1]
        values = light[index].astype(float)
        uniform, mean, square = (plane.move_band(v, band) for v in (even, values, values**2))
        out[index] = np.sqrt(np.maximum(uniform * square - mean**2, 0.0))
    return out


def border(plane: SensorPlane, moved: np.ndarray) -> np.ndarray:
    """Return moved light (..., y, x) with 0 in all tiles except those at the field's border."""
    out = moved.copy()
    edges = [(n - count) // 2 + 1 for n, count in zip(moved.shape[-2:], plane.unmagnified_shape)]
    out[..., edges[0] : -edges[0], edges[1] : -edges[1]] = 0.0
    return out


class Retiled(NamedTuple):
    """Errors of light that was moved to other tiles, and the parts of the light on which they
    act.
    """

    terms: list[ErrorTerm]
    within_tiles: np.ndarray  # (..., y, x): the part `DETAIL`, a standard deviation
    of_border: np.ndarray | None  # (..., y, x): the part `BORDER`; None: nothing is lost there


def losses(plane: SensorPlane, light: np.ndarray, moved: np.ndarray) -> Retiled:
    """Return the errors of moving light to other tiles.

    Parameters
    ----------
    plane : tiles of the sensor plane.
    light : (..., y, x) light on the field's tiles.
    moved : the same light on the sensor plane's tiles.
    """
    label = (
        "detail of the size of a tile, where moved tiles are shared among those of the sensor plane"
    )
    terms = [term(1.0, "relative", "measured", label, key="retiling", part=DETAIL)]
    if not plane.dark_corner_share:
        return Retiled(terms, detail(plane, light), None)
    label = "light that border tiles lack, of the smallest band's image"
    terms.append(
        term(plane.dark_corner_share, "relative", "bound", label, key="border", part=BORDER)
    )
    return Retiled(terms, detail(plane, light), border(plane, moved))

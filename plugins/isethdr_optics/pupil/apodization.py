"""Apodization: light that does not fill the stop evenly, as an amplitude in Zernike terms whose
mean square over the stop is 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.optics.pupil import overlaps, raster, weighted
from isethdr_core.physics.optics.zernike import wavefront_um

from . import pupil_size
from .pupil_map import over_pupil

if TYPE_CHECKING:
    from isethdr_core.physics.optics.pupil import Convex

    from ..abilities import PupilOptics

SAMPLES = 384  # across the stop, from which the share of an opening's light is known to 1e-4


def amplitude(terms: tuple[tuple[int, float], ...], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the amplitude (y, x), float32, of ((OSA index, value), ...) at places in stop radii, y
    down.

    Parameters
    ----------
    terms : ((OSA index, value), ...) of the amplitude over the stop.
    x : places along x, stop radii.
    y : places along y, stop radii, y down.
    """
    return wavefront_um(dict(terms), x, -y).astype(np.float32)


def cell_amplitude(lens: PupilOptics, x_mm: np.ndarray, y_mm: np.ndarray) -> np.ndarray:
    """Return the amplitude (y, x), float32, of a lens's apodization at the centres of cells.

    Parameters
    ----------
    lens : a lens of this package.
    x_mm : centres of the cells along x, mm.
    y_mm : centres of the cells along y, mm, y down.
    """
    terms = tuple(over_pupil(lens, dict(lens.uneven)).items())
    radius_mm = pupil_size.radius_mm(lens)
    return amplitude(terms, x_mm / radius_mm, y_mm / radius_mm)


@lru_cache(maxsize=64)
def share(
    terms: Sequence[tuple[int, float]], opening: Convex, dirt: tuple[Any, ...], radius_mm: float
) -> float:
    """Return the light that uneven light sends through an opening with dirt over that of even
    light; 1 for the whole stop.

    Parameters
    ----------
    terms : ((OSA index, value), ...) of the amplitude over the stop.
    radius_mm : of the stop, mm.
    opening : convex shape. `dirt` : ((shape, loss of amplitude), ...); mm.
    """
    at = (np.arange(SAMPLES) + 0.5) / SAMPLES * 2 - 1
    drawn = weighted(overlaps(opening, tuple(d[0] for d in dirt)), [d[1] for d in dirt])
    even = np.abs(raster(drawn, at * radius_mm, at * radius_mm, 2)) ** 2
    return float((even * amplitude(terms, at, at) ** 2).sum(dtype=float) / even.sum(dtype=float))

"""Tile weights: exact integrals of a band-limited function over tiles, as weighted sums of its
samples.

An intensity has no spatial frequency above 1 / (wavelength x f-number). With samples at a distance
of a third of wavelength x f-number, its spectrum ends at a third of a cycle per sample, and the
next copy of the spectrum begins at two thirds. Between the two, the transfer function of the
weights may have any values. A sinc that falls to 0 within `SUPPORT` samples (a Kaiser window)
passes the spectrum and suppresses the copy to 1e-6. A finite support is also necessary for
accuracy: the light on the axis is a million times brighter, and must not leak into other tiles.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy.fft as sf

STEP = 1 / 3  # distance of samples / (wavelength x f-number)
SUPPORT = 12  # number of samples by which the weights extend beyond a tile and its neighbour
SHAPE = 12.0  # shape parameter of the Kaiser window: 1e-6 outside of the band
# Number of entries per sample in the table, which is interpolated linearly. The error at a
# frequency is up to 4e-5 of a tile's width for tiles narrower than a sample, and 2e-6 from 4.5
# samples on.
TABLE = 128


class TileWeights(NamedTuple):
    """Weights of samples for a row of tiles."""

    first: np.ndarray  # (tile,) first sample of each tile, counted from the axis
    weight: np.ndarray  # (tile, tap) weights of the samples from the first one on


def tile_weights(at: np.ndarray, width: float) -> TileWeights:
    """Return weights of samples of a point spread function, for the light from tile to tile.

    Parameters
    ----------
    at : (tile,) centres of the receiving tiles, in samples from the axis.
    width : width of a tile, samples. Both tiles are boxes, so that the transform of the weights is
        sinc^2 of frequency x width.

    Returns
    -------
    Weights along one axis. The weighted sum of densities over both axes, times the area per sample,
    is the light of a tile.
    """
    at = np.asarray(at, float)
    table, middle = _table(round(float(width), 12))
    half = width + SUPPORT
    first = np.ceil(at - half).astype(np.intp)
    taps = int(2 * half) + 1
    where = (first[:, None] + np.arange(taps) - at[:, None]) * TABLE + middle
    low = np.clip(where.astype(np.intp), 0, len(table) - 2)
    return TileWeights(first, table[low] + (where - low) * (table[low + 1] - table[low]))


@lru_cache(maxsize=64)
def _table(width: float) -> tuple[np.ndarray, int]:
    """Return weights at positions at a distance of 1 / `TABLE` samples, and the index of position
    0.
    """
    reach = int(np.ceil(width)) + SUPPORT + 1
    count = 2 * reach * TABLE
    place = (np.arange(count) - count // 2) / TABLE
    within = np.sqrt(np.clip(1 - (place / SUPPORT) ** 2, 0.0, None))
    window = np.where(np.abs(place) <= SUPPORT, np.i0(SHAPE * within) / np.i0(SHAPE), 0.0)
    spectrum = sf.rfft(sf.ifftshift(np.sinc(place) * window))
    spectrum *= np.sinc(np.arange(count // 2 + 1) / (2 * reach) * width) ** 2 * width
    return sf.fftshift(sf.irfft(spectrum, count)), count // 2

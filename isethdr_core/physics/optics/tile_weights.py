"""Tile weights: exact integrals of a band-limited function over tiles, as weighted sums of its
samples.

An intensity holds no spatial frequency above 1 / (wavelength x f-number). Sampled at a third of
that, all of it lies below a third of a cycle per sample, so weights may do as they like between
there and half a cycle: they fall to 0 smoothly and stay short.
"""

from __future__ import annotations

import numpy as np
import scipy.fft as sf

STEP = 1 / 3  # of wavelength x f-number, between samples
BEYOND = 40  # samples that weights reach past a tile and its neighbour
LENGTH = 512  # samples over which weights are tabulated
TABLE = 64  # places per sample in the table; lines between


def tile_weights(at, samples, width: float) -> np.ndarray:
    """Return weights (place, sample) that take the light from one tile to another from samples of a
    point spread function.

    Parameters
    ----------
    at : centres of the receiving tiles, in samples from the axis.
    samples : numbers of the samples, evenly spaced.
    width : of a tile, in samples. Both tiles are boxes, so the weights' transform is sinc^2 of
        frequency x width.

    Returns
    -------
    Weights of intensity per sample length along this axis; their sums over two axes are multiplied
    by the density.
    """
    f = np.arange(LENGTH // 2 + 1) / LENGTH
    fall = np.clip((0.5 - f) / (0.5 - STEP), 0, 1)
    taper = np.where(f <= STEP, 1.0, np.sin(np.pi / 2 * fall) ** 2)
    spectrum = np.zeros(LENGTH * TABLE // 2 + 1)
    spectrum[: len(f)] = np.sinc(f * width) ** 2 * taper
    table = sf.irfft(spectrum, LENGTH * TABLE) * (TABLE * width)
    where = np.minimum(np.abs(np.subtract.outer(at, samples)) * TABLE, len(table) // 2 - 2)
    low = where.astype(np.intp)
    return table[low] + (where - low) * (table[low + 1] - table[low])

"""Passes of the integrator, summed in float64 outside Mitsuba, with the spread between passes as their noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.progress import track

LARGEST_PASS = 1024   # paths per tile and pass: float32 sums of more lose 1e-4 and worse
LEAST_PASSES = 4      # for an estimate of the spread
PASS_PATHS = 64e6     # paths per pass: each pass is traced anew, which costs two seconds where shapes are many


@dataclass(frozen=True, eq=False)
class Estimate:
    """Mean radiance (group, wavelength, row, column), float64, and how noisy each group is."""

    radiance: np.ndarray
    noise: np.ndarray        # (group,) median relative standard error of luminance; NaN where there is no light


def pass_sizes(samples: int, tiles: int) -> list[int]:
    """Return the paths per tile of each pass; they sum to `samples`."""
    largest = max(1, min(LARGEST_PASS, int(PASS_PATHS / tiles)))
    passes = min(samples, max(LEAST_PASSES, math.ceil(samples / largest)))
    return [samples // passes + (i < samples % passes) for i in range(passes)]


def estimate(one_pass, sizes, seed: int, groups, wavelength_nm, shape) -> Estimate:
    """Return the mean over passes of different seeds.

    Parameters
    ----------
    one_pass : function(seed, samples) -> iterable of (group index, band index, (rows * columns) radiance).
    sizes : paths per tile of each pass.
    seed : of the whole render; passes derive theirs from it.
    groups, wavelength_nm, shape : what the passes give.
    """
    tiles = shape[0] * shape[1]
    total = np.zeros((len(groups), len(wavelength_nm), tiles))
    squares = np.zeros((len(groups), tiles))
    weights = xyz_weights(wavelength_nm)[1]
    seeds = np.random.SeedSequence(seed).generate_state(len(sizes), np.uint32)
    for one_seed, samples in track(list(zip(seeds, sizes, strict=True)), "passes of paths"):
        luminance = np.zeros((len(groups), tiles))
        for g, band, values in one_pass(int(one_seed), samples):
            values = np.asarray(values, float)
            total[g, band] += values * samples
            luminance[g] += weights[band] * values
        squares += samples * luminance**2
    total /= sum(sizes)
    return Estimate(total.reshape(len(groups), len(wavelength_nm), *shape), _noise(total, squares / sum(sizes), weights, len(sizes)))


def _noise(mean, squares, weights, passes):
    """Return per group the luminance-weighted median relative standard error, over tiles above 1 % of the group's mean."""
    out = np.full(len(mean), np.nan)
    if passes < 2:
        return out
    for g in range(len(mean)):
        level = weights @ mean[g]
        used = level > 0.01 * level.mean()
        if used.any():
            error = np.sqrt(np.maximum(squares[g] - level**2, 0)[used] / (passes - 1)) / level[used]
            out[g] = weighted_median(error, level[used])
    return out


def weighted_median(values, weights) -> float:
    """Return the value below which half of the weight lies."""
    order = np.argsort(values)
    below = np.cumsum(np.asarray(weights, float)[order])
    return float(np.asarray(values)[order][np.searchsorted(below, below[-1] / 2)])

"""Passes of the integrator, summed in float64 outside Mitsuba, with the spread between passes as their noise.

Either as many paths as are asked for; or on and on, each light group until its own noise is low enough.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.progress import track

LARGEST_PASS = 1024   # paths per tile and pass: float32 sums of more lose 1e-4 and worse
LEAST_PASSES = 4      # for an estimate of the spread
PASS_PATHS = 64e6     # paths per pass: each pass is traced anew, which costs two seconds where shapes are many


@dataclass(frozen=True, eq=False)
class Estimate:
    """Mean radiance (group, wavelength, row, column), float64, how noisy each group is, and what it took."""

    radiance: np.ndarray
    noise: np.ndarray        # (group,) median relative standard error of luminance; NaN where there is no light
    xyz_noise: np.ndarray    # (group, 3, row, column) standard errors of X, Y and Z, cd/m2; NaN after one pass alone
    samples: np.ndarray      # (group,) paths per tile
    seconds: np.ndarray      # (group,) of the passes that the group was part of


def pass_sizes(samples: int, tiles: int) -> list[int]:
    """Return the paths per tile of each pass; they sum to `samples`."""
    passes = min(samples, max(LEAST_PASSES, math.ceil(samples / largest_pass(tiles))))
    return [samples // passes + (i < samples % passes) for i in range(passes)]


def largest_pass(tiles: int) -> int:
    """Return the most paths per tile that one pass may have."""
    return max(1, min(LARGEST_PASS, int(PASS_PATHS / tiles)))


def estimate(one_pass, settings, groups, wavelength_nm, shape) -> Estimate:
    """Return the mean over passes of different seeds.

    Parameters
    ----------
    one_pass : function(seed, samples, wanted group indices) -> iterable of (group index, band index, (rows * columns) radiance);
        what it gives for one group and band is summed.
    settings : MitsubaRenderer: samples, error_allowed, most_samples and seed.
    groups, wavelength_nm, shape : what the passes give.
    """
    sums = _Sums(len(groups), wavelength_nm, shape)
    sizes = pass_sizes(settings.samples, sums.tiles)
    seeds = np.random.SeedSequence(settings.seed)
    wanted = list(range(len(groups)))
    for seed, samples in track(list(zip(seeds.generate_state(len(sizes), np.uint32), sizes, strict=True)), "passes of paths"):
        sums.add(one_pass, int(seed), samples, wanted)
    if settings.error_allowed is not None:
        _refine(one_pass, settings, sums, wanted, seeds.spawn(1)[0])
    return Estimate(sums.mean().reshape(len(groups), -1, *shape), sums.noise(), sums.xyz_noise(shape), sums.paths, sums.seconds)


def _refine(one_pass, settings, sums, wanted, seeds):
    """Add passes until each group's noise is allowed; a group that is there is rendered no further."""
    while True:
        noise = sums.noise()
        wanted = [g for g in wanted if noise[g] > settings.error_allowed and sums.paths[g] < settings.most_samples]
        if not wanted:
            return
        done = sums.paths[wanted[0]]
        # noise falls with the root of the paths; never more than double on the word of one estimate
        needed = done * min((noise[g] / settings.error_allowed) ** 2 for g in wanted)
        more = int(min(math.ceil(max(needed * 1.05, done + 1)), 2 * done, settings.most_samples) - done)
        largest = largest_pass(sums.tiles)
        sizes = [more // n + (i < more % n) for n in [math.ceil(more / largest)] for i in range(n)]
        for samples in track(sizes, f"more paths for {len(wanted)} light groups"):
            sums.add(one_pass, int(seeds.spawn(1)[0].generate_state(1)[0]), samples, wanted)


class _Sums:
    """What the passes so far add up to."""

    def __init__(self, groups, wavelength_nm, shape):
        self.tiles = shape[0] * shape[1]
        self.weights = xyz_weights(wavelength_nm)
        self.total = np.zeros((groups, len(wavelength_nm), self.tiles))     # of radiance x paths
        self.squares = np.zeros((groups, 3, self.tiles))                    # of X, Y, Z, each squared x paths
        self.paths, self.passes, self.seconds = np.zeros(groups, int), np.zeros(groups, int), np.zeros(groups)

    def add(self, one_pass, seed, samples, wanted):
        start = time.perf_counter()
        xyz = np.zeros(self.squares.shape)
        for g, band, values in one_pass(seed, samples, wanted):
            values = np.asarray(values, float)
            self.total[g, band] += values * samples
            xyz[g] += self.weights[:, band, None] * values
        self.squares += samples * xyz**2
        self.paths[wanted] += samples
        self.passes[wanted] += 1
        self.seconds[wanted] += time.perf_counter() - start

    def mean(self):
        return self.total / self.paths[:, None, None]

    def noise(self):
        """Return per group the luminance-weighted median relative standard error, over tiles above 1 % of the group's mean."""
        out = np.full(len(self.total), np.nan)
        for g in range(len(out)):
            level, free = self.weights[1] @ self.total[g] / self.paths[g], self.passes[g] - 1
            used = level > 0.01 * level.mean()
            if used.any() and free:
                # passes of n paths have variance v / n: the sum of n (x - mean)^2 is v times chi squared with `free` degrees
                error = np.sqrt(np.maximum(self.squares[g, 1] / self.paths[g] - level**2, 0)[used] / free) / level[used]
                # its median is below its mean (Wilson and Hilferty 1931)
                out[g] = weighted_median(error, level[used]) / (1 - 2 / (9 * free)) ** 1.5
        return out

    def xyz_noise(self, shape):
        """Return the standard errors of X, Y, Z (group, 3, row, column), cd/m2: relative, of each tile with its eight neighbours.

        A few passes know one tile's noise to a third of itself, that of nine tiles to a tenth. One number for all colours would
        not do: a red lamp may be all of the noise of red pixels beside little of the luminance.
        """
        out = np.full((len(self.total), 3, *shape), np.nan)
        for g in range(len(out)):
            level, free = self.weights @ self.total[g] / self.paths[g], self.passes[g] - 1
            if free:
                variance = np.maximum(self.squares[g] / self.paths[g] - level**2, 0) / free
                near, light = (_with_neighbours(v.reshape(3, *shape)) for v in (variance, level**2))
                out[g] = np.sqrt(near / np.where(light > 0, light, 1)) * level.reshape(3, *shape)
        return out


def _with_neighbours(values):
    """Return the sum (..., row, column) of each tile and its eight neighbours; not a running sum, which a lamp would leave its rounding in."""
    rows, columns = values.shape[-2:]
    wide = np.pad(values, [(0, 0)] * (values.ndim - 2) + [(1, 1)] * 2, mode="edge")
    return sum(wide[..., i : i + rows, j : j + columns] for i in range(3) for j in range(3))


def weighted_median(values, weights) -> float:
    """Return the value below which half of the weight lies."""
    order = np.argsort(values)
    below = np.cumsum(np.asarray(weights, float)[order])
    return float(np.asarray(values)[order][np.searchsorted(below, below[-1] / 2)])

"""Passes of the integrator: their sum in float64, and its noise from the spread between passes.

The renderer follows a given number of paths, or adds passes until the noise of each light group is
low enough.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.cli.progress import track
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.runs.sample_accumulation import Known, pooled_noise

if TYPE_CHECKING:
    from ..renderer import MitsubaRenderer

# largest number of paths per tile and pass; float32 sums of more paths lose 1e-4 or more
LARGEST_PASS = 1024
LEAST_PASSES = 4  # smallest number of passes from which the spread can be estimated
PASS_PATHS = 64e6  # largest number of paths per pass; a pass costs 0.1 s of set-up
SPLITS = 3  # number of ways to split the passes into halves; four equal passes have three
ONE_SIDED = 0.9  # largest difference between the halves, as a share of all paths
ROUNDING = 1e-6  # relative difference between halves up to which it counts as rounding, not noise
# half of a normal distribution lies within this many standard deviations
NORMAL = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class Estimate:
    """Mean radiance (group, wavelength, row, column), float64, with its noise, number of paths and
    run time.
    """

    radiance: np.ndarray
    # (group,) relative noise of luminance, as `_Sums.noise`; NaN where there is no light
    noise: np.ndarray
    # (group, 3, row, column) standard errors of X, Y and Z, cd/m2; NaN after one pass alone
    xyz_noise: np.ndarray
    # (group, row, column) half of the luminance difference between two halves of the paths, cd/m2;
    # NaN after one pass alone
    half_difference: np.ndarray
    samples: np.ndarray  # (group,) new paths per tile
    seconds: np.ndarray  # (group,) run time of the passes that the group was part of
    first: np.ndarray  # (group,) number of the first new path; earlier ones were known
    known: list[Known]  # (group,) light of earlier renderings
    whole_noise: np.ndarray  # (group,) relative noise of the mean over new and known paths


def pass_sizes(samples: int, tiles: int) -> list[int]:
    """Return the paths per tile of each pass; they sum to `samples`."""
    passes = min(samples, max(LEAST_PASSES, math.ceil(samples / largest_pass(tiles))))
    return [samples // passes + (i < samples % passes) for i in range(passes)]


def largest_pass(tiles: int) -> int:
    """Return the largest number of paths per tile in one pass."""
    return max(1, min(LARGEST_PASS, int(PASS_PATHS / tiles)))


def next_rung(paths: int) -> int:
    """Return the next number of paths at which the noise of a light group is tested: 1, 2, 3, 4, 6,
    8, 12, 16, 24, ... 64, 80, 96, 112, 128, 160, ...

    All groups use the same numbers. Groups that need more paths therefore share their passes, and
    the paths of one group do not depend on the noise of the others.
    """
    octave = 1 << (paths.bit_length() - 1)
    step = max(octave // (4 if octave >= 64 else 2), 1)
    return paths - (paths - octave) % step + step


@dataclass(frozen=True)
class Frame:
    """Light groups, bands and tiles that passes compute."""

    groups: Sequence[str]  # light groups
    wavelength_nm: np.ndarray  # (band,) centres
    shape: tuple[int, int]  # (rows, columns) of tiles
    # (rows, columns) of the complete frame, if `shape` is a part of it; the size of a pass depends
    # on the complete frame
    whole: tuple[int, int] | None = None
    # (rows, columns) of the tiles from which the noise of a group is computed; None: all. Tiles
    # beyond the camera's field are left out, because the number of paths must not depend on whether
    # they are rendered.
    judged: tuple[slice, slice] | None = None


def estimate(
    one_pass: Callable[..., Any],
    settings: MitsubaRenderer,
    frame: Frame,
    known: Known | None = None,
) -> Estimate:
    """Return the mean over passes of different seeds.

    Parameters
    ----------
    one_pass : function(seed, samples, wanted group indices) -> iterable of (group index, band
        index, (rows * columns) radiance). Values of the same group and band are added.
    settings : `MitsubaRenderer`: samples, error_allowed, most_samples and seed.
    frame : light groups, bands and tiles of the passes.
    known : {group: Known}, results of earlier renderings. Only the missing paths are followed; no
        path is repeated.
    """
    groups = frame.groups
    known = [(known or {}).get(g, Known()) for g in groups]
    judged = frame.judged or (slice(None),) * 2
    sums = _Sums(known, frame.wavelength_nm, frame.shape, settings.seed, judged)
    tiles = math.prod(frame.whole or frame.shape)
    for same_paths in sums.alike(range(len(groups))):
        stored = known[same_paths[0]].paths
        lacking = max(settings.samples - stored, 0)
        # follow enough passes to measure the noise if it matters
        fewest = LEAST_PASSES if lacking and (stored or settings.error_allowed is not None) else 0
        sums.add_all(
            one_pass, pass_sizes(max(lacking, fewest), tiles), same_paths, "passes of paths"
        )
    if settings.error_allowed is not None:
        _refine(one_pass, settings, sums, tiles)
    return Estimate(
        sums.mean().reshape(len(groups), -1, *frame.shape),
        sums.noise(),
        sums.xyz_noise(),
        sums.half_difference(),
        sums.paths,
        sums.seconds,
        np.array([k.next for k in known]),
        known,
        sums.whole_noise(),
    )


def _refine(
    one_pass: Callable[..., Any],
    settings: MitsubaRenderer | SimpleNamespace,
    sums: _Sums,
    tiles: int,
) -> None:
    """Add passes until the noise of each group is at most `error_allowed`, or the group has
    `most_samples` paths. A group that has reached either gets no more passes.
    """
    while True:
        noise = sums.whole_noise()
        paths = sums.whole_paths()
        unfinished = [
            g
            for g in range(len(noise))
            if noise[g] > settings.error_allowed and paths[g] < settings.most_samples
        ]
        if not unfinished:
            return
        for some in sums.alike(unfinished):
            done = int(paths[some[0]])
            fewest = 1 if sums.passes[some].all() else LEAST_PASSES
            more = max(min(next_rung(done), settings.most_samples) - done, fewest)
            count = max(math.ceil(more / largest_pass(tiles)), fewest)
            sizes = [more // count + (i < more % count) for i in range(count)]
            sums.add_all(
                one_pass,
                sizes,
                some,
                f"paths {done} to {done + more}: noise {noise[some].max():.2g},"
                f" {settings.error_allowed:g} allowed",
            )


class _Sums:
    """Sums over the passes so far."""

    def __init__(
        self,
        known: Sequence[Known],
        wavelength_nm: np.ndarray,
        shape: tuple[int, int],
        seed: int,
        judged: Any,
    ) -> None:
        self.known = known
        self.seed = seed
        self.shape = shape
        self.judged = judged
        groups = len(known)
        self.tiles = shape[0] * shape[1]
        self.weights = xyz_weights(wavelength_nm)
        self.total = np.zeros((groups, len(wavelength_nm), self.tiles))  # sum of radiance x paths
        self.squares = np.zeros((groups, 3, self.tiles))  # sums of X^2, Y^2, Z^2, each x paths
        # differences between the two halves of each split: of the sums of Y x paths, and of the
        # numbers of paths
        self.apart = np.zeros((groups, SPLITS, self.tiles))
        self.more = np.zeros((groups, SPLITS))
        self.paths = np.zeros(groups, int)
        self.passes = np.zeros(groups, int)
        self.seconds = np.zeros(groups)

    def alike(self, groups: range) -> list[list[int]]:
        """Return the numbers in `groups` as lists. The groups of one list have the same number of
        paths and the same next path, so that one pass serves them all.
        """
        lots: dict[tuple, list[int]] = {}
        for g in groups:
            lots.setdefault((self._next(g), int(self.whole_paths()[g])), []).append(g)
        return list(lots.values())

    def _next(self, g: int) -> int:
        return self.known[g].next + int(self.paths[g])

    def add_all(
        self, one_pass: Callable[..., Any], sizes: Sequence[int], groups: Sequence[int], title: str
    ) -> None:
        for samples in track(sizes, title) if sizes else ():
            self.add(one_pass, samples, groups)

    def add(self, one_pass: Callable[..., Any], samples: int, groups: Sequence[int]) -> None:
        # the number of the first path seeds a pass, so that equal paths get equal random numbers
        seed = int(
            np.random.SeedSequence(self.seed, spawn_key=(self._next(groups[0]),)).generate_state(1)[
                0
            ]
        )
        start = time.perf_counter()
        xyz = np.zeros(self.squares.shape)
        for g, band, values in one_pass(seed, samples, groups):
            values = np.asarray(values, float)
            self.total[g, band] += values * samples
            xyz[g] += self.weights[:, band, None] * values
        self.squares += samples * xyz**2
        for g in groups:
            # first split: each pass goes to the half that has fewer paths
            fewer = -1 if self.more[g, 0] > 0 else 1
            # two more splits: with four equal passes, passes 1 and 2 against 3 and 4, and passes 1
            # and 4 against 2 and 3
            pair = -1 if self.passes[g] & 2 else 1
            to_half = samples * np.array([fewer, pair, fewer * pair])
            self.apart[g] += to_half[:, None] * xyz[g, 1]
            self.more[g] += to_half
        self.paths[groups] += samples
        self.passes[groups] += 1
        self.seconds[groups] += time.perf_counter() - start

    def whole_paths(self) -> np.ndarray:
        return self.paths + [k.paths for k in self.known]

    def whole_noise(self) -> np.ndarray:
        """Return, per group, the noise of the mean over new and known paths; NaN for a group
        without light.
        """
        return with_known(self.noise(), self.paths, self.known)

    def mean(self) -> np.ndarray:
        return self.total / np.maximum(self.paths, 1)[:, None, None]

    def noise(self) -> np.ndarray:
        """Return the relative noise (group,): a robust standard error, weighted by luminance.

        It is the median error, weighted by luminance, divided by 0.6745. For normal noise this is
        the standard error. Only the judged tiles above 1 % of the group's mean count.

        There are two estimates. The difference between two halves of the paths is too small for
        light that few paths find, because both halves may have missed it. The standard errors of
        a tile and its neighbours are too large, because rare bright paths are shared among them.
        The result is the root mean square of both estimates, or the first one if it is larger. The
        spread of the passes of one tile would be smaller than both, because the few passes of most
        tiles have found none of the rare light. Tiles that show the sky have no noise. They are
        left out if other tiles remain.
        """
        out = np.full(len(self.total), np.nan)
        for g in range(len(out)):
            if self.passes[g] > 1:
                level = self._judged(self._level(g))
                spread = self._standard_errors(g, self.judged)[1].ravel()
                used = level > 0.01 * level.mean()
                halves = self._half_differences(g)
                estimates = [self._judged(half)[used] for half in halves if np.isfinite(half[0])]
                if used.any():
                    out[g] = group_noise(level[used], np.array(estimates), spread[used])
        return out

    def _level(self, g: int) -> np.ndarray:
        """Return the luminance (tile,) of group `g`."""
        return self.weights[1] @ self.total[g] / max(self.paths[g], 1)

    def _judged(self, values: np.ndarray) -> np.ndarray:
        return values.reshape(self.shape)[self.judged].ravel()

    def xyz_noise(self) -> np.ndarray:
        """Return the standard errors of X, Y, Z (group, 3, row, column), cd/m2."""
        out = np.full((len(self.total), 3, *self.shape), np.nan)
        for g in range(len(out)):
            if self.passes[g] > 1:
                out[g] = self._standard_errors(g, (slice(None),) * 2)
        return out

    def _standard_errors(self, g: int, of: Any) -> np.ndarray:
        """Return the standard errors of X, Y, Z (3, row, column) of the tiles `of` (rows, columns).
        They follow from the spread of each tile and its neighbours.

        A rare bright path makes a tile bright and its spread wide at once. A tile that such paths
        missed is dark, and its own spread is too small. The ratio of variance to light is therefore
        averaged over 5 x 5 tiles, and multiplied by the mean of the light of the tile and the light
        of the 3 x 3 tiles around it. A tile without light has no noise, for example a tile of sky
        in a group of lamps. X, Y and Z are treated separately: a red lamp may make all the noise of
        red pixels and little of the luminance.
        """
        level = (self.weights @ self.total[g]).reshape(3, *self.shape)[:, *of] / self.paths[g]
        variance = np.maximum(
            self.squares[g].reshape(3, *self.shape)[:, *of] / self.paths[g] - level**2, 0
        )
        per_light = _around(variance / (self.passes[g] - 1), 2) / np.maximum(
            _around(level, 2), np.finfo(float).tiny
        )
        return np.where(level > 0, np.sqrt(per_light * (level + _around(level, 1)) / 2), 0.0)

    def half_difference(self) -> np.ndarray:
        """Return half of the luminance difference (group, row, column) between two halves of the
        paths, cd/m2.

        The result has the variance of the mean. The mean plus or minus the result is a measured
        luminance, so it is never negative. If the halves differ in size by a share d of all paths,
        d times the mean is subtracted and the rest is divided by sqrt(1 - d^2), which keeps the
        variance.
        """
        out = np.full((len(self.total), *self.shape), np.nan)
        for g in range(len(out)):
            if self.passes[g] > 1:
                out[g] = self._half_differences(g)[0].reshape(self.shape)
        return out

    def _half_differences(self, g: int) -> np.ndarray:
        """Return half of the luminance difference (split, tile) for each split of group `g`, cd/m2.
        A split is NaN if one half has nearly all paths; the first split is never NaN.
        """
        share = (self.more[g] / self.paths[g])[:, None]
        remaining = 1 - share**2
        remaining[1:][np.abs(share[1:]) > ONE_SIDED] = np.nan
        return (self.apart[g] / self.paths[g] - share * self._level(g)) / np.sqrt(remaining)


def group_noise(level: np.ndarray, halves: np.ndarray, spread: np.ndarray) -> float:
    """Return the noise of a group, as `_Sums.noise` defines it.

    Parameters
    ----------
    level : (tile,) luminance, cd/m2.
    halves : (split, tile) half of the luminance difference between two halves of the paths, cd/m2.
    spread : (tile,) standard errors of luminance, cd/m2.
    """
    differences = np.abs(halves) / level
    lit = differences.max(axis=0, initial=0.0) > ROUNDING
    if not lit.any():
        return 0.0
    weight = level[lit]
    of_halves = (
        weighted_median(differences[:, lit].ravel(), np.tile(weight, len(differences))) / NORMAL
    )
    of_tiles = weighted_median(spread[lit] / weight, weight)
    return max(of_halves, math.hypot(of_halves, of_tiles) / math.sqrt(2))


def with_known(noise: np.ndarray, paths: np.ndarray, known: Sequence[Known]) -> np.ndarray:
    """Return the relative noise (group,) of the mean over new and known paths; NaN for a group
    without light.

    Parameters
    ----------
    noise, paths : (group,) relative noise and number of the new paths.
    known : (group,) results of earlier renderings.
    """
    out = np.array(noise, float)
    for g, k in enumerate(known):
        if k.paths:
            own = None if np.isnan(out[g]) else float(out[g])
            both = pooled_noise([k.paths, paths[g]], [k.noise, own]) if paths[g] else k.noise
            out[g] = np.nan if both is None else both
    return out


def _around(values: np.ndarray, reach: int) -> np.ndarray:
    """Return the mean (..., row, column) of the tiles within `reach` rows and columns of each.

    No running sum is used, because the rounding error of a bright lamp would remain in it.
    """
    rows, columns = values.shape[-2:]
    wide = np.pad(values, [(0, 0)] * (values.ndim - 2) + [(reach, reach)] * 2, mode="edge")
    side = 2 * reach + 1
    down = sum(wide[..., i : i + rows, :] for i in range(side))
    return sum(down[..., j : j + columns] for j in range(side)) / side**2


def weighted_median(values: np.ndarray, weights: np.ndarray) -> float:
    """Return the weighted median: half of the weight lies below it."""
    order = np.argsort(values)
    below = np.cumsum(np.asarray(weights, float)[order])
    return float(np.asarray(values)[order][np.searchsorted(below, below[-1] / 2)])

"""Passes of the integrator, summed in float64 outside Mitsuba, with the spread between passes as
their noise.

Either as many paths as are asked for; or on and on, each light group until its own noise is low
enough.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np

from isethdr_core.cli.progress import track
from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.runs.sample_accumulation import Known, pooled_noise

LARGEST_PASS = 1024  # paths per tile and pass: float32 sums of more lose 1e-4 and worse
LEAST_PASSES = 4  # for an estimate of the spread
PASS_PATHS = 64e6  # paths per pass: each is written down anew, which costs a tenth of a second
SPLITS = 3  # of the passes into halves: as many as four equal passes have
ONE_SIDED = 0.9  # by what share of all paths one half may have more
ROUNDING = 1e-6  # relative: what differs by less between halves has no noise
NORMAL = 0.6744897501960817  # half of normal noise is within so many standard deviations


@dataclass(frozen=True, eq=False)
class Estimate:
    """Mean radiance (group, wavelength, row, column), float64, of the paths that were followed, how
    noisy it is, and what it took.
    """

    radiance: np.ndarray
    noise: (
        np.ndarray
    )  # (group,) relative noise of luminance, as `_Sums.noise`; NaN where there is no light
    xyz_noise: (
        np.ndarray
    )  # (group, 3, row, column) standard errors of X, Y and Z, cd/m2; NaN after one pass alone
    # (group, row, column) of the luminance that either half of the paths found, cd/m2; NaN after
    # one pass alone
    half_difference: np.ndarray
    samples: np.ndarray  # (group,) paths per tile
    seconds: np.ndarray  # (group,) of the passes that the group was part of
    first: np.ndarray  # (group,) number of the first path: those before it were known
    known: list[Known]  # (group,) what was known before
    whole_noise: (
        np.ndarray
    )  # (group,) noise of the mean of these paths and of those that were known before


def pass_sizes(samples: int, tiles: int) -> list[int]:
    """Return the paths per tile of each pass; they sum to `samples`."""
    passes = min(samples, max(LEAST_PASSES, math.ceil(samples / largest_pass(tiles))))
    return [samples // passes + (i < samples % passes) for i in range(passes)]


def largest_pass(tiles: int) -> int:
    """Return the most paths per tile that one pass may have."""
    return max(1, min(LARGEST_PASS, int(PASS_PATHS / tiles)))


def next_rung(paths: int) -> int:
    """Return at how many paths a light group's noise is looked at next: 1, 2, 3, 4, 6, 8, 12, 16,
    24, ... 64, 80, 96, 112, 128, 160, ...

    One ladder for all groups: those that go on share their passes, and none has other paths because
    of the others' noise.
    """
    octave = 1 << (paths.bit_length() - 1)
    step = max(octave // (4 if octave >= 64 else 2), 1)
    return paths - (paths - octave) % step + step


def estimate(
    one_pass, settings, groups, wavelength_nm, shape, whole=None, known=None, judged=None
) -> Estimate:
    """Return the mean over passes of different seeds.

    Parameters
    ----------
    one_pass : function(seed, samples, wanted group indices) -> iterable of (group index, band
        index, (rows * columns) radiance); what it gives for one group and band is summed.
    settings : MitsubaRenderer: samples, error_allowed, most_samples and seed.
    groups, wavelength_nm, shape : what the passes give. `whole` : the shape that sizes the passes,
        where tiles were left out of it.
    known : {group: Known}, what earlier renderings found: only the paths that it lacks are
        followed, and none of its own again.
    judged : (rows, columns) slices, the tiles whose noise decides; all where None. Those beyond the
        camera's field should not: with them or without, it is the same number of paths.
    """
    known = [(known or {}).get(g, Known()) for g in groups]
    sums, tiles = (
        _Sums(known, wavelength_nm, shape, settings.seed, judged or (slice(None),) * 2),
        math.prod(whole or shape),
    )
    for wanted in sums.alike(range(len(groups))):
        stored = known[wanted[0]].paths
        lacking = max(settings.samples - stored, 0)
        # passes that stand beside others, or are asked for their noise, are enough to know it
        fewest = LEAST_PASSES if lacking and (stored or settings.error_allowed is not None) else 0
        sums.add_all(one_pass, pass_sizes(max(lacking, fewest), tiles), wanted, "passes of paths")
    if settings.error_allowed is not None:
        _refine(one_pass, settings, sums, tiles)
    return Estimate(
        sums.mean().reshape(len(groups), -1, *shape),
        sums.noise(),
        sums.xyz_noise(),
        sums.half_difference(),
        sums.paths,
        sums.seconds,
        np.array([k.next for k in known]),
        known,
        sums.whole_noise(),
    )


def _refine(one_pass, settings, sums, tiles):
    """Add passes until each group's noise is allowed; a group that is there is rendered no
    further.
    """
    while True:
        noise, paths = sums.whole_noise(), sums.whole_paths()
        wanted = [
            g
            for g in range(len(noise))
            if noise[g] > settings.error_allowed and paths[g] < settings.most_samples
        ]
        if not wanted:
            return
        for some in sums.alike(wanted):
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
    """What the passes so far add up to."""

    def __init__(self, known, wavelength_nm, shape, seed, judged):
        self.known, self.seed, self.shape, self.judged = known, seed, shape, judged
        groups, self.tiles = len(known), shape[0] * shape[1]
        self.weights = xyz_weights(wavelength_nm)
        self.total = np.zeros((groups, len(wavelength_nm), self.tiles))  # of radiance x paths
        self.squares = np.zeros((groups, 3, self.tiles))  # of X, Y, Z, each squared x paths
        # of one half, less the other: Y x paths, and paths
        self.apart, self.more = np.zeros((groups, SPLITS, self.tiles)), np.zeros((groups, SPLITS))
        self.paths, self.passes, self.seconds = (
            np.zeros(groups, int),
            np.zeros(groups, int),
            np.zeros(groups),
        )

    def alike(self, wanted) -> list[list[int]]:
        """Return `wanted` groups in lots that are at the same path and have as many: they can go on
        in one pass.
        """
        lots: dict[tuple, list[int]] = {}
        for g in wanted:
            lots.setdefault((self._next(g), int(self.whole_paths()[g])), []).append(g)
        return list(lots.values())

    def _next(self, g) -> int:
        return self.known[g].next + int(self.paths[g])

    def add_all(self, one_pass, sizes, wanted, title):
        for samples in track(sizes, title) if sizes else ():
            self.add(one_pass, samples, wanted)

    def add(self, one_pass, samples, wanted):
        # a pass is named by its first path: other paths, other random numbers, whoever follows them
        seed = int(
            np.random.SeedSequence(self.seed, spawn_key=(self._next(wanted[0]),)).generate_state(1)[
                0
            ]
        )
        start = time.perf_counter()
        xyz = np.zeros(self.squares.shape)
        for g, band, values in one_pass(seed, samples, wanted):
            values = np.asarray(values, float)
            self.total[g, band] += values * samples
            xyz[g] += self.weights[:, band, None] * values
        self.squares += samples * xyz**2
        for g in wanted:
            fewer = (
                -1 if self.more[g, 0] > 0 else 1
            )  # each pass goes to the half that has fewer paths
            pair = (
                -1 if self.passes[g] & 2 else 1
            )  # two splits more, of four equal passes 1 + 2 and 1 + 4 against the others
            to_half = samples * np.array([fewer, pair, fewer * pair])
            self.apart[g] += to_half[:, None] * xyz[g, 1]
            self.more[g] += to_half
        self.paths[wanted] += samples
        self.passes[wanted] += 1
        self.seconds[wanted] += time.perf_counter() - start

    def whole_paths(self):
        return self.paths + [k.paths for k in self.known]

    def whole_noise(self):
        """Return the noise per group of the mean of these paths and those known before; NaN where
        there is no light.
        """
        return with_known(self.noise(), self.paths, self.known)

    def mean(self):
        return self.total / np.maximum(self.paths, 1)[:, None, None]

    def noise(self):
        """Return per group what the error of half of its light is below, over 0.6745: the standard
        error where noise is normal.

        Relative, weighted by luminance, over tiles above 1 % of the group's mean, of the tiles
        judged. Halves of the paths say too little of light that few paths meet, which both may have
        missed alike, and the standard errors of tiles and their neighbours too much, as rare bright
        paths are shared out: it is the root mean square of both, or halves alone where they say
        more. The spread of each tile's own passes would say less than either: most tiles' few
        passes have met none of it. Tiles that look into the sky have no noise, and say nothing of
        those that it lights: they are left out, where there are others.
        """
        out = np.full(len(self.total), np.nan)
        for g in range(len(out)):
            if self.passes[g] > 1:
                level, spread = (
                    self._judged(self._level(g)),
                    self._standard_errors(g, self.judged)[1].ravel(),
                )
                used = level > 0.01 * level.mean()
                halves = self._half_differences(g)
                known = [self._judged(half)[used] for half in halves if np.isfinite(half[0])]
                if used.any():
                    out[g] = group_noise(level[used], np.array(known), spread[used])
        return out

    def _level(self, g):
        """Return the luminance of the tiles."""
        return self.weights[1] @ self.total[g] / max(self.paths[g], 1)

    def _judged(self, values):
        return values.reshape(self.shape)[self.judged].ravel()

    def xyz_noise(self):
        """Return the standard errors of X, Y, Z (group, 3, row, column), cd/m2."""
        out = np.full((len(self.total), 3, *self.shape), np.nan)
        for g in range(len(out)):
            if self.passes[g] > 1:
                out[g] = self._standard_errors(g, (slice(None),) * 2)
        return out

    def _standard_errors(self, g, of):
        """Return the standard errors of X, Y, Z (3, row, column) of the tiles `of` (rows, columns):
        the spread of a tile and its neighbours, shared out by light.

        Light that few paths meet makes a tile bright and its spread wide at once: a tile that met
        none of it is dark, and its own spread says nothing. So the variance per light is that of 5
        x 5 tiles, and the light that of the tile and of 3 x 3 around it, half and half; but for
        tiles without any light, as of lamps the sky, which have no noise. One number for all
        colours would not do: a red lamp may be all of the noise of red pixels beside little of the
        luminance.
        """
        level = (self.weights @ self.total[g]).reshape(3, *self.shape)[:, *of] / self.paths[g]
        variance = np.maximum(
            self.squares[g].reshape(3, *self.shape)[:, *of] / self.paths[g] - level**2, 0
        )
        per_light = _around(variance / (self.passes[g] - 1), 2) / np.maximum(
            _around(level, 2), np.finfo(float).tiny
        )
        return np.where(level > 0, np.sqrt(per_light * (level + _around(level, 1)) / 2), 0.0)

    def half_difference(self):
        """Return half of what two halves of the paths differ by in luminance (group, row, column),
        cd/m2.

        It has the variance of the mean itself, and the mean plus or minus it is light that was
        found, never negative. Where the halves are not of one size, by a share d of all paths, the
        mean times d is taken off and the rest divided by sqrt(1 - d^2), which keeps the variance.
        """
        out = np.full((len(self.total), *self.shape), np.nan)
        for g in range(len(out)):
            if self.passes[g] > 1:
                out[g] = self._half_differences(g)[0].reshape(self.shape)
        return out

    def _half_differences(self, g):
        """Return half the difference (split, tile) of each split of group `g`; NaN where a half has
        nearly all of the paths, never the first.
        """
        share = (self.more[g] / self.paths[g])[:, None]
        rest = 1 - share**2
        rest[1:][np.abs(share[1:]) > ONE_SIDED] = np.nan
        return (self.apart[g] / self.paths[g] - share * self._level(g)) / np.sqrt(rest)


def group_noise(level, halves, spread) -> float:
    """Return the noise of a group as `_Sums.noise` states it.

    Parameters
    ----------
    level : (tile,) luminance. `halves` : (split, tile) half of what halves of the paths differ by.
    spread : (tile,) standard errors.
    """
    found = np.abs(halves) / level
    lit = found.max(axis=0, initial=0.0) > ROUNDING
    if not lit.any():
        return 0.0
    weight = level[lit]
    of_halves = weighted_median(found[:, lit].ravel(), np.tile(weight, len(found))) / NORMAL
    of_tiles = weighted_median(spread[lit] / weight, weight)
    return max(of_halves, math.hypot(of_halves, of_tiles) / math.sqrt(2))


def with_known(noise, paths, known) -> np.ndarray:
    """Return the noise (group,) of the mean of new paths and those known before; NaN where there is
    no light.

    Parameters
    ----------
    noise, paths : (group,) of the new ones. `known` : (group,) `Known`.
    """
    out = np.array(noise, float)
    for g, k in enumerate(known):
        if k.paths:
            own = None if np.isnan(out[g]) else float(out[g])
            both = pooled_noise([k.paths, paths[g]], [k.noise, own]) if paths[g] else k.noise
            out[g] = np.nan if both is None else both
    return out


def _around(values, reach):
    """Return the mean (..., row, column) of the tiles so many rows and columns around each; not a
    running sum, which a lamp would leave its rounding in.
    """
    rows, columns = values.shape[-2:]
    wide, side = (
        np.pad(values, [(0, 0)] * (values.ndim - 2) + [(reach, reach)] * 2, mode="edge"),
        2 * reach + 1,
    )
    down = sum(wide[..., i : i + rows, :] for i in range(side))
    return sum(down[..., j : j + columns] for j in range(side)) / side**2


def weighted_median(values, weights) -> float:
    """Return the value below which half of the weight lies."""
    order = np.argsort(values)
    below = np.cumsum(np.asarray(weights, float)[order])
    return float(np.asarray(values)[order][np.searchsorted(below, below[-1] / 2)])

"""Tallies: paths of one buffer in each tile, their light, and the variance of single paths.

A rare bright path makes a tile bright and its variance large at the same time. A tile that such
paths missed is dark, and its own variance is too small. The ratio of variance to light is therefore
averaged over a tile and its neighbours on the same object, and multiplied by the light of the tile
and of those around it.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from isethdr_core.runs.processor import processors

from ..integrator import Found
from ..work_items import Work
from .mean_of_rounds import MeanOfRounds, Sums

REACH = 2  # number of tiles on each side of a tile that count as its neighbours
ROUNDING = 1e-6  # relative standard error up to which a difference counts as rounding, not noise
# Largest ratio of the squared half difference of two buffers to its variance; larger ratios are
# limited to this value. With normal noise, one pair of buffers in 10^5 exceeds it.
MOST_APART = 20.0
PRIOR = 24.0  # weight of the variance of the neighbours, as a number of batches of the tile itself


@dataclass(eq=False)
class Tally:
    """Sums over the paths of one buffer, from which their variance follows, and their light.

    Attributes
    ----------
    paths, batches : (group, tile) number of paths and of batches.
    xyz : (group, 3, tile) X, Y and Z, summed over paths, cd/m2.
    squares : (group, 3, tile) sum over batches of (their X, Y, Z)^2 / their paths.
    light : mean light of the paths.
    """

    paths: np.ndarray
    batches: np.ndarray
    xyz: np.ndarray
    squares: np.ndarray
    light: MeanOfRounds

    @classmethod
    def empty(cls, groups: int, bands: int, tiles: int) -> Tally:
        """Return a tally without paths.

        Parameters
        ----------
        groups : number of light groups.
        bands : number of bands.
        tiles : number of tiles.
        """
        return cls(
            np.zeros((groups, tiles)),
            np.zeros((groups, tiles)),
            np.zeros((groups, 3, tiles)),
            np.zeros((groups, 3, tiles)),
            MeanOfRounds.empty(groups, bands, tiles),
        )

    def add(self, work: Work, sums: Found) -> None:
        """Add the results of a launch. Its list contains each tile at most once."""
        first = np.flatnonzero(work.lane == 0)
        paths = np.add.reduceat(work.paths.astype(float), first)
        over_items = lambda values: np.add.reduceat(values, first, axis=-1)
        bands = self.light.radiance.shape[1]
        for g in range(len(self.paths)):
            on = (work.groups[first] >> g & 1).astype(bool)
            if not on.any():
                continue
            tiles = work.tiles[on]
            values = sums.batches[g].astype(float)
            self.paths[g, tiles] += paths[on]
            self.batches[g, tiles] += work.lanes[first][on]
            xyz = over_items(values)[:, on]
            self.light.add(g, paths[on], Sums(tiles, sums.radiance[g, :bands][:, on], xyz))
            self.xyz[g][:, tiles] += xyz
            self.squares[g][:, tiles] += over_items(values**2 / work.paths)[:, on]

    def mean(self) -> np.ndarray:
        """Return X, Y and Z (group, 3, tile), cd/m2."""
        return self.light.mean_xyz()

    def own_variance(self) -> np.ndarray:
        """Return the variance (group, 3, tile) of X, Y and Z of single paths, (cd/m2)^2, from the
        batches of each tile alone.
        """
        squares = self.squares - self.xyz**2 / np.maximum(self.paths, 1)[:, None]
        return np.maximum(squares, 0) / np.maximum(self.batches - 1, 1)[:, None]


class Neighbours:
    """Sums over the neighbours of a tile that show the same object as the tile."""

    def __init__(self, instance: np.ndarray) -> None:
        """Find the neighbours from the object number `instance` (row, column) of each tile."""
        self.shape = instance.shape
        each = range(-REACH, REACH + 1)
        # for each shift: its reach, the slices of target and source tiles, and where both show the
        # same object
        self.pairs = []
        for down, right in ((d, r) for d in each for r in each):
            to, of = (
                tuple(
                    slice(max(-shift * sign, 0), max(n - max(shift * sign, 0), 0))
                    for shift, n in zip((down, right), instance.shape)
                )
                for sign in (1, -1)
            )
            same_object = (instance[to] == instance[of]).astype(np.float32)
            self.pairs.append((max(abs(down), abs(right)), to, of, same_object))
        one = np.ones((1, instance.size), np.float32)
        self.counts = {reach: self.sum(one, reach)[0] for reach in (1, REACH)}

    def sum(self, values: np.ndarray, reach: int = REACH, least: int = 0) -> np.ndarray:
        """Return sums (..., tile) of values (..., tile), float32, over the tiles within `reach`
        rows and columns that show the same object.

        Parameters
        ----------
        values : values of each tile.
        reach : largest number of rows or columns between a tile and its neighbours.
        least : smallest one; with 1, the tile itself does not count.
        """
        planes = np.asarray(values, np.float32).reshape(-1, *self.shape)
        out = np.zeros(planes.shape, np.float32)
        for total, plane in zip(out, planes):  # one plane at a time stays in the cache
            for distance, to, of, same_object in self.pairs:
                if least <= distance <= reach:
                    total[to] += plane[of] * same_object
        return out.reshape(np.shape(values))


def path_variance(tallies: list[Tally], near: Neighbours) -> np.ndarray:
    """Return the variance (group, 3, tile) of X, Y and Z of single paths, (cd/m2)^2, from all
    batches of `tallies`, float32.

    Parameters
    ----------
    tallies : one or two buffers.
    near : neighbours of the tiles.
    """
    return _of_groups(lambda g: _group_variance(tallies, tallies, g, near), tallies)


def variance_for_plan(own: Tally, other: Tally, near: Neighbours) -> np.ndarray:
    """Return the variance (group, 3, tile) of X, Y and Z of single paths, (cd/m2)^2, from which the
    paths of the buffer `own` are planned, float32.

    It follows from the batches of both buffers in the tiles around a tile, and from those of
    `other` in the tile itself. The paths that `own` has in the tile do not count.

    Parameters
    ----------
    own : buffer that is planned.
    other : the other buffer.
    near : neighbours of the tiles.
    """
    return _of_groups(lambda g: _group_variance([other], [own, other], g, near), [own])


def _of_groups(of_group: Callable[[int], np.ndarray], tallies: list[Tally]) -> np.ndarray:
    """Return the results of all groups, in one array."""
    # no compiled code runs at this time, and NumPy lets threads run in parallel
    with ThreadPoolExecutor(processors()) as threads:
        return np.stack(list(threads.map(of_group, range(len(tallies[0].paths)))))


class _Batches(NamedTuple):
    """What the batches of buffers show of a group in each tile, float32."""

    light: np.ndarray  # (3, tile) mean X, Y and Z
    squares: np.ndarray  # (3, tile) squared deviations from the mean of each buffer
    free: np.ndarray  # (tile,) degrees of freedom of `squares`


def _batches(tallies: list[Tally], g: int) -> _Batches:
    light = sum(t.xyz[g] for t in tallies) / np.maximum(sum(t.paths[g] for t in tallies), 1)
    # each mean takes one degree of freedom
    squares = sum(
        np.maximum(t.squares[g] - t.xyz[g] ** 2 / np.maximum(t.paths[g], 1), 0) for t in tallies
    )
    free = sum(np.maximum(t.batches[g] - 1, 0) for t in tallies)
    return _Batches(*(np.asarray(values, np.float32) for values in (light, squares, free)))


def _group_variance(
    in_tile: list[Tally], around: list[Tally], g: int, near: Neighbours
) -> np.ndarray:
    """Return the variance (3, tile) of X, Y and Z of single paths in group `g`.

    Parameters
    ----------
    in_tile : buffers that count in the tile itself.
    around : buffers that count in its neighbours.
    g : number of the group.
    near : neighbours of the tiles.
    """
    single = np.float32
    own = _batches(in_tile, g)
    every = own if around is in_tile else _batches(around, g)
    light, squares, free = (
        near.sum(neighbours, REACH, 1) + tile for neighbours, tile in zip(every, own, strict=True)
    )
    mean_squares = squares / np.maximum(free, 1)
    # where `rare_light` has taken all light away, or all but so little that the ratio exceeds
    # float32, the spread of the paths that it assumes stays
    is_lit = light > 0
    level = np.where(is_lit, np.maximum(light, np.finfo(single).tiny), 1)
    with np.errstate(over="ignore"):
        per_light = mean_squares / level
        per_light *= near.counts[REACH]
    is_lit &= np.isfinite(per_light)
    per_light[~is_lit] = 0
    close = near.sum(every.light, 1, 1) + own.light
    lent = per_light * (own.light + close / near.counts[1])
    # twice: as where the light of the tile and the light around it are equal
    lent = np.where(is_lit, lent, 2 * mean_squares)
    return (own.squares + single(PRIOR / 2) * lent) / (own.free + single(PRIOR))


def spread_of_buffers(first: Tally, second: Tally, of_batches: np.ndarray) -> np.ndarray:
    """Return for each group (group, 1, 1) the ratio of the variance found from two buffers to that
    found from their batches. It is the mean over tiles, each with the same weight.

    The batches of a tile take turns in one evenly spread sequence of points. Each batch is less
    evenly spread than the whole sequence, so the batches suggest too much noise. The buffers are
    independent: half of their difference has the variance of their mean.

    Parameters
    ----------
    first : half buffer A.
    second : half buffer B.
    of_batches : (group, 3, tile) variance of the mean of both buffers, from batches, (cd/m2)^2.
    """
    a = first.mean()
    b = second.mean()
    noisy = of_batches > (ROUNDING * (a + b) / 2) ** 2
    apart = np.divide(((a - b) / 2) ** 2, of_batches, out=np.zeros_like(a), where=noisy)
    sums = np.minimum(apart, MOST_APART).sum((1, 2))
    count = noisy.sum((1, 2))
    return np.where(count > 0, sums / np.maximum(count, 1), 1.0)[:, None, None]

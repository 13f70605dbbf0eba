"""Tallies: what the paths of one buffer add up to, tile by tile, and how much single paths vary.

Light that one path in many meets makes a tile bright and its spread wide at once; a tile that met
none of it is dark, and its own spread says nothing. So the spread of a tile's own batches counts
together with that of its neighbours on the same object, per light, times the light of the tile and
of those around it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .integrator import Found
from .work_items import Work

REACH = 2  # tiles around one whose spread counts
PRIOR = 24.0  # batches that the neighbours' spread counts as, beside a tile's own


@dataclass(eq=False)
class Tally:
    """Sums of one buffer. Radiance in W m-2 sr-1 nm-1, X, Y and Z in cd/m2, summed over paths."""

    paths: np.ndarray  # (group, tile)
    batches: np.ndarray  # (group, tile)
    radiance: np.ndarray  # (group, band, tile) float32
    xyz: np.ndarray  # (group, 3, tile)
    squares: np.ndarray  # (group, 3, tile): sum over batches of (their X, Y, Z)^2 / their paths

    @classmethod
    def empty(cls, groups: int, bands: int, tiles: int) -> Tally:
        """Return a tally of no path."""
        return cls(
            np.zeros((groups, tiles)),
            np.zeros((groups, tiles)),
            np.zeros((groups, bands, tiles), np.float32),
            np.zeros((groups, 3, tiles)),
            np.zeros((groups, 3, tiles)),
        )

    def add(self, work: Work, found: Found) -> None:
        """Add what a launch found; a tile is at most once in its list."""
        first = np.flatnonzero(work.lane == 0)
        paths = np.add.reduceat(work.paths.astype(float), first)
        over_items = lambda values: np.add.reduceat(values, first, axis=-1)
        bands = self.radiance.shape[1]
        for g in range(len(self.paths)):
            on = (work.groups[first] >> g & 1).astype(bool)
            if not on.any():
                continue
            tiles, values = work.tiles[on], found.batches[g].astype(float)
            self.paths[g, tiles] += paths[on]
            self.batches[g, tiles] += work.lanes[first][on]
            self.radiance[g][:, tiles] += found.radiance[g, :bands][:, on]
            self.xyz[g][:, tiles] += over_items(values)[:, on]
            self.squares[g][:, tiles] += over_items(values**2 / work.paths)[:, on]

    def mean(self) -> np.ndarray:
        """Return X, Y and Z (group, 3, tile), cd/m2."""
        return self.xyz / np.maximum(self.paths, 1)[:, None]


class Neighbours:
    """Sums over the tiles around each that show the same object."""

    def __init__(self, instance: np.ndarray):
        """`instance` : (row, column) number of the object that each tile shows."""
        self.shape = instance.shape
        label = instance.astype(np.int64)
        self.shifts = [
            (down, right) for down in range(-REACH, REACH + 1) for right in range(-REACH, REACH + 1)
        ]
        self.same = [self._moved(label, *shift, -1) == label for shift in self.shifts]

    def _moved(self, values, down, right, fill):
        out = np.full(values.shape, fill, values.dtype)
        rows, columns = self.shape
        to = (
            slice(max(-down, 0), rows - max(down, 0)),
            slice(max(-right, 0), columns - max(right, 0)),
        )
        of = (
            slice(max(down, 0), rows - max(-down, 0)),
            slice(max(right, 0), columns - max(-right, 0)),
        )
        if to[0].start < to[0].stop and to[1].start < to[1].stop:
            out[to] = values[of]
        return out

    def sum(self, values: np.ndarray, reach: int = REACH) -> np.ndarray:
        """Return sums (..., tile) of values (..., tile)."""
        planes = np.reshape(values, (-1, *self.shape))
        out = np.zeros(planes.shape)
        for total, plane in zip(out, planes):
            for (down, right), same in zip(self.shifts, self.same):
                if max(abs(down), abs(right)) <= reach:
                    total += np.where(same, self._moved(plane, down, right, 0.0), 0.0)
        return out.reshape(np.shape(values))


def path_variance(tallies: list[Tally], near: Neighbours) -> np.ndarray:
    """Return the variance (group, 3, tile) of X, Y and Z of single paths, from all batches of
    `tallies`.
    """
    light = sum(t.xyz for t in tallies) / np.maximum(sum(t.paths for t in tallies), 1)[:, None]
    # about each tally's own mean, which takes one batch of it
    squares = sum(
        np.maximum(t.squares - t.xyz**2 / np.maximum(t.paths, 1)[:, None], 0) for t in tallies
    )
    free = sum(np.maximum(t.batches - 1, 0) for t in tallies)
    count = near.sum(np.ones((1, light.shape[-1])), 1)
    wide = near.sum(np.ones((1, light.shape[-1])))
    level = np.maximum(near.sum(light) / wide, np.finfo(float).tiny)
    per_light = near.sum(squares) / np.maximum(near.sum(free), 1)[:, None] / level
    lent = per_light * (light + near.sum(light, 1) / count) / 2
    return (squares + PRIOR * lent) / (free[:, None] + PRIOR)

"""Mean light of the rounds of one buffer, with weights that do not follow the samples they weigh.

A tile whose first paths happened to find a rare bright path gets more paths in the other buffer,
and through these more paths of its own. If all paths had the same weight, the bright path would
then weigh less than a path of a tile that found none: the mean would lose rare light. Therefore
each round gets its share of the remaining weight before anything that depends on its paths is
known. The weighted mean is then without bias, whatever the later numbers of paths (it is a
martingale: Williams 1991, "Probability with Martingales", chapter 10). Plans also contain one
factor of the light group, which follows from all tiles; its influence falls with their number.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

# Expected later paths count this many times in the weight of a round, because early plans are often
# too low, and a weight that was given cannot be taken back. At 2, a plan that comes true costs at
# most an eighth of the variance. After 8 paths and a plan of 100 where 1000 are needed, a fifth
# more paths are needed; at 1, four times as many.
LATER = 2.0


class Sums(NamedTuple):
    """Sums over paths of one light group in some tiles."""

    tiles: np.ndarray  # (entry,)
    radiance: np.ndarray  # (band, entry) W m-2 sr-1 nm-1
    xyz: np.ndarray  # (3, entry) cd/m2


@dataclass(eq=False)
class MeanOfRounds:
    """Weighted mean of the light of the rounds of one buffer.

    Attributes
    ----------
    radiance : (group, band, tile) float32. Until the first round has its weight, the sums of its
        paths; then weighted means, W m-2 sr-1 nm-1.
    xyz : (group, 3, tile) sum of weighted means of X, Y and Z, cd/m2.
    square : (group, tile) sum over rounds of the squared weight over the number of paths: the
        variance of the mean over that of a single path.
    left : (group, tile) weight of the latest round and of later ones together; 0 where all weight
        has been given.
    paths, latest_xyz : (group, tile) and (group, 3, tile) paths of the latest round, and their sums
        of X, Y and Z.
    is_first : whether the latest round is the first one.
    latest : for each group, the sums of the latest round, unless it is the first one.
    """

    radiance: np.ndarray
    xyz: np.ndarray
    square: np.ndarray
    left: np.ndarray
    paths: np.ndarray
    latest_xyz: np.ndarray
    is_first: bool = True
    latest: list[list[Sums]] = field(default_factory=list)

    @classmethod
    def empty(cls, groups: int, bands: int, tiles: int) -> MeanOfRounds:
        """Return a mean that has no paths yet.

        Parameters
        ----------
        groups : number of light groups.
        bands : number of bands.
        tiles : number of tiles.
        """
        return cls(
            np.zeros((groups, bands, tiles), np.float32),
            np.zeros((groups, 3, tiles)),
            np.zeros((groups, tiles)),
            np.ones((groups, tiles)),
            np.zeros((groups, tiles)),
            np.zeros((groups, 3, tiles)),
            latest=[[] for _ in range(groups)],
        )

    def add(self, group: int, paths: np.ndarray, sums: Sums) -> None:
        """Add paths to the latest round.

        Parameters
        ----------
        group : number of the light group.
        paths : (entry,) number of paths in each tile of `sums`.
        sums : sums over these paths; each tile at most once.
        """
        self.paths[group, sums.tiles] += paths
        self.latest_xyz[group][:, sums.tiles] += sums.xyz
        if self.is_first:
            self.radiance[group][:, sums.tiles] += sums.radiance
        else:
            self.latest[group].append(sums)

    def give_weight(self, later: np.ndarray) -> None:
        """Give the latest round its weight.

        `later` must not depend on the paths of the latest round.

        Parameters
        ----------
        later : (group, tile) expected paths of later rounds; 0 where there will be none, so that
            the latest round gets all of the remaining weight.
        """
        # a tile that was finished before has no paths in the latest round, and gets no weight
        share = self.paths / np.maximum(self.paths + LATER * later, 1)
        weight = share * self.left
        per_path = weight / np.maximum(self.paths, 1)
        self.xyz += per_path[:, None] * self.latest_xyz
        self.square += weight * per_path
        self.left -= weight
        factor = per_path.astype(np.float32)
        if self.is_first:
            self.radiance *= factor[:, None]
            self.is_first = False
        for group, parts in enumerate(self.latest):
            for part in parts:
                on = part.tiles
                self.radiance[group][:, on] += part.radiance * factor[group, on]
            parts.clear()
        self.paths[:] = 0
        self.latest_xyz[:] = 0

    def give_all_weight(self) -> None:
        """Give the latest round all of the remaining weight."""
        self.give_weight(np.zeros_like(self.left))

    def reopen(self, more: np.ndarray) -> None:
        """Let planned paths count in tiles that have no weight left. The rounds so far keep the
        weight that they have if all paths count alike.

        Parameters
        ----------
        more : (group, tile) planned paths.
        """
        finished = (self.left == 0) & (more > 0)
        paths = 1 / np.where(finished, self.square, 1.0)
        kept = np.where(finished, paths / (paths + more), 1.0)
        self.radiance *= kept[:, None].astype(np.float32)
        self.xyz *= kept[:, None]
        self.square *= kept**2
        self.left = np.where(finished, 1 - kept, self.left)

    def mean_xyz(self) -> np.ndarray:
        """Return X, Y and Z (group, 3, tile), cd/m2, as if the latest round were the last."""
        per_path = self.left / np.maximum(self.paths, 1)
        return self.xyz + per_path[:, None] * self.latest_xyz

    def mean_radiance(self) -> np.ndarray:
        """Return radiance (group, band, tile), float32, after the first round or after all weight
        was given.
        """
        if self.is_first:
            return self.radiance / np.maximum(self.paths, 1)[:, None].astype(np.float32)
        return self.radiance

    def variance_factor(self) -> np.ndarray:
        """Return the variance of the mean (group, tile) over that of a single path, as if the
        latest round were the last.
        """
        return self.square + self.left**2 / np.maximum(self.paths, 1)

    def later_paths(self, needed: np.ndarray) -> np.ndarray:
        """Return the paths (group, tile) to add to the latest round, so that the variance of the
        mean becomes that of `needed` paths with equal weights.

        Where the rounds that have their weight leave more than half of that variance, this is out
        of reach. The later paths then add as much variance as those rounds.

        Parameters
        ----------
        needed : (group, tile) needed paths.
        """
        allowed = 1 / np.maximum(needed, 1e-3) - self.square
        reachable = np.maximum(allowed, np.maximum(self.square, 1e-12))
        return np.maximum(self.left**2 / reachable - self.paths, 0)

"""Moved light: light of rare bright paths that goes from single tiles to the tiles around them.

The light of a tile is distributed over tiles of the same object, or of any object, in proportion to
the noise of the cameras and to the room that is left there: all that a tile receives stays below
half of that noise. Each light group keeps its light; only its place changes. Methods that drop or
weigh down such paths lose light (DeCoro, Weyrich, Rusinkiewicz 2010; Zirr, Hanika, Dachsbacher
2018).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from .tallies import Tally

LITTLE = 0.05  # light that a tile receives from another tile, as a share of the cameras' noise
MOST = 0.5  # as LITTLE, from all tiles together; light that has no room stays in its tile


@dataclass(frozen=True, eq=False)
class CameraNoise:
    """Noise of the cameras, and the noise that is wanted of the renderer.

    Attributes
    ----------
    weights : weight of each light group.
    luminance : (row, column) noise of the luminance of all light, cd/m2; infinite where no camera
        sees the tile.
    share : wanted noise of the renderer as a share of `luminance`.
    """

    weights: Sequence[float]
    luminance: np.ndarray
    share: float


class Region(NamedTuple):
    """Tiles that may receive the light of a tile."""

    # numbers of tiles on each side of it: the first with which no tile receives more than `LITTLE`
    # is used, or else the last
    reaches: Sequence[int]
    same_object: bool = True  # only tiles of the same object


class Receivers(NamedTuple):
    """Tiles that receive the light of one tile."""

    tiles: np.ndarray  # (receiver,) numbers of the tiles
    shares: np.ndarray  # (receiver,) shares of the light; their sum is 1
    of_noise: np.ndarray  # (receiver,) received luminance as a share of the noise of the cameras


class Stays(NamedTuple):
    """Light that stays in a tile of a buffer when the rest is taken."""

    share: float  # of the light of the tile
    # (3,) variance of X, Y and Z of single paths that is assumed for the paths that remain,
    # (cd/m2)^2
    variance: np.ndarray


@dataclass(eq=False)
class MovedLight:
    """Light that was moved between tiles of two half buffers.

    Attributes
    ----------
    buffers : the two half buffers, changed in place; all rounds have their weight.
    instance : (row, column) number of the object in each tile.
    noise : noise of the cameras.
    tiles : (group,) number of times that light was taken from a tile of a buffer.
    light : (group,) moved luminance as a share of the luminance of all tiles.
    variance : (group, 3, tile) sum of the squares of X, Y and Z that a tile received, (cd/m2)^2.
    of_noise : (tile,) received luminance as a share of the noise of the cameras.
    """

    buffers: Sequence[Tally]
    instance: np.ndarray
    noise: CameraNoise
    tiles: np.ndarray = field(init=False)
    light: np.ndarray = field(init=False)
    variance: np.ndarray = field(init=False)
    of_noise: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        groups = len(self.noise.weights)
        self.tiles = np.zeros(groups, int)
        self.light = np.zeros(groups)
        self.variance = np.zeros((groups, 3, self.instance.size))
        self.of_noise = np.zeros(self.instance.size)
        self._all_light = sum(tally.mean()[:, 1].sum(1) for tally in self.buffers)

    @property
    def most(self) -> float:
        """Return the largest received luminance, as a share of the noise of the cameras."""
        return float(self.of_noise.max())

    def move(self, buffer: int, g: int, tile: int, stays: Stays, region: Region) -> bool:
        """Move light from a tile of one buffer to the tiles around it, and return whether it could
        be moved. It stays if the other tiles would receive more than `MOST` of the noise.

        Parameters
        ----------
        buffer : number of the buffer.
        g : number of the light group.
        tile : number of the tile; a camera sees it.
        stays : light that stays in the tile.
        region : where the light may go.
        """
        tally = self.buffers[buffer]
        excess = (1 - stays.share) * tally.light.xyz[g, 1, tile]
        to = self._receivers(tile, 0.5 * self.noise.weights[g] * excess, region)
        if to is None:
            return False
        given = give(tally, g, to, take(tally, g, tile, stays))
        self.variance[g][:, to.tiles] += (given / 2) ** 2
        self.of_noise[to.tiles] += to.of_noise
        self.tiles[g] += 1
        self.light[g] += excess / self._all_light[g]
        return True

    def _receivers(self, tile: int, change: float, region: Region) -> Receivers | None:
        """Return the tiles that receive the light of a tile; None if they have no room for it.

        Parameters
        ----------
        tile : number of the tile that light is taken from.
        change : change of its luminance, cd/m2.
        region : where the light may go.
        """
        for reach in region.reaches:
            tiles = self._around(tile, reach, region.same_object)
            room = MOST - self.of_noise[tiles]
            most = self.noise.luminance.ravel()[tiles] * room
            whole = most.sum()
            fits = change <= whole
            if fits and change / whole * room.max() <= LITTLE:
                break
        return Receivers(tiles, most / whole, change / whole * room) if fits else None

    def _around(self, tile: int, reach: int, same_object: bool) -> np.ndarray:
        """Return the numbers of the tiles around a tile that a camera sees.

        Parameters
        ----------
        tile : number of the tile.
        reach : number of rows and columns on each side of it.
        same_object : whether only tiles of the same object count.
        """
        row, column = divmod(tile, self.instance.shape[1])
        rows = slice(max(row - reach, 0), row + reach + 1)
        columns = slice(max(column - reach, 0), column + reach + 1)
        seen = np.isfinite(self.noise.luminance[rows, columns])
        if same_object:
            seen &= self.instance[rows, columns] == self.instance[row, column]
        down, right = np.nonzero(seen)
        return (down + rows.start) * self.instance.shape[1] + right + columns.start


class Taken(NamedTuple):
    """Light that was taken from a tile of a buffer."""

    radiance: np.ndarray  # (band,), W m-2 sr-1 nm-1
    xyz: np.ndarray  # (3,) X, Y and Z, cd/m2


def take(tally: Tally, g: int, tile: int, stays: Stays) -> Taken:
    """Take light from a tile of a buffer.

    Parameters
    ----------
    tally : the buffer, changed in place.
    g : number of the light group.
    tile : number of the tile.
    stays : light that stays in the tile.
    """
    light = tally.light
    gone = 1 - stays.share
    taken = Taken(gone * light.radiance[g, :, tile], gone * light.xyz[g, :, tile])
    light.radiance[g, :, tile] *= stays.share
    light.xyz[g, :, tile] *= stays.share
    # what is left of the paths has the assumed variance
    free = max(tally.batches[g, tile] - 1, 0)
    tally.xyz[g, :, tile] *= stays.share
    squares = stays.variance * free + tally.xyz[g, :, tile] ** 2 / tally.paths[g, tile]
    tally.squares[g, :, tile] = squares
    return taken


def give(tally: Tally, g: int, to: Receivers, taken: Taken) -> np.ndarray:
    """Add light to tiles of a buffer, and return their X, Y and Z (3, receiver), cd/m2.

    Parameters
    ----------
    tally : the buffer, changed in place.
    g : number of the light group.
    to : receiving tiles.
    taken : light to add.
    """
    given = taken.xyz[:, None] * to.shares
    tally.light.radiance[g][:, to.tiles] += taken.radiance[:, None] * to.shares
    tally.light.xyz[g][:, to.tiles] += given
    return given

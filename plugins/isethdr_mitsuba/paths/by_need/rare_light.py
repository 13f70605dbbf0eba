"""Rare light: light of rare bright paths, moved from single tiles to the tiles around them.

A path of small probability that carries much light makes its tile far too bright. The other half
buffer has independent paths, and shows that the tile is not bright: the two buffers differ by many
standard deviations of the darker one, or the darker one has many more paths. The brighter buffer
then gets the light of the darker one in that tile. The difference is distributed over the tiles of
the same object around it, in proportion to the noise of the cameras, where it stays below that
noise. Each light group keeps its light; only its place changes. Methods that drop or weigh down
such paths lose light (DeCoro, Weyrich, Rusinkiewicz 2010; Zirr, Hanika, Dachsbacher 2018).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .tallies import Neighbours, Tally, path_variance

# Least difference of the buffers, in standard deviations that the paths of the darker one suggest.
# With normal noise one tile in 30,000 exceeds it.
APART = 4.0
# If the darker buffer has this many times the samples (counted by their weights), any difference is
# enough: the darker buffer got its many paths because the other one found a bright path.
BETTER = 4.0
# Numbers of tiles on each side of a tile over which its light is distributed: the first with which
# no tile receives more than LITTLE
REACHES = (4, 8, 16, 32)
LITTLE = 0.05  # light that a tile receives from another tile, as a share of the cameras' noise
MOST = 0.5  # as LITTLE, from all tiles together; light that would add to more stays in its tile


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


@dataclass(frozen=True, eq=False)
class Moved:
    """Light that was moved between tiles.

    Attributes
    ----------
    tiles : (group,) number of tiles that light was taken from.
    light : (group,) moved luminance as a share of the luminance of all tiles.
    variance : (group, 3, tile) sum of the squares of X, Y and Z that a tile received, (cd/m2)^2.
    most : largest luminance that a tile received, as a share of the noise of the cameras.
    """

    tiles: np.ndarray
    light: np.ndarray
    variance: np.ndarray
    most: float


class Receivers(NamedTuple):
    """Tiles that receive the light of one tile."""

    tiles: np.ndarray  # (receiver,) numbers of the tiles
    shares: np.ndarray  # (receiver,) shares of the light; their sum is 1
    of_noise: float  # received luminance as a share of the noise of the cameras, equal in all


def move_rare_light(
    buffers: Sequence[Tally], instance: np.ndarray, near: Neighbours, noise: CameraNoise
) -> Moved:
    """Move the light of rare bright paths between tiles, and return how much was moved.

    Light is moved if it changes the luminance of its tile by more than the wanted noise, and if it
    is `APART` standard deviations above the light of the other buffer, or the other buffer has
    `BETTER` times the samples. No tile receives more than `MOST` of the noise of the cameras.

    Parameters
    ----------
    buffers : the two half buffers, changed in place; all rounds have their weight.
    instance : (row, column) number of the object in each tile.
    near : neighbours of the tiles.
    noise : noise of the cameras.
    """
    variances = [path_variance([tally], near) for tally in buffers]
    means = [tally.mean() for tally in buffers]
    groups = len(noise.weights)
    tiles = np.zeros(groups, int)
    light = np.zeros(groups)
    variance = np.zeros(means[0].shape)
    of_noise = np.zeros(instance.size)
    allowed = noise.share * noise.luminance.ravel()
    for g, weight in enumerate(noise.weights):
        if weight <= 0:
            continue
        whole = (means[0][g, 1] + means[1][g, 1]).sum()
        factors = [tally.light.variance_factor()[g] for tally in buffers]
        for bright, dark in ((0, 1), (1, 0)):
            excess = means[bright][g, 1] - means[dark][g, 1]
            change = 0.5 * weight * excess
            apart = APART * np.sqrt(variances[dark][g, 1] * sum(factors))
            told = (excess > apart) | (factors[bright] >= BETTER * factors[dark])
            # a tile where the cameras have no noise could share its light with no tile
            is_rare = (change > allowed) & told & (allowed > 0)
            for tile in np.flatnonzero(is_rare):
                to = receivers(tile, change[tile], instance, noise.luminance)
                if of_noise[to.tiles].max() + to.of_noise > MOST:
                    continue
                kept = means[dark][g, 1, tile] / means[bright][g, 1, tile]
                taken = take(buffers[bright], g, tile, kept, variances[dark][g, :, tile])
                given = give(buffers[bright], g, to, taken)
                variance[g][:, to.tiles] += (given / 2) ** 2
                of_noise[to.tiles] += to.of_noise
                tiles[g] += 1
                light[g] += excess[tile] / whole
    return Moved(tiles, light, variance, float(of_noise.max()))


def receivers(tile: int, change: float, instance: np.ndarray, luminance: np.ndarray) -> Receivers:
    """Return the tiles of the same object around a tile that can receive its light.

    Parameters
    ----------
    tile : number of the tile that light is taken from.
    change : change of its luminance, cd/m2.
    instance : (row, column) number of the object in each tile.
    luminance : (row, column) noise of the cameras, cd/m2; tiles with infinite noise receive none.
    """
    row, column = divmod(int(tile), instance.shape[1])
    for reach in REACHES:
        rows = slice(max(row - reach, 0), row + reach + 1)
        columns = slice(max(column - reach, 0), column + reach + 1)
        same_object = instance[rows, columns] == instance[row, column]
        part = np.where(
            same_object & np.isfinite(luminance[rows, columns]), luminance[rows, columns], 0
        )
        received = change / part.sum()
        if received <= LITTLE:
            break
    down, right = np.nonzero(part)
    tiles = (down + rows.start) * instance.shape[1] + right + columns.start
    return Receivers(tiles, part[down, right] / part.sum(), received)


class Taken(NamedTuple):
    """Light that was taken from a tile of a buffer."""

    radiance: np.ndarray  # (band,), W m-2 sr-1 nm-1
    xyz: np.ndarray  # (3,) X, Y and Z, cd/m2


def take(tally: Tally, g: int, tile: int, kept: float, variance: np.ndarray) -> Taken:
    """Take light from a tile of a buffer.

    Parameters
    ----------
    tally : the buffer, changed in place.
    g : number of the light group.
    tile : number of the tile.
    kept : share of the light that stays in the tile.
    variance : (3,) variance of X, Y and Z of single paths that is assumed for the paths that
        remain, (cd/m2)^2.
    """
    light = tally.light
    taken = Taken((1 - kept) * light.radiance[g, :, tile], (1 - kept) * light.xyz[g, :, tile])
    light.radiance[g, :, tile] *= kept
    light.xyz[g, :, tile] *= kept
    # what is left of the paths has the assumed variance
    free = max(tally.batches[g, tile] - 1, 0)
    tally.xyz[g, :, tile] *= kept
    tally.squares[g, :, tile] = variance * free + tally.xyz[g, :, tile] ** 2 / tally.paths[g, tile]
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

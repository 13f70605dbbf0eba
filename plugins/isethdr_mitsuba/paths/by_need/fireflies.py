"""Fireflies: tiles that rare bright paths make far too bright, found by further paths.

Two half buffers show most of them (`rare_light`), but not all: both buffers may have found the rare
light, or the darker one has too few paths to tell. Tiles that are far brighter than those around
them therefore get further paths, which count in no buffer. If these find less light, the tile keeps
what they find. The rest goes to the tiles around it (`moved_light`), of the same object if that has
room. The light of each group stays the same, because the further paths decide only its place.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .moved_light import MovedLight, Region, Stays
from .tallies import Tally

# A tile gets further paths if its luminance is at least this many times the median of the tiles of
# the same object around it, and this many standard deviations of the least noisy camera above it.
# Beyond 8 times and 5 standard deviations a tile that is too bright counts as a firefly.
TIMES_MEDIAN = 6.0
SIGMAS = 4.0
AROUND = 2  # number of tiles on each side of a tile: 5 x 5 in all
# Least luminance by the further paths, as a share of that of the tile, with which the tile stays as
# it is. Below 0.5 it would count as a firefly; the paths themselves are noisy.
CONFIRMED = 0.75
# Number of further paths of a tile after each step. Most tiles that stand out are really bright,
# and the first step confirms them.
PATHS = (256, 1024, 4096, 16384)
LEAST = 4096  # least further paths of a tile that is not confirmed: fewer may miss rare light
SURE = 2.0  # standard errors of the further paths at which a step confirms a tile, or does not
# where the light of a firefly goes: to the same object, or, if that is too small, to any
FAR = (4, 8, 16, 32, 64, 128, 256)
REGIONS = (Region(FAR), Region(FAR, same_object=False))

# Function (tally, tiles, positions, paths): follows `paths` paths through each of
# `tiles[positions]`, and adds their light to `tally` at these positions
Follow = Callable[[Tally, np.ndarray, np.ndarray, int], None]


def move_fireflies(moved: MovedLight, follow: Follow) -> int:
    """Move light out of tiles that further paths do not confirm, and return the number of tiles
    that got further paths.

    Parameters
    ----------
    moved : the buffers, the noise of the cameras, and the light that is moved.
    follow : follows further paths.
    """
    weights = np.asarray(moved.noise.weights)
    groups, bands, _ = moved.buffers[0].light.radiance.shape
    luminance = sum(weights @ tally.light.xyz[:, 1] for tally in moved.buffers) / 2
    plane = luminance.reshape(moved.instance.shape)
    tiles = np.flatnonzero(stands_out(plane, moved.instance, moved.noise.luminance))
    further = Tally.empty(groups, bands, len(tiles))
    doubtful = np.arange(len(tiles))
    unconfirmed = np.zeros(len(tiles), bool)
    for before, paths in zip((0, *PATHS), PATHS):
        if not len(doubtful):
            break
        follow(further, tiles, doubtful, paths - before)
        found = weights @ further.mean()[:, 1, doubtful]
        # the groups share their paths: their errors may add
        error = weights @ np.sqrt(further.own_variance()[:, 1, doubtful] / paths)
        missing = CONFIRMED * luminance[tiles[doubtful]] - found
        unconfirmed[doubtful] = missing > 0
        is_decided = (missing < -SURE * error) | ((missing > SURE * error) & (paths >= LEAST))
        doubtful = doubtful[~is_decided]
    for position in np.flatnonzero(unconfirmed):
        _keep_found(moved, int(tiles[position]), further, position)
    return len(tiles)


def _keep_found(moved: MovedLight, tile: int, further: Tally, position: int) -> None:
    """Leave the light in a tile that further paths found there, and move the rest.

    Parameters
    ----------
    moved : the buffers and the light that is moved.
    tile : number of the tile.
    further : light of the further paths.
    position : position of the tile in `further`.
    """
    mean = further.mean()[:, 1, position]
    variance = further.own_variance()[:, :, position]
    for buffer, tally in enumerate(moved.buffers):
        for g, weight in enumerate(moved.noise.weights):
            luminance = tally.light.xyz[g, 1, tile]
            if weight > 0 and luminance > mean[g]:
                stays = Stays(mean[g] / luminance, variance[g])
                for region in REGIONS:
                    if moved.move(buffer, g, tile, stays, region):
                        break


def stands_out(luminance: np.ndarray, instance: np.ndarray, sigma: np.ndarray) -> np.ndarray:
    """Return a mask (row, column) of the tiles that stand out from those around them.

    Parameters
    ----------
    luminance : (row, column) cd/m2.
    instance : (row, column) number of the object in each tile.
    sigma : (row, column) noise of the cameras, cd/m2; infinite or 0 where a tile cannot stand out.
    """
    # no median is below 0, so that these are all that may stand out
    bright = (luminance > SIGMAS * sigma) & (sigma > 0)
    rows, columns = np.nonzero(bright)
    median = median_around(luminance, instance, rows, columns)
    above = luminance[rows, columns] > np.maximum(
        TIMES_MEDIAN * median, median + SIGMAS * sigma[rows, columns]
    )
    bright[rows, columns] = above
    return bright


def median_around(
    values: np.ndarray, instance: np.ndarray, rows: np.ndarray, columns: np.ndarray
) -> np.ndarray:
    """Return the median around each of some tiles (tile,): that of the tiles of the same object
    among the 5 x 5 tiles around it.

    Parameters
    ----------
    values : (row, column) values of all tiles.
    instance : (row, column) number of the object in each tile.
    rows, columns : (tile,) places of the tiles.
    """
    padded = np.pad(values.astype(float), AROUND, constant_values=np.inf)
    objects = np.pad(instance.astype(np.int64), AROUND, constant_values=-1)
    own = instance[rows, columns]
    side = range(2 * AROUND + 1)
    around = np.stack(
        [
            np.where(objects[rows + y, columns + x] == own, padded[rows + y, columns + x], np.inf)
            for y in side
            for x in side
        ]
    )
    around.sort(0)  # infinite values, of tiles of other objects, come last
    count = np.isfinite(around).sum(0)
    each = np.arange(len(rows))
    return 0.5 * (around[(count - 1) // 2, each] + around[count // 2, each])

"""Work items: which paths of which tiles one launch of compiled code follows.

A work item is one lane of compiled code: some of the paths of one tile. A tile's items take turns
in its one sequence of points, so that the sums of its items are batches of its paths: their spread
is the variance, from one launch. Counts, light groups and tiles are arrays, so that any list of
them is a launch of the same kernel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# paths on one camera ray: two take 0.73, four 0.61 of the time of as many rays; eight 0.53, but
# 1.35 times the variance
MOST_SHARES = 4
# camera rays of a pass through each tile: as far as there are so many paths, none is shared before
LEAST_RAYS = 64
MOST_LANES = (
    16  # neighbours in compiled code that follow paths of one tile: they meet the same surfaces
)
LEAST_A_LANE = 32  # paths: with fewer the last ones are waited for


@dataclass(frozen=True, eq=False)
class Work:
    """Work items of one launch, and the tiles that they belong to.

    Items of one tile stand side by side, a power of two of them, and larger powers come first: so
    they are always within the lanes that compiled code sums up in one order.
    """

    tiles: np.ndarray  # (entry,) numbers of tiles, row by row of the view
    streams: np.ndarray  # (entry,) which of a tile's sequences of random numbers; 0 is the first
    owner: np.ndarray  # (item,) number of the entry
    lane: np.ndarray  # (item,) which of the entry's items
    lanes: np.ndarray  # (item,) how many the entry has
    paths: np.ndarray  # (item,) of this item
    shares: np.ndarray  # (item,) paths on one camera ray
    groups: np.ndarray  # (item,) light groups wanted, bit by bit


def lanes_and_shares(samples: int) -> tuple[int, int]:
    """Return of a pass how many lanes of compiled code follow the `samples` paths of a tile, a
    power of two, and how many paths share a camera ray.
    """
    lanes = 1
    while lanes < MOST_LANES and samples >= 2 * lanes * LEAST_A_LANE:
        lanes *= 2
    return lanes, int(np.clip(samples // LEAST_RAYS, 1, MOST_SHARES))


def even_work(tiles: int, samples: int, groups: int) -> Work:
    """Return the items of a pass of `samples` paths through each of all tiles.

    Parameters
    ----------
    groups : light groups wanted, bit by bit.
    """
    lanes, shares = lanes_and_shares(samples)
    lane = np.tile(np.arange(lanes), tiles)
    same = lambda value: np.broadcast_to(np.uint32(value), lane.shape)
    return Work(
        np.arange(tiles),
        np.zeros(tiles, int),
        np.repeat(np.arange(tiles), lanes),
        lane,
        same(lanes),
        (samples - lane + lanes - 1) // lanes,
        same(shares),
        same(groups),
    )


def listed_work(tiles, paths, groups, stream: int = 0) -> Work:
    """Return the items of a list of different tiles.

    Parameters
    ----------
    tiles : (entry,) numbers. `paths` : (entry,) of each, two at least. `groups` : (entry,) light
        groups wanted, bit by bit. `stream` : which of the tiles' sequences of random numbers.
    """
    tiles, paths, groups = (np.asarray(a, int) for a in (tiles, paths, groups))
    # two at least: one batch alone has no spread
    wide = np.round(np.log2(np.maximum(paths / LEAST_A_LANE, 1))).astype(int)
    lanes = 2 ** np.clip(wide, 1, np.log2(MOST_LANES).astype(int))
    # lanes side by side wait for the longest of them: alike ones together, and neighbours in the
    # picture within these
    order = np.lexsort((np.arange(len(tiles)), -paths, -lanes))
    tiles, paths, groups, lanes = (a[order] for a in (tiles, paths, groups, lanes))
    owner = np.repeat(np.arange(len(tiles)), lanes)
    lane = np.arange(len(owner)) - np.repeat(np.cumsum(lanes) - lanes, lanes)
    return Work(
        tiles,
        np.full(len(tiles), stream),
        owner,
        lane,
        lanes[owner],
        (paths[owner] - lane + lanes[owner] - 1) // lanes[owner],
        np.clip(paths // LEAST_RAYS, 1, MOST_SHARES)[owner],
        groups[owner],
    )

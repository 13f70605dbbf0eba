"""Work items: the paths that one launch of compiled code follows.

A work item is one lane of compiled code. It follows some of the paths of one tile. The items of a
tile take turns in the sequence of sample points of the tile. The sums of the items are therefore
batches of its paths, and their spread gives the variance from one launch. Counts, light groups and
tiles are arrays, so that every list of them uses the same kernel.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path

import drjit as dr
import numpy as np

# Largest number of paths that share a camera ray. Relative to one camera ray per path, two paths
# per ray take 0.73 of the time and four 0.61. Eight take 0.53, but have 1.35 times the variance.
MOST_SHARES = 4
# smallest number of camera rays through a tile; only further paths share a camera ray
LEAST_RAYS = 64
# largest number of adjacent lanes that follow paths of one tile; they hit the same surfaces
MOST_LANES = 16
LEAST_A_LANE = 32  # smallest number of paths per lane; with fewer, most lanes wait for the others
# Number of work items that a processor takes from a launch at a time. Some items have longer paths
# than others: with Dr.Jit's default of 16384, one processor still works while the others are idle.
BLOCK_ITEMS = 1024


@dataclass(frozen=True, eq=False)
class Work:
    """Work items of one launch, and their tiles.

    Items of one tile are adjacent. Their number is a power of two, and tiles with more items come
    first. The first item of a tile therefore lies at a multiple of their number, and compiled code
    always sums them in the same order.
    """

    tiles: np.ndarray  # (entry,) numbers of tiles, row by row of the view
    streams: np.ndarray  # (entry,) number of the tile's sequence of random numbers, from 0
    owner: np.ndarray  # (item,) number of the entry
    lane: np.ndarray  # (item,) position among the items of the entry
    lanes: np.ndarray  # (item,) number of items of the entry
    paths: np.ndarray  # (item,) number of paths of the item
    shares: np.ndarray  # (item,) largest number of paths that share a camera ray
    groups: np.ndarray  # (item,) bit mask of the light groups to compute


def lanes_and_shares(samples: int) -> tuple[int, int]:
    """Return (lanes, shares) for `samples` paths of a tile.

    `lanes` is the number of lanes, a power of two; `shares` is the number of paths that share a
    camera ray.
    """
    lanes = 1
    while lanes < MOST_LANES and samples >= 2 * lanes * LEAST_A_LANE:
        lanes *= 2
    return lanes, int(np.clip(samples // LEAST_RAYS, 1, MOST_SHARES))


def even_work(tiles: int, samples: int, groups: int) -> Work:
    """Return the items of a pass with `samples` paths through each tile.

    Parameters
    ----------
    tiles : number of tiles.
    samples : number of paths through each tile.
    groups : bit mask of the requested light groups.
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


def listed_work(
    tiles: np.ndarray, paths: np.ndarray, groups: np.ndarray, *, sky: int = 0, stream: int = 0
) -> Work:
    """Return the items of a list of different tiles.

    Paths share a camera ray only where no lamp is requested. With lamps, most of the noise comes
    from the points at which rays meet the first surface: edges of shadows and objects in a tile.

    Parameters
    ----------
    tiles : (entry,) numbers of tiles.
    paths : (entry,) number of paths of each tile, at least two.
    groups : (entry,) bit mask of the requested light groups.
    sky : bit mask of the light groups without lamps.
    stream : number of the sequence of random numbers.
    """
    tiles, paths, groups = (np.asarray(a, int) for a in (tiles, paths, groups))
    # at least two lanes, because a single batch has no spread
    wide = np.round(np.log2(np.maximum(paths / LEAST_A_LANE, 1))).astype(int)
    lanes = 2 ** np.clip(wide, 1, np.log2(MOST_LANES).astype(int))
    # Adjacent lanes wait for the longest of them. Items with equal numbers of paths are therefore
    # adjacent, and among these, neighbours in the picture.
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
        np.where(groups & ~sky, 1, np.clip(paths // LEAST_RAYS, 1, MOST_SHARES))[owner],
        groups[owner],
    )


def divide_launches(items: int = BLOCK_ITEMS) -> bool:
    """Make each processor take `items` work items of a launch at a time, and return whether Dr.Jit
    supports it.

    Dr.Jit does not export the function to Python. A version without the function keeps its default,
    which takes longer and changes no result.
    """
    library = Path(dr.__file__).with_name("libdrjit-core.so")
    try:
        set_block_size = ctypes.CDLL(str(library))["_Z23jit_llvm_set_block_sizej"]
    except (OSError, AttributeError):
        return False
    set_block_size.argtypes = [ctypes.c_uint32]
    set_block_size.restype = None
    set_block_size(items)
    return True

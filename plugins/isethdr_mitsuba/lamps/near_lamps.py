"""Near lamps: those that light a block of the picture, each with a shadow ray of its own.

From the first surface of a path nearly all noise is that of the one shadow ray that a group has:
it cannot be right for several lamps at once. So the lamps that points of a block saw are looked at
one by one, and the choice by chance is left with the others. Both together are all lamps, each
once.
"""

from __future__ import annotations

from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..paths.device_memory import aligned

# of each group and block: on the night drive 90 % of the blocks have no more that anything lights
MOST_NEAR = 8
SEEN = 1.01  # even shares of the chances: a lamp with more of them got a vote


class NearList(NamedTuple):
    """Near lamps of one group: their numbers within the group and what is left for chance."""

    lamps: np.ndarray  # (block, MOST_NEAR), the likeliest first
    length: np.ndarray  # (block,) how many of them there are
    slots: np.ndarray  # (block, slot) of the other lamps


def near_list(known, slots, chance) -> NearList:
    """Return the near lamps of each block.

    Parameters
    ----------
    known : (block,) whether any of its points saw a lamp: else none is near.
    slots : (block, slot) numbers of lamps, each slot as likely as any other.
    chance : (block, lamp) share of the slots that a lamp has.
    """
    blocks, count = chance.shape
    order = np.argsort(-chance, axis=1, kind="stable")[:, :MOST_NEAR]
    length = (np.take_along_axis(chance, order, 1) > SEEN / slots.shape[1]).sum(1) * known
    rows, places = np.arange(blocks)[:, None], np.arange(order.shape[1])
    near = np.zeros(chance.shape, bool)
    near[rows, order] = places < length[:, None]
    lamps = np.zeros((blocks, MOST_NEAR), int)
    lamps[:, : order.shape[1]] = order
    return NearList(lamps, length, _without(slots, chance, near))


def _without(slots, chance, near):
    """Return slots (block, slot) in which lamps that are `near` (block, lamp) have none: each other
    one has at least as many as before, and where there is no other nothing changes.
    """
    rest = np.where(near, 0.0, chance)
    some = near.any(1) & (rest.sum(1) > 0)
    ends = np.cumsum(rest[some], axis=1)
    ends /= ends[:, -1:]
    blocks, places = len(ends), slots.shape[1]
    # every other lamp's share has grown beyond a slot's, so that it holds the middle of one
    at = (np.arange(places) + 0.5) / places
    row = np.arange(blocks)[:, None]
    found = np.searchsorted((ends + row).ravel(), (at + row).ravel()).reshape(blocks, places)
    out = slots.copy()
    out[some] = found - row * chance.shape[1]
    return out


class NearLamps:
    """Device lists of the near lamps of all groups."""

    def __init__(self, lists: list[NearList | None], members, blocks: int):
        """`lists` : of each group; None of one without lamps. `members` : numbers of each group's
        lamps.
        """
        self.lamps, self.lengths = [], []
        for found, mine in zip(lists, map(np.asarray, members), strict=True):
            lamps, length = (np.zeros(1), np.zeros(1)) if found is None else found[:2]
            if found is not None:
                lamps = mine[lamps]
            self.lamps.append(mi.UInt32(aligned(lamps, np.uint32)))
            self.lengths.append(mi.UInt32(aligned(length, np.uint32)))
        self.most, self.blocks = dr.opaque(mi.UInt32, MOST_NEAR), dr.opaque(mi.UInt32, blocks)
        dr.eval(*self.lamps, *self.lengths)

    def length(self, g: int, block, active):
        """Return how many near lamps group number `g` has at a block."""
        return dr.gather(mi.UInt32, self.lengths[g], block, active)

    def lamp(self, g: int, block, turn, active):
        """Return the number of near lamp `turn` of group number `g` at a block."""
        return dr.gather(mi.UInt32, self.lamps[g], block * self.most + turn, active)

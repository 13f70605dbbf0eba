"""Near lamps: the lamps that light a block of the picture. Each of them gets a shadow ray of its
own.

At the first surface of a path, nearly all noise comes from the single shadow ray of a group, which
can test only one of several lamps. The lamps that light points of a block are therefore sampled one
by one. Only the other lamps are chosen at random. Together, both parts cover each lamp exactly
once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..paths.device_memory import aligned

# Largest number of near lamps for each group and block. On the night drive, at most this many lamps
# light the points of 90 % of the blocks.
MOST_NEAR = 8
# Threshold in slots: a lamp with a larger share of the probability than this many slots got a vote.
SEEN = 1.01
# Smallest share of a block's probability for a shadow ray of its own. With 1,000 lamps the eight
# most probable ones have 6 % of the light together.
LEAST_SHARE = 0.02


class NearList(NamedTuple):
    """Near lamps of one group: their numbers within the group, and the lamps that are chosen at
    random.
    """

    lamps: np.ndarray  # (block, MOST_NEAR), the most probable first
    length: np.ndarray  # (block,) number of near lamps
    slots: np.ndarray  # (block, slot) numbers of the other lamps


def near_list(known_lamps: np.ndarray, slots: np.ndarray, chance: np.ndarray) -> NearList:
    """Return the near lamps of each block.

    Parameters
    ----------
    known_lamps : (block,) whether any lamp lights a point of the block; if not, no lamp is near.
    slots : (block, slot) numbers of lamps; all slots are equally likely.
    chance : (block, lamp) share of the slots that a lamp has.
    """
    blocks, count = chance.shape
    order = np.argsort(-chance, axis=1, kind="stable")[:, :MOST_NEAR]
    least = max(SEEN / slots.shape[1], LEAST_SHARE)
    length = (np.take_along_axis(chance, order, 1) > least).sum(1) * known_lamps
    rows = np.arange(blocks)[:, None]
    places = np.arange(order.shape[1])
    near_mask = np.zeros(chance.shape, bool)
    near_mask[rows, order] = places < length[:, None]
    lamps = np.zeros((blocks, MOST_NEAR), int)
    lamps[:, : order.shape[1]] = order
    return NearList(lamps, length, _without(slots, chance, near_mask))


def _without(slots: np.ndarray, chance: np.ndarray, near_mask: np.ndarray) -> np.ndarray:
    """Return slots (block, slot) without the lamps of `near_mask` (block, lamp). Each other lamp
    keeps at least as many slots as before. A block without other lamps does not change.
    """
    far_chance = np.where(near_mask, 0.0, chance)
    some = near_mask.any(1) & (far_chance.sum(1) > 0)
    ends = np.cumsum(far_chance[some], axis=1)
    ends /= ends[:, -1:]
    blocks = len(ends)
    places = slots.shape[1]
    # the share of every other lamp has grown beyond that of one slot, so it contains the middle of
    # at least one slot
    at = (np.arange(places) + 0.5) / places
    row = np.arange(blocks)[:, None]
    positions = np.searchsorted((ends + row).ravel(), (at + row).ravel()).reshape(blocks, places)
    out = slots.copy()
    out[some] = positions - row * chance.shape[1]
    return out


class NearLamps:
    """Device lists of the near lamps of all groups."""

    def __init__(
        self, lists: list[NearList | None], members: Sequence[list[Any]], blocks: int
    ) -> None:
        """Copy the lists to the device.

        Parameters
        ----------
        lists : list of each group; None for a group without lamps.
        members : numbers of the lamps of each group.
        blocks : number of blocks.
        """
        self.lamps = []
        self.lengths = []
        for list_lengths, mine in zip(lists, map(np.asarray, members), strict=True):
            lamps, length = (np.zeros(1), np.zeros(1)) if list_lengths is None else list_lengths[:2]
            if list_lengths is not None:
                lamps = mine[lamps]
            self.lamps.append(mi.UInt32(aligned(lamps, np.uint32)))
            self.lengths.append(mi.UInt32(aligned(length, np.uint32)))
        self.most = dr.opaque(mi.UInt32, MOST_NEAR)
        self.blocks = dr.opaque(mi.UInt32, blocks)
        dr.eval(*self.lamps, *self.lengths)

    def length(self, g: int, block: Any, active: Any) -> Any:
        """Return the number of near lamps of group number `g` at a block.

        Parameters
        ----------
        g : number of the light group.
        block : number of the block of the picture.
        active : lanes that take part.
        """
        return dr.gather(mi.UInt32, self.lengths[g], block, active)

    def lamp(self, g: int, block: Any, turn: Any, active: Any) -> Any:
        """Return the number of near lamp `turn` of group number `g` at a block.

        Parameters
        ----------
        g : number of the light group.
        block : number of the block of the picture.
        turn : which of the near lamps.
        active : lanes that take part.
        """
        return dr.gather(mi.UInt32, self.lamps[g], block * self.most + turn, active)

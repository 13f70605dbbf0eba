"""Masks in the form of COCO files: lengths of runs down the columns, written as text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# a character holds 5 bits of a number, a bit that says whether more follow, and starts at "0";
# SIGN is the sign bit of the last group
BITS = 5
CONTINUES = 0x20
SIGN = 0x10
FIRST = 48


def lengths(window: np.ndarray, left: int, top: int, shape: tuple[int, int]) -> list[int]:
    """Return the lengths of the runs of a mask: outside, inside, outside, ... Runs go down each
    column, from the left column to the right one.

    Parameters
    ----------
    window : (height, width) bool, a part of the mask that holds all of its pixels.
    left, top : column and row of the window's first pixel.
    shape : rows and columns of the whole mask.
    """
    across, down = np.nonzero(window.T)
    places = (across + left) * shape[0] + down + top
    steps = np.diff(places, prepend=-2)
    first = places[steps > 1]
    last = places[np.append(steps[1:] > 1, True)[: places.size]] + 1
    borders = np.concatenate([[0], np.stack([first, last], 1).ravel(), [shape[0] * shape[1]]])
    counts: list[int] = np.diff(borders).tolist()
    return counts if counts[-1] else counts[:-1]


def text(counts: Sequence[int]) -> str:
    """Return lengths of runs as COCO's text. From the fourth on, each length is written as the
    difference from the length two places earlier. Numbers are in groups of 5 bits, lowest first.
    """
    characters = []
    for place, count in enumerate(counts):
        value = count - counts[place - 2] if place > 2 else count
        while True:
            low = value & 0x1F
            value >>= BITS
            ends = value == (-1 if low & SIGN else 0)
            characters.append(chr(FIRST + (low if ends else low | CONTINUES)))
            if ends:
                break
    return "".join(characters)

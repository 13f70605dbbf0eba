"""Pixel pairs: choice of the pairs of pixels for contrast detection.

Pairs depend only on the reference picture and its labels, so that all cameras and noise
realisations of a scene are tested with the same contrasts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.data.derived_once import once

from ..regions import Region, regions_of

if TYPE_CHECKING:
    import xarray as xr

PAIRS = 4000  # number of pairs drawn per object; the median is then known to about 0.01
FRAME_PIXELS = 4000  # number of pixels drawn for the score of the frame, for the same reason
# number of pairs computed together, so that intermediate results stay in the processor's cache
PIECE = 8192
AT_ONCE = 2 * PAIRS  # number of pairs of an object drawn together; most objects need one such draw


class Pairs(NamedTuple):
    """Pairs of pixels of a region with contrast in the reference picture. Pixels are indices into
    the flattened picture.
    """

    first: np.ndarray
    second: np.ndarray
    bright: np.ndarray  # the pixel that is brighter in the reference picture
    dark: np.ndarray  # the other pixel
    contrast: np.ndarray  # Michelson contrast in the reference picture

    def some(self, at: np.ndarray) -> Pairs:
        """Return some of the pairs."""
        return Pairs(*(values[at] for values in self))


def joined(parts: list[Pairs]) -> Pairs:
    """Return all pairs, joined one list after the other."""
    return Pairs(*(np.concatenate(values) for values in zip(*parts)))


class RegionPairs(NamedTuple):
    """The pairs of one region. The median of a region is over its members. A member of an object is
    a pair; a member of the frame is a pixel with all its pairs.
    """

    name: str  # "" for the frame
    pairs: Pairs
    pixels: int  # number of pixels of the region; for the frame, only pixels with contrast
    member: np.ndarray | None  # (pair,) number of its member; None: each pair is a member

    def of_members(self, values: np.ndarray) -> np.ndarray:
        """Return the value of each member: the mean of the values of its pairs."""
        if self.member is None:
            return values
        return np.bincount(self.member, values) / np.bincount(self.member)

    def of_pairs(self, values: np.ndarray) -> np.ndarray:
        """Return the value of each pair's member."""
        return values if self.member is None else values[self.member]


@dataclass(frozen=True)
class PairChoice:
    """Rules for the choice of pairs of pixels."""

    lowest_contrast: float  # smallest Michelson contrast in the reference picture
    reach: int  # largest distance of the two pixels, in pixels

    def of_regions(self, true: np.ndarray, labels: xr.Dataset | None) -> list[RegionPairs]:
        """Return the pairs of the frame, then those of each object.

        Parameters
        ----------
        true : (y, x), luminance of the reference picture, cd/m2.
        labels : labels on its grid, or None.
        """
        frame, *objects = regions_of(true.shape, labels)
        out = [self.of_frame(true)]
        for region in objects:
            drawn = once(
                ("pairs", self.reach, region.name),
                (labels,),
                lambda r=region: draw_pairs_of(r, self.reach),
            )
            places = (np.ravel_multi_index(at, true.shape) for at in drawn)
            pairs, _ = self._with_contrast(true, *places)
            out.append(RegionPairs(region.name, pairs, int(region.mask.sum()), None))
        return out

    def of_frame(self, true: np.ndarray) -> RegionPairs:
        """Return the pairs of some pixels with contrast, each with the pixels `reach` away.

        Parameters
        ----------
        true : (y, x), luminance of the reference picture, cd/m2.
        """
        height, width = true.shape
        r = self.reach
        steps = [(dy, dx) for dy in (-r, 0, r) for dx in (-r, 0, r) if dy or dx]
        has_contrast = np.zeros(height * width, bool)
        for dy, dx in steps[4:]:  # the first four are the opposites, with the same pairs of pixels
            firsts = self._pixels_with_contrast(true, dy, dx)
            has_contrast[firsts] = has_contrast[firsts + dy * width + dx] = True
        pixels = np.flatnonzero(has_contrast)
        # the seed is fixed, so that the same picture has the same score
        chosen = pixels
        if pixels.size > FRAME_PIXELS:
            chosen = np.random.default_rng(0).choice(pixels, FRAME_PIXELS, replace=False)
        row, column = np.divmod(chosen, width)
        places = []
        counted = []
        for dy, dx in steps:
            inside = (0 <= row + dy) & (row + dy < height)
            inside &= (0 <= column + dx) & (column + dx < width)
            place = np.flatnonzero(inside)
            first = chosen[place]
            pairs, counts = self._with_contrast(true, first, first + dy * width + dx)
            places.append(place[counts])
            counted.append(pairs)
        # pixels without a pair that counts are no members
        _, member = np.unique(np.concatenate(places), return_inverse=True)
        return RegionPairs("", joined(counted), pixels.size, member)

    def at_offset(self, true: np.ndarray, dy: int, dx: int) -> Iterator[Pairs]:
        """Yield, in pieces, all pairs of pixels that are `dy` rows and `dx` columns apart and have
        enough contrast.

        Parameters
        ----------
        true : (y, x), luminance of the reference picture, cd/m2.
        dy, dx : rows and columns from the first pixel to the second; `dy` is at least 0.
        """
        width = true.shape[1]
        firsts = self._pixels_with_contrast(true, dy, dx)
        for start in range(0, firsts.size, PIECE):
            first = firsts[start : start + PIECE]
            yield self._with_contrast(true, first, first + dy * width + dx)[0]

    def _pixels_with_contrast(self, true: np.ndarray, dy: int, dx: int) -> np.ndarray:
        """Return the pixels, as indices into the flattened picture, with at least about the lowest
        contrast to the pixel `dy` rows and `dx` columns away.
        """
        height, width = true.shape
        left = max(-dx, 0)
        across = max(width - abs(dx), 0)
        rows = max(PIECE // width, 1)
        # a slightly lower limit, because of rounding; `_with_contrast` makes the final decision
        least = self.lowest_contrast * (1 - 1e-9)
        pixels = [np.zeros(0, int)]
        for top in range(0, height - dy, rows):
            a = true[top : min(top + rows, height - dy), left : left + across]
            b = true[top + dy : top + dy + len(a), left + dx : left + dx + across]
            row, column = np.nonzero(np.abs(a - b) > least * (a + b))
            pixels.append((top + row) * width + left + column)
        return np.concatenate(pixels)

    def _with_contrast(
        self, true: np.ndarray, first: np.ndarray, second: np.ndarray
    ) -> tuple[Pairs, np.ndarray]:
        """Return the pairs with contrast, and their positions in `first` and `second`.

        Parameters
        ----------
        true : (y, x) luminance of the reference picture, cd/m2.
        first, second : pixels of each pair, as indices into the flattened picture.
        """
        true = true.ravel()
        a = true[first]
        b = true[second]
        sums = a + b
        contrast = np.abs(a - b) / np.where(sums > 0, sums, 1.0)
        counts = np.flatnonzero((contrast > self.lowest_contrast) & (sums > 0))
        first = first[counts]
        second = second[counts]
        swap = a[counts] < b[counts]
        bright = np.where(swap, second, first)
        dark = np.where(swap, first, second)
        return Pairs(first, second, bright, dark, contrast[counts]), counts


def draw_pairs(
    mask: np.ndarray, reach: int
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Draw pairs of a pixel of `mask` and a pixel outside it, at most `reach` pixels away.

    Parameters
    ----------
    mask : (y, x) bool.
    reach : largest distance, pixels.

    Returns
    -------
    Rows and columns of the first pixels, and of the second pixels.
    """
    rows, columns = np.nonzero(mask)
    window = tuple(slice(i.min(), i.max() + 1) for i in (rows, columns))
    return draw_pairs_of(Region("", window, mask[window], mask.shape), reach)


def draw_pairs_of(
    region: Region, reach: int
) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return `draw_pairs` for a region (`regions.Region`)."""
    from scipy.ndimage import distance_transform_edt

    # The window has one more pixel on each side, except at the border of the frame. Pixels at the
    # border of the frame are therefore not treated as the edge of the object.
    window = tuple(
        slice(max(cut.start - 1, 0), min(cut.stop + 1, size))
        for cut, size in zip(region.window, region.shape, strict=True)
    )
    start = np.array([cut.start for cut in window])
    mask = np.zeros([cut.stop - cut.start for cut in window], bool)
    mask[tuple(slice(c.start - b, c.stop - b) for c, b in zip(region.window, start))] = region.mask
    rows, columns = np.nonzero((distance_transform_edt(mask) <= reach) & mask)
    if region.mask.size == np.prod(region.shape) and region.mask.all() or not len(rows):
        none = np.zeros(0, int)  # an object that fills the frame has no pixels outside it
        return (none, none), (none, none)
    # the seed is fixed, so that the same picture has the same score
    rng = np.random.default_rng(0)
    first = rng.integers(len(rows), size=8 * PAIRS)
    down, across = _offsets(reach)
    step = rng.integers(len(down), size=8 * PAIRS)
    # pixels of the frame outside the region, in the window and `reach` pixels around it
    outside = np.pad(~mask, reach, constant_values=True)
    for axis, (begin, size) in enumerate(zip(start, region.shape, strict=True)):
        lines = np.moveaxis(outside, axis, 0)
        lines[: max(reach - begin, 0)] = False
        lines[size - begin + reach :] = False
    places = []
    found = 0
    for begin in range(0, 8 * PAIRS, AT_ONCE):
        some = slice(begin, begin + AT_ONCE)
        row = rows[first[some]]
        column = columns[first[some]]
        row_of_other = row + down[step[some]]
        column_of_other = column + across[step[some]]
        counts = outside[row_of_other + reach, column_of_other + reach]
        places.append(np.stack([row, column, row_of_other, column_of_other])[:, counts])
        found += places[-1].shape[1]
        if found >= PAIRS:
            break
    row, column, row_of_other, column_of_other = np.concatenate(places, axis=1)[:, :PAIRS]
    return (
        (row + start[0], column + start[1]),
        (row_of_other + start[0], column_of_other + start[1]),
    )


@cache
def _offsets(reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps (rows, columns) to all pixels at most `reach` away."""
    at = np.argwhere(np.hypot(*np.indices((2 * reach + 1,) * 2) - reach) <= reach) - reach
    return at[:, 0].copy(), at[:, 1].copy()

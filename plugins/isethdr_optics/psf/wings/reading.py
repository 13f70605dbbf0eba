"""Reading: the mean over a band, from tile means of a pattern at scaled positions."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .tile_means import blocks, tile_means

if TYPE_CHECKING:
    from ..kernels import BandPlan
    from .patterns import Lattice

# number of wavelengths, in each of the two estimates, for every tile that light moves in the band
READS = 1.0
# size of a block of tiles that is read at once
ROWS = 32
COLUMNS = 240
# least and largest number of wavelengths in each estimate
LEAST_READS = 12
MOST_READS = 256


def reads_of(plan: BandPlan, centre: float, width: float) -> float:
    """Return an estimate of the number of reads of a band: its tiles times the wavelengths at which
    each is read, in both estimates together.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    centre : centre of the band, nm.
    width : width of the band, nm.
    """
    moved = np.hypot(*plan.reach) * width / centre
    count = np.clip(0.6 * READS * moved, LEAST_READS, MOST_READS)
    return float(2 * count * np.prod([2.0 * r + 1 for r in plan.reach]))


class Pattern(NamedTuple):
    """The pattern of a part of a band, and how it is read."""

    # lattices and their weights; the weighted sum is the pattern at `middle_nm`
    lattices: list[tuple[Lattice, float]]
    middle_nm: float
    span_nm: float  # width of the part
    often: float  # factor on the usual number of wavelengths
    weight: float  # weight of the part in the band


def read(
    out: np.ndarray,
    half: int,
    pattern: Pattern,
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
    grid: int,
) -> None:
    """Add the weighted mean over a part of a band to `out`.

    Parameters
    ----------
    out : (y, x) array; its first row is the first row of the kernel.
    half : 0 or 1, index of the estimate: every second wavelength is read, starting with this one.
    pattern : pattern of the part of the band.
    pitch_um : (y, x) pitch of the tiles, um.
    reach : (y, x) tiles from the axis to the border.
    grid : grid positions per tile.

    Notes
    -----
    Blocks of tiles fit the processor's cache. The outermost tile of a block determines the number
    of wavelengths at which the block is read.
    """
    pattern_half, middle, span, often, weight = pattern
    draw = 1 / (1 - span / 2 / middle)
    border = [int(np.ceil(r * draw * grid)) + 1 for r in reach]
    last = int(np.ceil((out.shape[0] - 1 - reach[0]) * draw * grid)) + 1
    means = tile_means(
        pattern_half,
        middle,
        pitch_um,
        grid,
        np.arange(-border[0], last + 1),
        np.arange(-border[1], border[1] + 1),
    )
    for y in blocks(out.shape[0], ROWS):
        for x in blocks(out.shape[1], COLUMNS):
            offsets = [np.arange(b.start, b.stop) - r for b, r in zip((y, x), reach)]
            # tiles by which the outermost light moves within the whole band
            moved = np.hypot(*(np.abs(a).max() for a in offsets)) * span / weight / middle
            count = max(
                2, int(np.ceil(often * np.clip(np.ceil(READS * moved), LEAST_READS, MOST_READS)))
            )
            scales = middle / (
                middle + ((np.arange(half, 2 * count, 2) + 0.5) / (2 * count) - 0.5) * span
            )
            columns = slice(
                *(int(np.rint(e * grid * s)) + border[1] for e, s in _outermost(offsets[1], scales))
            )
            total = np.zeros((len(offsets[0]), len(offsets[1])), np.float32)
            for scale in scales:
                rows, cols = (np.rint(a * (scale * grid)).astype(np.intp) for a in offsets)
                part = means[rows + border[0], columns].take(cols + (border[1] - columns.start), 1)
                part *= np.float32(weight / count * scale**2)
                total += part
            out[y, x] += total


def _outermost(
    offsets: np.ndarray, scales: np.ndarray
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return (position, scale) of the first column that is read, and of the column after the last.

    Parameters
    ----------
    offsets : distances of the tiles of a block from the axis, in tiles.
    scales : scales of the wavelengths that are read.
    """
    low = float(offsets[0])
    high = float(offsets[-1])
    return (low, scales.max() if low < 0 else scales.min()), (
        high + 1,
        scales.max() if high + 1 > 0 else scales.min(),
    )

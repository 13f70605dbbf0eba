"""Exact tiles: the light from one tile to the tiles around it, at any wavelength, from one sampled
pattern.

The pattern of a pupil without phase only scales with wavelength: P(x; w) = u^2 P(u x; w0), u =
w0 / w. It is sampled at a third of wavelength x f-number. Weights on these samples integrate it
exactly over tiles that are u times as wide (`tile_weights`). The weights end a few samples beyond a
tile, so that a block of tiles along one axis is a small dense matrix product.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from .half_plane_pattern import STRIPS, HalfPattern, half_lattice
from .tile_weights import STEP, SUPPORT, TileWeights, tile_weights

if TYPE_CHECKING:
    from .half_plane_pattern import HalfLattice

# number of tiles of a block along an axis: small enough to skip most zeros of the weights, large
# enough for a fast matrix product
BLOCK = 16
# period of the field, in reaches: light from beyond it stays below 1e-3 of the light at the border
PERIOD = 4.0


def exact_lattice(
    pitch_um: tuple[float, float], reach: tuple[int, int], blur_um: float, strips: float = STRIPS
) -> HalfLattice:
    """Return the `half_plane_pattern.HalfLattice` from which tiles can be integrated.

    Parameters
    ----------
    pitch_um : (y, x) pitch of the tiles, um.
    reach : (y, x) tiles from the axis to the border.
    blur_um : wavelength x f-number at the pattern's wavelength, um.
    strips : strips per row of cells of the pupil, as in `half_plane_pattern.HalfLattice`.
    """
    step = STEP * blur_um
    extent = [(r + 1.5) * p + (SUPPORT + 2) * step for r, p in zip(reach, pitch_um)]
    return half_lattice(extent, step, PERIOD, strips)


class ExactTiles:
    """Integrals of a pattern over tiles.

    Parameters
    ----------
    pattern : pattern on an `exact_lattice` for these tiles, at a wavelength that is not longer than
        any for which tiles are integrated.
    pitch_um : (y, x) pitch of the tiles, um.
    reach : (y, x) tiles from the axis to the border.
    """

    def __init__(
        self, pattern: HalfPattern, pitch_um: tuple[float, float], reach: tuple[int, int]
    ) -> None:
        self._pitch = pitch_um
        self._reach = reach
        self._wave = pattern.wavelength_nm
        self._step = pattern.step_um
        # tiles near the axis need samples on its other side, which are the mirror image
        self._before = min(len(pattern.density) - 1, 2 + SUPPORT + int(pitch_um[1] / self._step))
        before = pattern.density[self._before : 0 : -1, ::-1]
        self._density = np.concatenate([before, pattern.density])
        self._middle = pattern.middle

    def at(self, wavelength_nm: float) -> np.ndarray:
        """Return the light on tiles at one wavelength, nm, (y = 0 .. reach, x = -reach .. reach)
        float32, as fractions of the pupil's energy.
        """
        rows, columns = self._reach
        tall, wide = (p * self._wave / wavelength_nm / self._step for p in self._pitch)
        across = tile_weights(np.arange(columns + 1) * wide, wide)
        down = tile_weights(np.arange(-rows, rows + 1) * tall, tall)
        lines = np.empty((columns + 1, self._density.shape[1]), np.float32)
        for tiles, samples, weight in _blocks(across, self._before, len(self._density)):
            np.matmul(weight, self._density[samples], out=lines[tiles])
        right = np.empty((columns + 1, 2 * rows + 1), np.float32)
        for tiles, samples, weight in _blocks(down, self._middle, lines.shape[1]):
            right[:, tiles] = lines[:, samples] @ weight.T
        right *= np.float32(self._step**2)
        out = np.empty((rows + 1, 2 * columns + 1), np.float32)
        out[:, columns:] = right[:, rows:].T
        out[:, : columns + 1] = right[::-1, rows::-1].T
        return out


def _blocks(weights: TileWeights, middle: int, count: int) -> Iterator:
    """Yield (slice of tiles, slice of samples, weights (tile, sample)) of blocks of neighbouring
    tiles.

    Parameters
    ----------
    weights : weights of all tiles.
    middle : index of the sample on the axis.
    count : number of samples.
    """
    first = weights.first + middle
    taps = np.arange(weights.weight.shape[1])
    for start in range(0, len(first), BLOCK):
        stop = min(start + BLOCK, len(first))
        low = int(first[start])
        high = int(first[stop - 1]) + len(taps)
        dense = np.zeros((stop - start, high - low), np.float32)
        at = first[start:stop, None] - low + taps
        dense[np.arange(stop - start)[:, None], at] = weights.weight[start:stop]
        inside = slice(max(low, 0), min(high, count))
        yield slice(start, stop), inside, dense[:, inside.start - low : inside.stop - low]

"""Core halves: exact cores of all bands, from one pattern that is scaled to each band."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics import exact_tiles
from isethdr_core.physics.optics import half_plane_pattern as patterns

from ...pupil import pupil_size
from ..exact_core import wavelengths_of_phase
from .rings import FINE_STRIPS

if TYPE_CHECKING:
    from ..exact_core import Wavelengths
    from .frame import Frame


def exact_halves(
    frame: Frame,
    reach: tuple[int, int],
    apply: Callable = map,
    strips: float = FINE_STRIPS,
) -> np.ndarray:
    """Return one half of every exact core, (band, y = 0 .. reach, x = -reach .. reach), integrated
    exactly over tiles and averaged over wavelengths of each band.

    The pattern is sampled once, so finely that the samples hold all of it. The weights of the
    samples are scaled to each wavelength.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    reach : (y, x) tiles from the axis to the border of the core.
    apply : `map`, or the `map` of a pool of threads.
    strips : strips per row of pupil cells.
    """
    blur = frame.blur_um
    lattice = exact_tiles.exact_lattice(frame.pitch_um, reach, blur, strips)
    wave = frame.scaled_nm
    pattern = patterns.half_pattern(frame.pupil(frame.shortest_nm), wave, lattice, apply)
    tiles = exact_tiles.ExactTiles(pattern, frame.pitch_um, reach)

    def one(band_nm: np.ndarray) -> np.ndarray:
        return sum(
            np.float32(share) * tiles.at(pupil_size.scaled_nm(frame.lens, w))
            for w, share in zip(*_wavelengths(frame, band_nm, reach))
        )

    return np.stack(list(apply(one, frame.edges_nm)))


def exact_sums(frame: Frame, reach: tuple[int, int]) -> float:
    """Return the number of multiplications that `exact_halves` takes.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    reach : (y, x) tiles from the axis to the border of the exact core.
    """
    wave = frame.shortest_nm
    step = exact_tiles.STEP * pupil_size.blur_um(frame.lens, wave)
    rows, columns = ((2 * r + 3) * p / step for r, p in zip(reach, frame.pitch_um))
    tall, wide = (
        (exact_tiles.BLOCK + 2) * p / step + 2 * exact_tiles.SUPPORT for p in frame.pitch_um
    )
    waves = core_wavelengths(frame, reach)
    return waves * (reach[1] + 1.0) * (wide * rows + (2 * reach[0] + 1) * tall)


def core_wavelengths(frame: Frame, reach: tuple[int, int]) -> int:
    """Return the number of wavelengths of the exact cores, summed over all bands.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    reach : (y, x) tiles from the axis to the border of the exact core.
    """
    return sum(len(_wavelengths(frame, band, reach).nm) for band in frame.edges_nm)


def _wavelengths(frame: Frame, band_nm: np.ndarray, reach: tuple[int, int]) -> Wavelengths:
    low, high = band_nm
    # the pupil of one pattern has no phase
    return wavelengths_of_phase(frame.lens, 0.0, (low, high), frame.pitch_um, reach)

"""Limits: lenses and frames that one pattern serves, and its memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...pupil import pupil_phase
from .rings import Rings, lattices, usual_rings

if TYPE_CHECKING:
    from .frame import Frame

# largest width of tiles, wavelengths x f-number: the exact core of wider tiles outgrows memory
WIDEST_TILE = 60.0
LEAST_CORE = 8  # least reach of the exact core, tiles: nearer to the axis there are too few rays
FEWEST = 2.0  # least number of samples across a tile
MOST_ACROSS = 1e5  # largest number of cells across the pupil
NARROWEST = 2e-4  # least relative width of a band: a line of 0.1 nm


def serves(frame: Frame) -> bool:
    """Return whether one pattern can give the kernels of a frame: the pupil must have no phase and
    a uniform amplitude, and the lattices must not be too large.
    """
    if pupil_phase.has_phase(frame.lens, frame.flares) or frame.lens.uneven:
        return False
    return lattices_fit(frame)


def lattices_fit(frame: Frame) -> bool:
    """Return whether the lattices of a frame are within the limits of memory and time.

    Tiles finer than the finest detail need lattices that are finer still.
    """
    if min(frame.core) < LEAST_CORE or frame.tile_width > WIDEST_TILE:
        return False
    last_lattice = lattices(frame, usual_rings(frame))[-1]
    across = last_lattice.step_um * max(last_lattice.period) / frame.blur_um
    coarse = last_lattice.step_um > min(frame.pitch_um) / FEWEST
    return frame.narrowest >= NARROWEST and across <= MOST_ACROSS and not coarse


def memory_bytes(frame: Frame, read: Rings | None = None) -> float:
    """Return the peak memory, bytes, of the kernels of a frame and the largest lattice.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    read : sampling of the rings; None: the usual one.
    """
    rows, columns = frame.reach
    read = read or usual_rings(frame)
    kernel_bytes = 4.0 * len(frame.edges_nm) * (rows + 1) * (2.0 * columns + 1)
    return kernel_bytes + max(lattice_of_level.bytes for lattice_of_level in lattices(frame, read))

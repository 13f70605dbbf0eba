"""Limits: which lenses and frames one pattern serves, and its memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...pupil import sampled_pupil
from .rings import Rings, lattices, usual_rings

if TYPE_CHECKING:
    from .frame import Frame

WIDEST_TILE = 60.0  # wavelengths x f-number: the exact core of wider ones outgrows memory
LEAST_CORE = 8  # tiles from the axis: nearer, rays are too few
FEWEST = 2.0  # samples across a tile
MOST_ACROSS = 1e5  # cells across the pupil
NARROWEST = 2e-4  # of a band, relative: a line of 0.1 nm


def serves(frame: Frame) -> bool:
    """Return whether kernels of a frame can be made from one pattern: no phase, and lattices that
    memory and patience allow.
    """
    if sampled_pupil.has_phase(frame.lens, frame.flares) or frame.lens.uneven:
        return False
    return lattices_fit(frame)


def lattices_fit(frame: Frame) -> bool:
    """Return whether memory and patience allow the lattices of a frame.

    Tiles finer than the finest detail need lattices finer than theirs.
    """
    if min(frame.core) < LEAST_CORE or frame.tile_width > WIDEST_TILE:
        return False
    last_lattice = lattices(frame, usual_rings(frame))[-1]
    across = last_lattice.step_um * max(last_lattice.period) / frame.blur_um
    coarse = last_lattice.step_um > min(frame.pitch_um) / FEWEST
    return frame.narrowest >= NARROWEST and across <= MOST_ACROSS and not coarse


def memory_bytes(frame: Frame, read: Rings | None = None) -> float:
    """Return the peak memory, bytes: kernels of a frame, and the largest lattice.

    `read` : how finely rings are read; None: as usual.
    """
    rows, columns = frame.reach
    read = read or usual_rings(frame)
    kernel_bytes = 4.0 * len(frame.edges_nm) * (rows + 1) * (2.0 * columns + 1)
    return kernel_bytes + max(lattice_of_level.bytes for lattice_of_level in lattices(frame, read))

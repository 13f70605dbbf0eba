"""Core size: reach of the exact core of a kernel, and the fine tiles of a kernel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...pupil import pupil_size
from ..wings import Grid

if TYPE_CHECKING:
    from ...abilities import PupilOptics
    from ..kernel_request import KernelRequest

CORE_SAMPLES = 240  # number of image samples from the axis to the border of the exact core
# largest number of tiles of an exact core that covers a frame of tiles finer than its samples: one
# second per wavelength
CORE_TILES = 1e6
MOST_TILES = 4e6  # largest number of fine tiles of a kernel with divided tiles


def core_half(
    lens: PupilOptics, shortest_nm: float, pitch_um: Sequence[float], reach: Sequence[int]
) -> tuple[int, int]:
    """Return the (y, x) tiles from the axis to the border of the exact core, `reach` at most.

    Samples are at most half as wide as the finest detail, wavelength x f-number. Tiles may be finer
    still (slow lenses, small pixels). If the frame is then not wider than a core of `CORE_SAMPLES`
    samples, the core covers the whole frame, up to `CORE_TILES`.

    Parameters
    ----------
    lens : a lens of this package.
    shortest_nm : shortest wavelength of the band, nm.
    pitch_um : (y, x) pitch of the tiles, um.
    reach : (y, x) tiles from the axis to the border of the kernel.
    """
    blur = pupil_size.blur_um(lens, shortest_nm)
    half = [
        min(r, max(3, int(CORE_SAMPLES / np.ceil(2 * p / blur)))) for r, p in zip(reach, pitch_um)
    ]
    within = all(
        2 * p * max(r, CORE_SAMPLES) <= CORE_SAMPLES * blur for r, p in zip(reach, pitch_um)
    )
    if within and np.prod([2.0 * r + 1 for r in reach]) <= CORE_TILES:
        half = reach
    return tuple(half)


def without_lattices(request: KernelRequest, shortest_nm: float) -> bool:
    """Return whether the exact core of a band that starts at `shortest_nm` covers its kernel."""
    _, fine, wide = fine_tiles(request, shortest_nm)
    return core_half(request.lens, shortest_nm, fine, wide) == tuple(wide)


def fine_tiles(request: KernelRequest, shortest_nm: float) -> Grid:
    """Return the tiles on which the kernel of a band that starts at `shortest_nm` is computed.

    If the frame's tiles are much wider than the finest detail, they are divided into parts.
    """
    split = _split(request, shortest_nm)
    return Grid(
        split,
        [p / split for p in request.pitch_um],
        [r * split + split - 1 for r in request.reach],
    )


def _split(request: KernelRequest, shortest_nm: float) -> int:
    """Return the number of parts, per axis, into which tiles are divided that are much wider than
    the core of the point spread function.
    """
    if shortest_nm <= 0:
        return 1
    blur = pupil_size.blur_um(request.lens, shortest_nm)
    parts = np.ceil(max(request.pitch_um) / (8 * blur))
    tiles = np.prod([2 * r + 1 for r in request.reach])
    return int(max(1, min(parts, np.sqrt(MOST_TILES / tiles))))

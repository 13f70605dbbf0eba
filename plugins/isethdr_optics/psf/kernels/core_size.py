"""Core size: how far the exact core of a kernel reaches, and the tiles that kernels are made of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...pupil import sampled_pupil
from ..wings import Grid

if TYPE_CHECKING:
    from ...abilities import PupilOptics
    from ..kernel_request import KernelRequest

CORE_SAMPLES = 240  # image samples from the axis to the border of the exact core
# of an exact core that covers a frame of tiles finer than its samples: a second a wavelength
CORE_TILES = 1e6
MOST_TILES = 4e6  # of a kernel whose coarse tiles were divided


def core_half(
    lens: PupilOptics, shortest_nm: float, pitch_um: Sequence[float], reach: Sequence[int]
) -> tuple[int, int]:
    """Return the (y, x) tiles from the axis to the border of the exact core, `reach` at most.

    Samples are at most half as wide as the finest detail, wavelength x f-number. If tiles are finer
    still (slow lenses, small pixels) and the frame is not wider than such a core, the core covers
    the whole frame, up to `CORE_TILES`.

    Parameters
    ----------
    lens : a lens of this package. `shortest_nm` : wavelength. `pitch_um` : (y, x) of a tile.
    reach : (y, x) tiles of the kernel.
    """
    blur = sampled_pupil.blur_um(lens, shortest_nm)
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
    """Return the tiles of which the kernel of a band that starts at `shortest_nm` is composed.

    They are parts of the frame's tiles if these are much wider than the finest detail.
    """
    split = _split(request, shortest_nm)
    return Grid(
        split,
        [p / split for p in request.pitch_um],
        [r * split + split - 1 for r in request.reach],
    )


def _split(request: KernelRequest, shortest_nm: float) -> int:
    """Return the number of parts, per axis, into which to divide tiles that are much wider than the
    core of the point spread function.
    """
    if shortest_nm <= 0:
        return 1
    blur = sampled_pupil.blur_um(request.lens, shortest_nm)
    parts = np.ceil(max(request.pitch_um) / (8 * blur))
    tiles = np.prod([2 * r + 1 for r in request.reach])
    return int(max(1, min(parts, np.sqrt(MOST_TILES / tiles))))

"""Core reach: necessary distance from the middle to the border of the cores of field points.

Beyond their cores, all field points use the kernel of the axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..psf import kernel_sampling_error
from ..psf.kernels import core_size
from ..pupil import pupil_size, wavefronts
from .reference_bands import WIDTH_NM

if TYPE_CHECKING:
    from ..abilities import PupilOptics

# shares of the reach of the exact core that are tried as reach of the cores of field points
PARTS = (0.15, 0.25, 0.4, 0.6)
# share of the widest reach at which the outermost ring begins. This ring gives the error beyond the
# widest reach.
OUTERMOST = 0.75
# If the error at the widest reach exceeds the allowed one, a narrower reach with at most this
# multiple of it is accepted, up to twice the allowed error.
NO_BETTER = 1.25


class Reach(NamedTuple):
    """Reach of the cores of field points, and the error of the axis' kernel beyond it."""

    half: tuple[int, int]  # (y, x) tiles from the middle to the border
    unlike: np.ndarray  # (octave,) error as `kernel_sampling_error.deviation`
    error: float  # largest relative error of an octave, L1


def core_reach(
    along: Sequence[PupilOptics],
    waves: Sequence[float],
    pitch_um: tuple[float, float],
    shape: tuple[int, int],
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return (reach, least reach), each (y, x) in tiles.

    The reach is that of exact cores on the axis, or the least reach where it is larger. The least
    reach holds the geometrical blur.

    Parameters
    ----------
    along : lenses of field points from the axis to the border of the field.
    waves : reference wavelengths, nm, in rising order.
    pitch_um : (y, x) pitch of the tiles, um.
    shape : (y, x) number of tiles of the frame.
    """
    lens = along[0]
    ends = (waves[0], waves[-1])
    blur = pupil_size.blur_um(lens, waves[0] - WIDTH_NM / 2)
    slope = max(wavefronts.steepest_um(at, w) for at in along for w in ends)
    geometrical = slope / pupil_size.radius_mm(lens) * pupil_size.distance_mm(lens)
    least = [min(n - 1, max(3, int(1.5 * geometrical / p) + 3)) for n, p in zip(shape, pitch_um)]
    exact = [
        min(n - 1, int(core_size.CORE_SAMPLES / np.ceil(2 * p / blur)))
        for n, p in zip(shape, pitch_um)
    ]
    return tuple(map(max, zip(exact, least))), tuple(least)


def reach_of_cores(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]], least: tuple[int, int], allowed: float
) -> Reach:
    """Return the smallest reach of cores with an allowed error beyond it, or else the largest
    reach.

    Parameters
    ----------
    pairs : [(kernel of the axis, kernel of the outermost field point), ...] of some bands; the
        second kernel ends at the largest possible reach.
    least : (y, x) least reach of cores, in tiles.
    allowed : allowed relative error per tile, mean of an octave.
    """
    wide = [n // 2 for n in pairs[0][1].shape]
    reaches = [
        tuple(min(w, max(m, int(np.ceil(part * w)))) for w, m in zip(wide, least))
        for part in (*PARTS, 1.0)
    ]
    errors, unlike = _unlike(pairs, wide, reaches[-1])
    largest = Reach(reaches[-1], unlike, float(errors.max()))
    allowed = max(allowed, min(NO_BETTER * largest.error, 2 * allowed))
    for half in reaches[:-1]:
        errors, unlike = _unlike(pairs, wide, half)
        if errors.max() <= allowed:
            return Reach(half, unlike, float(errors.max()))
    return largest


def _unlike(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]],
    wide: Sequence[int],
    half: tuple[int, int],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the relative L1 error and the deviation, each (octave,), if the kernel of the axis
    replaces that of the outermost field point beyond `half`.
    """
    errors = []
    deviations = []
    for axis, place in pairs:
        axis = np.asarray(axis, float)[
            tuple(slice(n // 2 - w, n // 2 + w + 1) for n, w in zip(axis.shape, wide))
        ]
        # nothing is known beyond the widest core: its outermost ring represents the light there
        core = tuple(
            slice(w - min(h, int(OUTERMOST * w)), w + min(h, int(OUTERMOST * w)) + 1)
            for w, h in zip(wide, half)
        )
        wrong = place - axis * ((1 - place[core].sum(dtype=float)) / (1 - axis[core].sum()))
        wrong[core] = 0.0
        errors.append(kernel_sampling_error.by_octave(wrong, axis))
        deviations.append(kernel_sampling_error.deviation(wrong, axis))
    error = np.max(errors, axis=0)
    unlike = np.max(deviations, axis=0)
    unlike_nodes = np.flatnonzero(unlike)
    if len(unlike_nodes):
        # octaves beyond the largest reach get the value of the last octave within it
        unlike[unlike_nodes[-1] + 1 :] = unlike[unlike_nodes[-1]]
    return error, unlike

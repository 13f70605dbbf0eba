"""Core reach: how far from their middle the cores of field points have to reach.

Beyond it, all field points use the kernel of the axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..psf import kernel_sampling_error
from ..psf.kernels import core_size
from ..pupil import sampled_pupil
from .reference_bands import WIDTH_NM

if TYPE_CHECKING:
    from ..abilities import PupilOptics

PARTS = (0.15, 0.25, 0.4, 0.6)  # of the exact core, tried as reach of the cores of field points
OUTERMOST = 0.75  # of the widest core
# times the error at the widest reach: where that is more than allowed, but not twice as much, a
# narrower one is as good
NO_BETTER = 1.25


class Reach(NamedTuple):
    """Reach of the cores of field points, and what the kernel of the axis is wrong by beyond it."""

    half: tuple[int, int]  # (y, x) tiles
    unlike: np.ndarray  # per octave, `kernel_sampling_error.deviation`
    error: float  # the largest mean of an octave, relative, L1


def core_reach(
    along: Sequence[PupilOptics],
    waves: Sequence[float],
    pitch_um: tuple[float, float],
    shape: tuple[int, int],
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the (y, x) reach of exact cores on the axis, or of the geometrical blur where it is
    wider, and the least that cores may have; tiles.

    Parameters
    ----------
    along : lenses of field points from the axis to the border of the field.
    waves : wavelengths, nm, at which they are judged, rising.
    pitch_um : (y, x) of a tile.
    shape : (y, x) tiles of the frame.
    """
    lens = along[0]
    ends = (waves[0], waves[-1])
    blur = sampled_pupil.blur_um(lens, waves[0] - WIDTH_NM / 2)
    slope = max(sampled_pupil.steepest_um(at, w) for at in along for w in ends)
    geometrical = slope / sampled_pupil.radius_mm(lens) * sampled_pupil.distance_mm(lens)
    least = [min(n - 1, max(3, int(1.5 * geometrical / p) + 3)) for n, p in zip(shape, pitch_um)]
    exact = [
        min(n - 1, int(core_size.CORE_SAMPLES / np.ceil(2 * p / blur)))
        for n, p in zip(shape, pitch_um)
    ]
    return tuple(map(max, zip(exact, least))), tuple(least)


def reach_of_cores(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]], least: tuple[int, int], allowed: float
) -> Reach:
    """Return the smallest reach of cores whose error beyond it is allowed, or else the largest one.

    Parameters
    ----------
    pairs : [(kernel of the axis, kernel of the outermost field point), ...] of some bands; the
        second kernel ends at the largest possible reach.
    least : (y, x) tiles that cores reach at least.
    allowed : relative per tile, mean of an octave.
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
    """Return the error per octave (relative, L1) and the deviation, if the kernel of the axis
    replaces that of the outermost field point beyond `half`.
    """
    errors = []
    deviations = []
    for axis, place in pairs:
        axis = np.asarray(axis, float)[
            tuple(slice(n // 2 - w, n // 2 + w + 1) for n, w in zip(axis.shape, wide))
        ]
        # with the widest core kept, its outermost ring speaks for what lies beyond it
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
        # beyond the largest reach, the value at its border
        unlike[unlike_nodes[-1] + 1 :] = unlike[unlike_nodes[-1]]
    return error, unlike

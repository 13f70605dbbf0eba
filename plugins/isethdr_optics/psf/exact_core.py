"""Exact core: a kernel near its axis, integrated over tiles and averaged over sub-bands.

It does not depend on the method for the wings.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import is_dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.diffraction import integrated_airy, integrated_psf

from ..pupil import sampled_pupil

if TYPE_CHECKING:
    from .kernels import BandPlan

_core_cache: dict[str, np.ndarray] | None = None


@contextmanager
def kept_cores() -> Iterator[None]:
    """Cache the cores computed within this context: finer kernels have the same cores."""
    global _core_cache
    before = _core_cache
    _core_cache = {}
    try:
        yield
    finally:
        _core_cache = before


def exact_core(
    plan: BandPlan, centre_nm: float, width_nm: float, waves: np.ndarray, energy: float
) -> np.ndarray:
    """Return the (y, x) kernel of a band within `plan.half` tiles, the mean of wavelengths `waves`.

    Parameters
    ----------
    centre_nm : of the band, nm.
    width_nm : of the band, nm.
    plan : `kernels.BandPlan` of the band. `energy` : of its open pupil, mm2.
    """
    cache = _core_cache if all(map(is_dataclass, (plan.lens, *plan.flares))) else None
    if cache is None:
        return _computed(plan, waves, energy)
    key = repr(
        (
            replace(plan.lens, speckle_error=0.5),
            plan.flares,
            centre_nm,
            width_nm,
            plan.half,
            plan.pitch,
            list(waves),
        )
    )
    if key not in cache:
        cache[key] = _computed(plan, waves, energy)
    return cache[key]


def _computed(plan: BandPlan, waves: np.ndarray, energy: float) -> np.ndarray:
    axis = plan.axis
    total = 0.0
    sides = [2 * h + 1 for h in plan.half]
    if sampled_pupil.round_and_clean(plan.lens, plan.flares):
        return sum(
            integrated_airy(
                sampled_pupil.radius_mm(plan.lens), wave, plan.distance, sides, plan.pitch, boxes=2
            )
            for wave in waves
        ) / len(waves)
    cells = (
        sampled_pupil.amplitude(plan.lens, plan.flares, axis, axis, plan.shortest)
        if plan.fixed
        else None
    )
    for wave in waves:
        own = (
            cells
            if plan.fixed
            else sampled_pupil.amplitude(plan.lens, plan.flares, axis, axis, wave)
        )
        pupil = sampled_pupil.resolved(plan.lens, plan.flares, axis, axis, wave, own)
        step = axis[1] - axis[0]
        scaled_nm = sampled_pupil.scaled_nm(plan.lens, wave)
        total = total + integrated_psf(
            pupil,
            scaled_nm,
            (step, step),
            plan.distance,
            sides,
            plan.pitch,
            energy,
            cell_means=True,
            boxes=2,
        )
    return total / len(waves)

"""Interpolation wavelengths (knots): patterns of a pupil with phase are computed at a few
wavelengths for all bands. Between them patterns are interpolated linearly.

Scaled to the same size, patterns of neighbouring wavelengths differ only by the change of phase.
The error of linear interpolation is proportional to the square of that change. Light in the wings
comes from the rim and from dirt, so that the largest change anywhere in the stop matters. The
wavelengths are fixed: a band does not depend on which other bands a run has.
"""

from __future__ import annotations

from collections import OrderedDict
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.zernike import largest_um

from ..pupil import pupil_shapes, wavefronts
from . import wings

if TYPE_CHECKING:
    from .kernels import BandPlan
    from .wings import Lattice

STEPS_NM = (80.0, 40.0, 20.0)  # distances of knots, tried in this order
APART = 0.35  # largest change of phase from knot to knot anywhere in the stop, radians
# Relative error per tile (L1) of linear interpolation if the phase changes by 1 rad. This is an
# estimate: the difference between any two lattices (0.9 % clean, 0.12 % dirty) hides most of it.
STRAIGHT = 0.05
# least number of bands in a step for which knots are used: a step needs two lattices, a band one
WORTH = 2.0
# memory of the lattices that are kept; the two pairs that a band reads are kept in any case
HELD_BYTES = 1.6e9


class Knots:
    """Lattices of one lens at fixed wavelengths. They are computed at first use; those used last
    are kept.
    """

    def __init__(self) -> None:
        self._patterns: OrderedDict[tuple, tuple] = OrderedDict()
        self._lock = Lock()

    def around(
        self,
        plan: BandPlan,
        reach: tuple[int, int],
        middle: float,
        span: float,
        energy: float,
        fine: float,
    ) -> list[list]:
        """Return the pattern at wavelength `middle`: [(lattice, share), ...] for each of the two
        independent estimates.

        Parameters
        ----------
        plan : `kernels.BandPlan` of the band.
        reach : (y, x) parts of tiles from the axis to the border, as in `wings.Grid`.
        middle : wavelength, nm.
        span : width of the part of the band that is read from the pattern, nm.
        energy : energy of the open pupil, mm2.
        fine : factor on the usual number of samples.
        """
        low, step = _cell(plan, middle, span)
        if not step:
            return [
                [(pattern, 1.0)]
                for pattern in wings.own(
                    plan, reach, middle, 1 / (1 - span / 2 / middle), energy, fine
                )
            ]
        share = (middle - low) / step
        ends = [
            (w, s, self._pair(plan, tuple(reach), w, w / (w - step - span / 2), energy, fine))
            for w, s in ((low, 1 - share), (low + step, share))
            if s
        ]
        return [[(pair[half], s) for _, s, pair in ends] for half in (0, 1)]

    def _pair(
        self,
        plan: BandPlan,
        reach: tuple[int, int],
        wave: float,
        stretch: float,
        energy: float,
        fine: float,
    ) -> list[Lattice]:
        # the extent does not depend on the number of parts into which a band divides tiles
        extent = tuple(round((r + 1) * p, 6) for r, p in zip(reach, plan.pitch))
        key = wave, extent, stretch, fine
        with self._lock:
            lock = self._patterns.setdefault(key, (Lock(), []))
            self._patterns.move_to_end(key)
            while (
                len(self._patterns) > 2
                and sum(
                    pattern.values.nbytes for _, pair in self._patterns.values() for pattern in pair
                )
                > HELD_BYTES
            ):
                self._patterns.popitem(last=False)
        with lock[0]:
            if not lock[1]:
                lock[1].extend(wings.own(plan, reach, wave, stretch, energy, fine))
        return lock[1]


def lattices_of(
    plan: BandPlan, centre: float, width: float, parts: int
) -> list[tuple[float, float]]:
    """Return [(wavelength in nm, stretch), ...] of the pairs of lattices that the parts of a band
    read.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    centre : centre of the band, nm.
    width : width of the band, nm.
    parts : number of parts of about the same phase into which the band is divided.
    """
    span = width / parts
    out = []
    for part in range(parts):
        middle = centre + ((part + 0.5) / parts - 0.5) * width
        low, step = _cell(plan, middle, span)
        if step:
            ends = (low, low + step)
            out += [(float(w), float(w / (w - step - span / 2))) for w in ends]
        else:
            out.append((float(middle), float(1 / (1 - span / 2 / middle))))
    return out


def error(plan: BandPlan, middle: float, span: float) -> float:
    """Return the relative error per tile of linear interpolation between the knots around a
    wavelength.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    middle : wavelength, nm.
    span : width of the part of the band around it, nm.
    """
    low, step = _cell(plan, middle, span)
    return STRAIGHT * _change(plan, low, low + step) ** 2 if step else 0.0


def _change(plan: BandPlan, first_nm: float, last_nm: float) -> float:
    """Return the largest change of phase anywhere in the stop, radians. Piston is left out; the
    delay of dirt is added in full.
    """
    first, last = (wavefronts.coefficients_um(plan.lens, w) for w in (first_nm, last_nm))
    waves = {
        j: 1e3 * (first.get(j, 0.0) / first_nm - last.get(j, 0.0) / last_nm)
        for j in {*first, *last} - {0}
    }
    delayed = max(
        (
            abs(1e3 * d * (1 / first_nm - 1 / last_nm))
            for d in pupil_shapes.delays_um(plan.lens, plan.flares)
        ),
        default=0.0,
    )
    return 2 * np.pi * (largest_um(waves) + delayed)


def _cell(plan: BandPlan, middle: float, span: float) -> tuple[float, float]:
    """Return (knot below a wavelength, step to the next knot), nm. The step is 0 where the phase
    changes too fast or is not known at the knots.
    """
    if not pupil_shapes.all_shapes(plan.flares):
        return middle, 0.0
    for step in STEPS_NM:
        if step < WORTH * span:
            break
        low = wings.REFERENCE_NM + step * ((middle - wings.REFERENCE_NM) // step)
        try:
            if _change(plan, low, low + step) <= APART:
                return low, step
        except ConfigError:
            continue
    return middle, 0.0

"""Band rings: the kernel of a band beyond its exact core. It is computed again with finer sampling
where its error is too large.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ...pupil import pupil_size
from .. import kernel_sampling_error
from .band_parts import parts_of
from .lattice_size import OWN_SAMPLES, STRETCHED, Grid, Size, most_samples, sampling
from .patterns import DEFAULT_ERROR
from .reading import Pattern, read
from .tile_means import tile_sums

if TYPE_CHECKING:
    from ...abilities import PupilOptics
    from ..kernels import BandPlan

GRID = 3  # grid positions per tile at which tile means are computed; the nearest one is read
FINER = (1, 2, 4)  # factors on the reads, tried until the error is what the lens allows
FINEST = 0.8  # largest ratio of a new lattice step to the one before that counts as finer


def rings(
    plan: BandPlan, centre: float, width: float, energy: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the kernel of a band, and half the difference of its two estimates, each (y, x).

    The difference is 0 within the core, where the kernel is replaced later. Rings with an error
    larger than the lens allows are computed again with finer sampling.

    Parameters
    ----------
    plan : lens, flares and lattices.
    centre : centre of the band, nm.
    width : width of the band, nm.
    energy : energy of the open pupil, mm2.
    """
    reach = plan.reach
    fine = FINER[0]
    kernel, wrong = ring(plan, reach, centre, width, energy, fine)
    while True:
        over = np.flatnonzero(_errors(plan, kernel, wrong) > plan.lens.speckle_error)
        if not len(over):
            return kernel, wrong
        nearer = tuple(
            min(r, max(h + 1, 2 ** (int(over[-1]) + 1) * plan.split))
            for r, h in zip(reach, plan.half)
        )
        reach, fine = nearer, _finer(plan, centre, reach, nearer, fine)
        if not fine:
            return kernel, wrong
        ring_values, off = ring(plan, reach, centre, width, energy, fine)
        middle = tuple(slice(r - n, r + n + 1) for r, n in zip(plan.reach, reach))
        if (
            _errors(plan, ring_values, off).max()
            < _errors(plan, kernel[middle], wrong[middle]).max()
        ):
            kernel[middle], wrong[middle] = ring_values, off


def ring(
    plan: BandPlan,
    reach: tuple[int, int],
    centre: float,
    width: float,
    energy: float,
    fine: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """Return a kernel as far as a ring's border, averaged over a band, and half the difference of
    its two estimates.

    The difference is 0 within the exact core.

    Parameters
    ----------
    plan : lens, flares, lattices and core.
    reach : (y, x) parts of tiles from the axis to the border of the ring.
    centre : centre of the band, nm.
    width : width of the band, nm.
    energy : energy of the open pupil, mm2.
    fine : factor on the usual number of wavelengths and of grid positions per tile.
    """
    grid = int(np.ceil(GRID * np.sqrt(fine)))
    finer = fine * error_wanted(plan.lens)
    # without phase the remaining rows are the mirror image
    rows = reach[0] + 1 if plan.lattices else 2 * reach[0] + 1
    parts = 1 if plan.lattices else parts_of(plan, centre, width)
    halves = [np.zeros((rows, 2 * reach[1] + 1), np.float32) for _ in range(2)]
    for part in range(parts):
        middle = centre + ((part + 0.5) / parts - 0.5) * width
        span = width / parts
        pair = [[(one, 1.0)] for one in plan.lattices] or plan.knots.around(
            plan, reach, middle, span, energy, finer
        )
        for half, pattern_half in enumerate(pair):
            pattern = Pattern(
                pattern_half,
                pupil_size.scaled_nm(plan.lens, middle),
                span,
                fine / parts,
                1 / parts,
            )
            read(halves[half], half, pattern, plan.pitch, reach, grid)
    both = [(halves[0] + halves[1]) / 2, (halves[0] - halves[1]) / 2]
    for k, half in enumerate(both if plan.lattices else ()):
        both[k] = np.concatenate([half, half[-2::-1, ::-1]])
        both[k][reach[0]] = (both[k][reach[0]] + both[k][reach[0], ::-1]) / 2
    kernel, wrong = both
    wrong[tuple(slice(r - h, r + h + 1) for r, h in zip(reach, plan.half))] = 0.0
    return kernel, wrong


def _errors(plan: BandPlan, kernel: np.ndarray, wrong: np.ndarray) -> np.ndarray:
    """Return the relative error of whole tiles per octave of their distance, (octave,)."""
    return kernel_sampling_error.by_octave(
        *(tile_sums(a[_whole_turns(a, plan.split)], plan.split) for a in (wrong, kernel))
    )


def _whole_turns(fine: np.ndarray, split: int) -> Any:
    """Return slices that cut a function to whole tiles, with one tile in the middle.

    Parameters
    ----------
    fine : (y, x) samples of the function.
    split : samples per tile, along each axis.
    """
    reach = [(n // 2 - (split - 1)) // split * split + split - 1 for n in fine.shape]
    return tuple(slice(n // 2 - r, n // 2 + r + 1) for n, r in zip(fine.shape, reach))


def error_wanted(lens: PupilOptics) -> float:
    """Return the factor on the samples of lattices with phase for the error that a lens allows.

    It is the root of the ratio of the errors, because the error falls faster than the number of
    samples grows.
    """
    return max(1.0, DEFAULT_ERROR / lens.speckle_error) ** 0.5


def _finer(
    plan: BandPlan, wave: float, reach: tuple[int, int], nearer: tuple[int, int], fine: float
) -> float:
    """Return the factor `fine` of the next ring.

    It is 0 where memory allows no finer lattice, because more reads alone change little.

    Parameters
    ----------
    plan : lens, flares and lattices.
    wave : wavelength, nm.
    reach : (y, x) parts of tiles from the axis to the border of the ring before.
    nearer : the same for the next ring.
    fine : factor of the ring before.
    """
    if plan.lattices:
        return next((f for f in FINER if f > fine), 0)
    finer_by = error_wanted(plan.lens)
    most = most_samples(plan.lens, wave, Grid(plan.split, plan.pitch, reach), OWN_SAMPLES)

    def step_um(reach: tuple[int, int], fine: float) -> float:
        """Return the step of the lattice of a ring."""
        grid = Grid(plan.split, plan.pitch, reach)
        return sampling(plan.lens, wave, grid, Size(most, STRETCHED, fine * finer_by))[0]

    allowed_um = FINEST * step_um(reach, fine)
    return next((f for f in FINER if step_um(nearer, f) < allowed_um), 0)

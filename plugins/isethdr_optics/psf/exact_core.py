"""Exact core: a kernel near its axis, integrated over tiles and averaged over a band.

It does not depend on the method for the wings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import is_dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.physics.diffraction import integrated_airy, integrated_psf

from ..pupil import fine_cells, pupil_cells, pupil_grid, pupil_phase, pupil_size
from . import kernel_sampling_error

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics
    from .kernels import BandPlan

# Number of Gauss-Legendre wavelengths of an exact core: `DENSE_GAUSS` for every speckle width that
# the core's corner moves within the band, plus `MORE_GAUSS`. Tiles wider than a speckle average
# over the finest rings and need fewer: `DENSE_GAUSS` is interpolated between the tile widths
# `DENSE_WIDTHS`, in wavelengths x f-number. The error is 1e-5 to 2e-4 of the light near the border;
# with the same number of midpoints of equal parts it is 2e-3 to 7e-3.
DENSE_GAUSS = (1.75, 1.0)
DENSE_WIDTHS = (0.9, 1.5)
MORE_GAUSS = 2
# Relative errors of an exact core from cells of the pupil: L1 and deviation at the border, and both
# near the axis. The period of the field folds light into the core. Averaging over cells
# suppresses this light, but not all of it: the error of a tile grows with the square of its
# distance. Against finer cells (f/2.8 to f/16, with and without a wavefront and dirt, cores of 4 to
# 80 tiles), the mean magnitude per tile was at most 4.5e-3 at the border, and
# `kernel_sampling_error.deviation` 2.4e-2, because errors of neighbours are correlated along the
# axes. Near the axis both were at most 9e-5.
CELLS_AT_BORDER = 6e-3
CELLS_DEVIATION = 2.5e-2
CELLS_NEAR = 1e-4
# Relative errors of an exact core from one pattern, at the border and near the axis. They come from
# the strips of the pupil and the wavelengths of a band; those of closed forms come from the
# wavelengths alone. Against closed forms and patterns of three times the strips, with twice the
# wavelengths (f/1.6 to f/8, bands of 10 and 50 nm, clean and up to 150 grains per mm2, cores of 16
# to 120 tiles), the mean magnitude per tile and `kernel_sampling_error.deviation` were at most 2e-4
# at the border. Two to eight tiles from the axis, where the weights of samples end next to the
# peak, they were 2e-5 and 5e-5. The error map of single tiles omits this error: the noise of that
# light is a hundred times as large, and blocks of tiles would spread the error to dark tiles.
PATTERN_ERROR = 2e-4
PATTERN_NEAR = 6e-5

_core_cache: dict[str, np.ndarray] | None = None


@contextmanager
def kept_cores() -> Iterator[None]:
    """Cache the cores that are computed within this context. Kernels that are computed again with
    finer wings have the same cores.
    """
    global _core_cache
    before = _core_cache
    _core_cache = {}
    try:
        yield
    finally:
        _core_cache = before


class Wavelengths(NamedTuple):
    """Wavelengths and weights of a quadrature over a band."""

    nm: np.ndarray  # wavelengths, nm
    weight: np.ndarray  # weights, their sum 1


def gauss_wavelengths(
    lens: PupilOptics,
    flares: Sequence[Flare],
    band_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    reach: tuple[float, float],
) -> Wavelengths:
    """Return the Gauss-Legendre wavelengths, nm, of a band for a core of `reach`.

    The pattern is a band-limited function of the wavelength; this quadrature integrates it almost
    exactly. A change of phase of 1 rad rms counts as a movement by one speckle.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    band_nm : (low, high) ends of the band, nm.
    pitch_um : (y, x) pitch of the tiles, um.
    reach : (y, x) tiles from the axis to the border of the core.
    """
    phase_rad = pupil_phase.phase_change(lens, flares, *band_nm)
    return wavelengths_of_phase(lens, phase_rad, band_nm, pitch_um, reach)


def wavelengths_of_phase(
    lens: PupilOptics,
    phase_rad: float,
    band_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    reach: tuple[float, float],
) -> Wavelengths:
    """Return the wavelengths of `gauss_wavelengths` for a known change of phase.

    Parameters
    ----------
    lens : a lens of this package.
    phase_rad : change of the pupil's phase over the band, radians rms.
    band_nm : (low, high) ends of the band, nm.
    pitch_um : (y, x) pitch of the tiles, um.
    reach : (y, x) tiles from the axis to the border of the core.
    """
    low, high = band_nm
    middle = (low + high) / 2
    width = high - low
    moved = float(np.hypot(*(r * p for r, p in zip(reach, pitch_um)))) * width / middle
    blur = pupil_size.blur_um(lens, middle)
    dense = np.interp(min(pitch_um) / blur, DENSE_WIDTHS, DENSE_GAUSS)
    count = int(np.ceil(dense * (moved / blur + phase_rad))) + MORE_GAUSS
    place, weight = _gauss_rule(count)
    return Wavelengths(middle + place * width / 2, weight / 2)


@lru_cache(maxsize=256)
def _gauss_rule(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes and weights of Gauss's rule with `count` nodes on -1 to 1."""
    return np.polynomial.legendre.leggauss(count)


def is_closed_form(lens: PupilOptics, flares: Sequence[Flare]) -> bool:
    """Return whether a closed form gives the exact core, without an error from pupil cells."""
    return pupil_phase.round_and_clean(lens, flares)


def core_error(at_border: float, tiles: np.ndarray, reach: float) -> np.ndarray:
    """Return the relative error of tiles of an exact core; it has the shape of `tiles`.

    Parameters
    ----------
    at_border : error at the border: `CELLS_AT_BORDER`, `CELLS_DEVIATION` or `PATTERN_ERROR`.
    tiles : distances of tiles from the axis, in tiles, any shape.
    reach : tiles from the axis to the border of the core.
    """
    nearest = CELLS_NEAR if at_border > PATTERN_ERROR else 0.0
    return np.maximum(nearest, at_border * np.minimum(1.0, tiles / max(reach, 1)) ** 2)


def core_error_by_octave(at_border: float, reach: float) -> np.ndarray:
    """Return `core_error` of the outermost tiles of each octave within `reach`, (octave,); it is 0
    in octaves beyond.

    Parameters
    ----------
    at_border : as in `core_error`.
    reach : tiles from the axis to the border of the core.
    """
    inner = 2.0 ** np.arange(kernel_sampling_error.OCTAVES)
    within = inner <= np.sqrt(2) * reach  # as far as the corner of the core
    error = np.maximum(core_error(at_border, 2 * inner, reach), PATTERN_NEAR)
    return np.where(within, error, 0.0)


def exact_core(
    plan: BandPlan, centre_nm: float, width_nm: float, waves: Wavelengths, energy: float
) -> np.ndarray:
    """Return the kernel (y, x) of a band within `plan.half` tiles, summed over wavelengths.

    Parameters
    ----------
    plan : `kernels.BandPlan` of the band.
    centre_nm : centre of the band, nm.
    width_nm : width of the band, nm.
    waves : wavelengths of the band and their weights.
    energy : energy of the band's open pupil, mm2.

    Raises
    ------
    ConfigError : the wavefront of a wavelength is too steep for the cells of the pupil.
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
            waves.nm.tolist(),
        )
    )
    if key not in cache:
        cache[key] = _computed(plan, waves, energy)
    return cache[key]


def _computed(plan: BandPlan, waves: Wavelengths, energy: float) -> np.ndarray:
    axis = plan.axis
    total = 0.0
    sides = [2 * h + 1 for h in plan.half]
    if is_closed_form(plan.lens, plan.flares):
        return sum(
            share
            * integrated_airy(
                pupil_size.radius_mm(plan.lens), wave, plan.distance, sides, plan.pitch, boxes=2
            )
            for wave, share in zip(*waves)
        )
    step = axis[1] - axis[0]
    # cells are chosen for the shortest wavelength; others may have a steeper wavefront
    for wave in waves.nm:
        pupil_grid.check_phase_sampling(plan.lens, step, wave)
    cells = (
        pupil_cells.amplitude(plan.lens, plan.flares, axis, axis, plan.shortest)
        if plan.fixed
        else None
    )
    for wave, share in zip(*waves):
        own = (
            cells if plan.fixed else pupil_cells.amplitude(plan.lens, plan.flares, axis, axis, wave)
        )
        pupil = fine_cells.resolved(plan.lens, plan.flares, axis, axis, wave, own)
        scaled_nm = pupil_size.scaled_nm(plan.lens, wave)
        total = total + share * integrated_psf(
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
    return total

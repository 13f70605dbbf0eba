"""Exact core: a kernel near its axis, integrated over tiles and averaged over a band.

It does not depend on the method for the wings.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import is_dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.physics.diffraction import integrated_airy, integrated_psf

from ..pupil import sampled_pupil
from . import kernel_sampling_error

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics
    from .kernels import BandPlan

# Wavelengths of an exact core, at Gauss's places in a band: so many per speckle that its corner
# moves, and two more. Tiles wider than a speckle average over the finest rings: the numbers are
# those at two widths of a tile, wavelengths x f-number. They leave 1e-5 to 2e-4 of the light near
# the border; as many midpoints of equal parts leave 2e-3 to 7e-3
DENSE_GAUSS = (1.75, 1.0)
DENSE_WIDTHS = (0.9, 1.5)
MORE_GAUSS = 2
# Cells of the pupil hold back the light that the period of the field folds into the core, but not
# all of it: the error of tiles grows with the square of their distance. Against finer cells (f/2.8
# to f/16, with and without a wavefront and dirt, cores of 4 to 80 tiles), the mean magnitude per
# tile was at most 4.5e-3 at the border, and `kernel_sampling_error.deviation` 2.4e-2: along the
# axes neighbours err alike. Near the axis both were at most 9e-5
CELLS_AT_BORDER = 6e-3
CELLS_DEVIATION = 2.5e-2
CELLS_NEAR = 1e-4
# Cores from one pattern err by the strips of the pupil and the wavelengths of a band, closed forms
# by the wavelengths alone. Against closed forms and patterns of three times the strips, with twice
# the wavelengths (f/1.6 to f/8, bands of 10 and 50 nm, clean and up to 150 grains per mm2, cores of
# 16 to 120 tiles), the mean magnitude per tile and `kernel_sampling_error.deviation` were at most
# 2e-4 at the border. Two to eight tiles from the axis, where weights end beside the peak, they were
# 2e-5 and 5e-5. Tile by tile nothing is stated there: the noise of that light is a hundred times as
# large, and blocks of tiles would spread the error to dark ones
PATTERN_ERROR = 2e-4
PATTERN_NEAR = 6e-5

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


class Wavelengths(NamedTuple):
    """Wavelengths whose weighted sum stands for a band."""

    nm: np.ndarray
    weight: np.ndarray  # sum 1


def gauss_wavelengths(
    lens: PupilOptics,
    flares: Sequence[Flare],
    band_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    reach: tuple[float, float],
) -> Wavelengths:
    """Return the Gauss-Legendre wavelengths, nm, in a band for a core of `reach`.

    The pattern is a band-limited function of the wavelength, which they integrate almost exactly. A
    radian of phase, rms, counts as a speckle.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    band_nm : (low, high). `pitch_um` : (y, x) of a tile.
    reach : (y, x) tiles from the axis to the border of the core.
    """
    phase_rad = sampled_pupil.phase_change(lens, flares, *band_nm)
    return wavelengths_of_phase(lens, phase_rad, band_nm, pitch_um, reach)


def wavelengths_of_phase(
    lens: PupilOptics,
    phase_rad: float,
    band_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    reach: tuple[float, float],
) -> Wavelengths:
    """Return the wavelengths of `gauss_wavelengths` for a pupil whose phase is known.

    Parameters
    ----------
    lens : a lens of this package.
    phase_rad : change of the pupil's phase over the band, radians rms.
    band_nm : (low, high). `pitch_um` : (y, x) of a tile.
    reach : (y, x) tiles from the axis to the border of the core.
    """
    low, high = band_nm
    middle = (low + high) / 2
    width = high - low
    moved = float(np.hypot(*(r * p for r, p in zip(reach, pitch_um)))) * width / middle
    blur = sampled_pupil.blur_um(lens, middle)
    dense = np.interp(min(pitch_um) / blur, DENSE_WIDTHS, DENSE_GAUSS)
    count = int(np.ceil(dense * (moved / blur + phase_rad))) + MORE_GAUSS
    place, weight = np.polynomial.legendre.leggauss(count)
    return Wavelengths(middle + place * width / 2, weight / 2)


def is_closed_form(lens: PupilOptics, flares: Sequence[Flare]) -> bool:
    """Return whether a closed form gives the exact core, so that no pupil cells leave an error."""
    return sampled_pupil.round_and_clean(lens, flares)


def core_error(at_border: float, tiles: np.ndarray, reach: float) -> np.ndarray:
    """Return the relative error of tiles of an exact core.

    Parameters
    ----------
    at_border : `CELLS_AT_BORDER`, `CELLS_DEVIATION` or `PATTERN_ERROR`.
    tiles : distance from the axis, any shape.
    reach : tiles from the axis to the border of the core.
    """
    nearest = CELLS_NEAR if at_border > PATTERN_ERROR else 0.0
    return np.maximum(nearest, at_border * np.minimum(1.0, tiles / max(reach, 1)) ** 2)


def core_error_by_octave(at_border: float, reach: float) -> np.ndarray:
    """Return `core_error` (octave) of the outermost tiles of each octave within `reach`; 0 farther
    out.

    Parameters
    ----------
    at_border : as of `core_error`.
    reach : tiles from the axis to the border of the core.
    """
    inner = 2.0 ** np.arange(kernel_sampling_error.OCTAVES)
    within = inner <= np.sqrt(2) * reach  # to the corner
    error = np.maximum(core_error(at_border, 2 * inner, reach), PATTERN_NEAR)
    return np.where(within, error, 0.0)


def exact_core(
    plan: BandPlan, centre_nm: float, width_nm: float, waves: Wavelengths, energy: float
) -> np.ndarray:
    """Return the (y, x) kernel of a band within `plan.half` tiles, the sum of wavelengths `waves`.

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
                sampled_pupil.radius_mm(plan.lens), wave, plan.distance, sides, plan.pitch, boxes=2
            )
            for wave, share in zip(*waves)
        )
    cells = (
        sampled_pupil.amplitude(plan.lens, plan.flares, axis, axis, plan.shortest)
        if plan.fixed
        else None
    )
    for wave, share in zip(*waves):
        own = (
            cells
            if plan.fixed
            else sampled_pupil.amplitude(plan.lens, plan.flares, axis, axis, wave)
        )
        pupil = sampled_pupil.resolved(plan.lens, plan.flares, axis, axis, wave, own)
        step = axis[1] - axis[0]
        scaled_nm = sampled_pupil.scaled_nm(plan.lens, wave)
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

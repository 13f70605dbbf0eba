"""Knots: the wavelengths of each band, and the interpolation wavelengths that give their patterns.

The wavelengths of a band are those of a Gauss-Legendre quadrature. The pattern of each is
interpolated between two knots, if the phase changes little between them; else the wavelength is its
own knot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.radiometry import band_widths_nm

from ...psf.exact_core import Wavelengths
from ...pupil import pupil_phase, pupil_shapes

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics

FIRST_NM = 380.0  # one of the knots; all others lie whole steps away
STEPS_NM = (80.0, 40.0, 20.0, 10.0, 5.0)  # distances of knots; each divides the one before
APART = 0.5  # largest change of phase from knot to knot, radians rms
# Interpolation is used if it takes at most this share of the transforms of an exact computation.
WORTH = 0.7
LINE_NM = 1.5  # largest width of a band that counts as a spectral line
FEWEST_READS = 3  # least number of wavelengths of a band
# number of wavelengths of a band in addition to one for every tile that its outermost light moves
MORE_READS = 1
MOST_READS = 32  # largest number of wavelengths of a band of any width

# change of phase between two wavelengths in nm, radians rms; None if it is not known
PhaseChange = Callable[[float, float], float] | None


class Knot(NamedTuple):
    """A wavelength at which a pattern is computed.

    Knots of one wavelength with two steps are two transforms: the pattern with the larger step
    extends farther.
    """

    wavelength_nm: float
    step_nm: float  # distance to the next knot, nm; 0: the pattern of this wavelength alone


class Reading(NamedTuple):
    """One wavelength of a band, with the knots that give its pattern."""

    wavelength_nm: float
    shares: tuple[tuple[Knot, float], ...]  # share of each knot in the kernel of the band


def readings(
    lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: np.ndarray, half: tuple[int, int]
) -> list[list[Reading]]:
    """Return the wavelengths of every band. The shares of a band sum to 1.

    Parameters
    ----------
    lens : `field_point_lens.PlaceLens`.
    flares : its flare components.
    wavelength_nm : (band,) centres of the bands, nm.
    half : (y, x) tiles from the axis to the border of the kernels.
    """
    change: PhaseChange = None
    if pupil_shapes.all_shapes(flares):
        change = cache(partial(pupil_phase.phase_change, lens, flares))
    return [
        [
            _reading(wave, weight, change)
            for wave, weight in zip(*_wavelengths(centre, width, half, change))
        ]
        for centre, width in zip(wavelength_nm, band_widths_nm(wavelength_nm))
    ]


def _knots(bands: Iterable[Sequence[Reading]]) -> set[Knot]:
    """Return the knots of bands, each one transform."""
    return {knot for band in bands for reading in band for knot, _ in reading.shares}


def by_interpolation(bands: Sequence[Sequence[Reading]], width_nm: np.ndarray) -> np.ndarray:
    """Return the mask (band,) of bands that take fewer transforms by interpolation between knots
    than by exact computation.

    A band is judged as if bands of the same width lay on either side, so that the result does not
    depend on the other bands. Bands as narrow as a spectral line are computed exactly unless there
    are many of them.

    Parameters
    ----------
    bands : readings of every band.
    width_nm : (band,) widths, nm.
    """
    exact = [max(len(band), 3 if w > LINE_NM else 1) for band, w in zip(bands, width_nm)]
    few = len(_knots(bands)) > WORTH * sum(exact)
    steps = [min(knot.step_nm for knot in _knots([band])) for band in bands]
    return np.array(
        [
            step > 0 and (w / step <= WORTH * e if w > LINE_NM else not few)
            for w, step, e in zip(width_nm, steps, exact)
        ],
        bool,
    )


def transforms(
    lens: PupilOptics, flares: Sequence[Flare], wavelength_nm: np.ndarray, half: tuple[int, int]
) -> int:
    """Return the number of transforms that the kernels of a field point take.

    Parameters
    ----------
    lens : `field_point_lens.PlaceLens`.
    flares : its flare components.
    wavelength_nm : (band,) centres of the bands, nm.
    half : (y, x) tiles from the axis to the border of the kernels.
    """
    wave = np.asarray(wavelength_nm, float)
    bands = readings(lens, flares, wave, half)
    drawn = by_interpolation(bands, band_widths_nm(wave))
    knots = _knots(band for band, d in zip(bands, drawn) if d)
    return len(knots) + sum(len(band) for band, d in zip(bands, drawn) if not d)


def _wavelengths(
    centre: float, width: float, half: tuple[int, int], change: PhaseChange
) -> Wavelengths:
    """Return the Gauss-Legendre wavelengths of a band.

    Their number is the larger of two numbers, plus `MORE_READS`: the tiles that the band moves its
    outermost light, and the change of phase divided by `APART`. A spectral line has no additional
    wavelength, and may have only one.

    The error of this quadrature is 1e-6 to 7e-5 of a point's light (L1); that of the same number of
    midpoints of equal parts is 4e-5 to 4e-4. Most of the error lies at the border of the kernel: up
    to 3e-3 of the light of its octave.
    """
    count = max(
        np.hypot(*half) * width / centre,
        change(centre - width / 2, centre + width / 2) / APART if change else 0.0,
    )
    fewest, more = (1, 0) if width <= LINE_NM else (FEWEST_READS, MORE_READS)
    count = np.clip(int(np.ceil(count)) + more, fewest, MOST_READS)
    place, weight = np.polynomial.legendre.leggauss(count)
    return Wavelengths(centre + place * width / 2, weight / 2)


def _reading(wave: float, weight: float, change: PhaseChange) -> Reading:
    """Return a wavelength with the knots that give its pattern.

    The wavelength itself is the only knot, with step 0, if the phase of the lens changes too fast
    or is not known at the knots.

    Parameters
    ----------
    wave : wavelength, nm.
    weight : weight of the wavelength in its band: the sum of the shares.
    change : change of phase between two wavelengths.
    """
    for step in STEPS_NM if change else ():
        low = FIRST_NM + step * ((wave - FIRST_NM) // step)
        try:
            small = change(low, low + step) <= APART
        except ConfigError:
            continue
        if small:
            part = (wave - low) / step
            ends = ((low, weight * (1 - part)), (low + step, weight * part))
            return Reading(wave, tuple((Knot(nm, step), share) for nm, share in ends if share))
    return Reading(wave, ((Knot(wave, 0.0), weight),))

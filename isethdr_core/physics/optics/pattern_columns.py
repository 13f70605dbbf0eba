"""Pattern columns: kernels in a few columns of tiles, computed directly from the pupil's chords.

Along x, the transform of every chord of the pupil is computed where the columns lie, wherever that
is (`chord_transforms`). Along y, the pupil is transformed in smooth cells. Rays and running sums
are not used: the difference to kernels computed with them is the error of these kernels. A pupil
with phase is rasterised in cells that are smooth along both axes and finer than those of the
kernels; its pattern is not interpolated between wavelengths.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import scipy.fft as sf
from scipy.sparse import csr_array

from ..convolution import fourier
from .chord_transforms import chord_transforms
from .half_plane_pattern import (
    RealPupil,
    Strips,
    blocks_of,
    chords_of,
    half_lattice,
)
from .lattice import ORDER, spline_response
from .whole_plane_pattern import Turns, densities, drawn_pupil

# distance of samples / (wavelength x f-number); with 0.5 the samples would hold all of the pattern
STEP = 0.42
PERIOD = 3.0  # period of the field along y, in reaches
STRIPS = 1.5  # strips per row of cells
# distance between the ends of successive chords, in cells as wide as high. The error is 1e-5; a
# distance of 1 would halve it.
TURNED = 2.0
CHORDS = 1 << 18  # number of chords that one thread computes at a time; each needs about 80 bytes
# largest movement of the outermost tile from one wavelength of a band to the next, tiles
MOVES = 1.2


@dataclass(frozen=True)
class Place:
    """Columns of tiles, their band, and the sampling."""

    first: int  # first column, tiles from the axis
    count: int  # number of columns
    reach: int  # tiles from the axis to both ends of the columns
    pitch_um: tuple[float, float]  # (y, x) pitch of the tiles
    band_nm: tuple[float, float]  # ends of the band
    step: float = STEP  # distance of the pattern's samples, wavelengths x f-number
    # largest movement of the outermost tile from one wavelength to the next, tiles
    moves: float = MOVES
    period: float = PERIOD  # period of the field along y, in reaches
    strips: float = STRIPS  # strips per row of cells; slanted edges add more


def columns(pupil: RealPupil, place: Place, apply: Callable = map) -> np.ndarray:
    """Return the band's mean light from one tile to another, (y = -reach .. reach, column), as a
    fraction of the pupil's energy.

    Parameters
    ----------
    pupil : pupil without phase, mm.
    place : columns of tiles and their band.
    apply : `map`, or the `map` of a pool of threads. The result does not depend on it.
    """
    grid = _grid(pupil, place)
    return _means(place, grid, _density(pupil, place, grid, apply), apply)


def columns_with_phase(
    pupil: RealPupil, place: Place, turns: Turns, cleared: float, apply: Callable = map
) -> np.ndarray:
    """Return the result of `columns` for a pupil with the same phase in the whole band.

    Parameters
    ----------
    pupil : the pupil without its phase, mm.
    place : columns of tiles and their band.
    turns : function that gives the phase over the pupil (`whole_plane_pattern.Turns`).
    cleared : least period of the field along each axis, um. It makes the cells of the pupil so
        small that the phase is nearly linear over them.
    apply : `map`, or the `map` of a pool of threads.
    """
    grid = _grid(pupil, place)
    extent = (grid.far * grid.step_um, grid.columns[-1] * grid.step_um)
    period = max(place.period, *(cleared / e for e in extent))
    lattice = half_lattice(extent, grid.step_um, period, place.strips)
    lattice = replace(lattice, samples_to_border=(grid.far, lattice.samples_to_border[1]))
    drawn = drawn_pupil(pupil, place.band_nm[0], lattice)
    return _means(place, grid, densities(drawn, turns, grid.columns, apply), apply)


class _Grid(NamedTuple):
    """Samples of the pattern at the shortest wavelength of a band, for its columns of tiles."""

    columns: np.ndarray  # (column,) steps from the axis
    far: int  # steps from the axis to both ends of the columns
    step_um: float  # distance between samples


def _grid(pupil: RealPupil, place: Place) -> _Grid:
    short, long = place.band_nm
    pitch_y, pitch_x = place.pitch_um
    step = place.step * short * 1e-3 * pupil.distance_mm / (2 * pupil.radius_mm)
    far = int(np.ceil((place.reach + 2) * pitch_y / step)) + 1
    near = int((place.first - 1) * pitch_x * short / long / step) - 1
    last = int(np.ceil((place.first + place.count) * pitch_x / step)) + 2
    return _Grid(np.arange(near, last), far, step)


def _means(place: Place, grid: _Grid, density: np.ndarray, apply: Callable[..., Any]) -> np.ndarray:
    """Return the means over tiles and band, (y, column), of a pattern that only scales within the
    band.

    Parameters
    ----------
    place : columns of tiles and their band.
    grid : samples of the pattern.
    density : (column, y) pattern at the samples, at the shortest wavelength.
    apply : `map`, or the `map` of a pool of threads.
    """
    short, long = place.band_nm
    pitch_y, pitch_x = place.pitch_um
    far = grid.far
    last = place.first + place.count
    outer = np.hypot(last * pitch_x, place.reach * pitch_y) / min(pitch_x, pitch_y)
    count = int(np.ceil(max(6, outer * (long - short) / short / place.moves)))
    # The light of a tile is a band-limited function of the wavelength. Gauss-Legendre quadrature
    # integrates it almost exactly; midpoints of equal parts have up to ten times the error.
    places, weights = np.polynomial.legendre.leggauss(count)

    def at_one(at: float, weight: float) -> np.ndarray:
        u = short / ((short + long) / 2 + at * (long - short) / 2)
        right = _triangles(np.arange(place.first, last), u * pitch_x, grid.step_um * grid.columns)
        down = _triangles(
            np.arange(-place.reach, place.reach + 1),
            u * pitch_y,
            grid.step_um * np.arange(-far, far + 1),
        )
        return weight * u**2 * (down @ (right @ density).T)

    return sum(apply(at_one, places, weights / 2)) * (pitch_x * pitch_y)


def _triangles(tiles: np.ndarray, pitch_um: float, at_um: np.ndarray) -> csr_array:
    """Return weights (tile, sample) of triangles as wide as two tiles; those of a tile sum to 1.

    Tiles that are narrower than the distance of the samples get the linear interpolation between
    the nearest two samples.
    """
    step = at_um[1] - at_um[0]
    half_um = max(pitch_um, step)
    centre = (tiles * pitch_um - at_um[0]) / step
    taps = int(2 * half_um / step) + 2
    first = np.ceil(centre - half_um / step).astype(np.int32)
    sample = first[:, None] + np.arange(taps, dtype=np.int32)
    weight = np.maximum(0.0, 1 - np.abs(sample - centre[:, None]) * (step / half_um))
    weight /= weight.sum(axis=1, keepdims=True)
    sample = np.clip(sample, 0, len(at_um) - 1)  # clipped samples have the weight 0
    ends = np.arange(len(tiles) + 1, dtype=np.int32) * taps
    return csr_array((weight.ravel(), sample.ravel(), ends), (len(tiles), len(at_um)))


def _density(pupil: RealPupil, place: Place, grid: _Grid, apply: Callable[..., Any]) -> np.ndarray:
    """Return the pattern (column, y) per um2 at the samples of a grid."""
    across_um = grid.step_um * grid.columns
    far = grid.far
    step_um = grid.step_um
    wavelength_nm = place.band_nm[0]
    period = sf.next_fast_len(int(np.ceil(place.period * far)))
    scale = wavelength_nm * 1e-6 * pupil.distance_mm  # mm2
    cell = 1e3 * scale / (period * step_um)  # mm
    rows = 2 * (int(np.ceil(pupil.radius_mm / cell)) + (ORDER + 1) // 2)
    # the farther the columns lie from the axis, the faster the phase varies with the chords' ends
    apart = TURNED * cell * far * step_um / across_um[-1]
    fields = np.zeros((len(across_um), period), np.complex64)
    frequency = 1e-3 * across_um / scale  # cycles per mm
    strips_of_pupil = Strips(pupil, cell, rows, int(np.ceil(place.strips)), apart)

    def rows_of(block: slice) -> tuple[int, np.ndarray] | None:
        lines = chords_of(strips_of_pupil, block)
        return None if lines is None else chord_transforms(lines, frequency)

    for part in apply(rows_of, blocks_of(strips_of_pupil, CHORDS)):
        if part is not None:
            first, own = part
            fields[:, first : first + own.shape[1]] += own
    divisor = 2j * np.pi * np.where(frequency == 0, 1.0, frequency)
    fields *= (cell / divisor).astype(np.complex64)[:, None]
    fields = fourier.fft_rows(fields)
    y = np.arange(-far, far + 1)
    gain = spline_response(y / period) ** -2 * (1e-6 / (scale**2 * pupil.energy_mm2))
    fields = np.concatenate([fields[:, period - far :], fields[:, : far + 1]], axis=1)
    return (fields.real**2 + fields.imag**2) * gain

"""Pattern samples: fine samples of the pattern of a field point at one wavelength, by a Fourier
transform of its pupil.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.fft as sf

from isethdr_core.physics.optics.pupil import disc, raster

from ...pupil import (
    pupil_cells,
    pupil_energy,
    pupil_grid,
    pupil_shapes,
    pupil_size,
    wavefront_cells,
    wavefronts,
)
from .knots import FIRST_NM

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ...abilities import PupilOptics

# least numbers of samples per wavelength x f-number, and per tile
PER_BLUR = 2.5
PER_TILE = 5.0
# largest change of phase between adjacent cells of the pupil, wavelengths. `fine_cells.FINE_TURNS`,
# for an accuracy of 0.3 %, is a quarter of it
TURNS = 1 / 8
# Number of cells across the stop, as in `pupil_grid.core_pitch_mm`: least number; number per
# wavelength x f-number of the image width, used up to `USUAL`; largest number
FEWEST = 256
BORDER = 4.0
USUAL = 768
MOST = 4096
# largest number of samples from the axis: 512 wavelengths x f-number, beyond which lies 1e-3 of a
# point's light
WIDEST = 1024


class PupilLight(NamedTuple):
    """Functions that give the light through a pupil."""

    energy_mm2: Callable[[float], float]  # function(wavelength in nm) -> energy, mm2
    # function(cells across the stop, wavelength in nm) -> amplitude (y, x)
    amplitude: Callable[[int, float], np.ndarray]


class Pattern(NamedTuple):
    """The pattern of a point at one wavelength."""

    samples: np.ndarray  # (y, x) fraction of the energy per sample, with the axis in the middle
    step_um: float  # distance between samples


class Transform(NamedTuple):
    """The size of a transform from the pupil of a field point to its point spread."""

    cells: int  # number of cells across the stop
    size: int  # number of samples along each axis
    step_um: float  # distance between samples
    reach: int  # number of samples from the axis that are kept

    @property
    def samples(self) -> float:
        """Number of complex values in the transforms along both axes."""
        return float(self.size * (self.cells + 2 * self.reach + 1))


def transform(
    lens: PupilOptics,
    waves_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    half: tuple[int, int],
) -> Transform:
    """Return the size of the transform of one field point at one wavelength.

    Parameters
    ----------
    lens : `field_point_lens.PlaceLens`.
    waves_nm : (wavelength, shortest wavelength that is read from its pattern). The pattern extends
        as far as the shortest wavelength needs.
    pitch_um : (y, x) pitch of the tiles, um.
    half : (y, x) tiles from the axis to the border of the kernel.
    """
    wave, shortest = waves_nm
    blur = pupil_size.blur_um(lens, wave)
    extent = max((h + 1) * p for h, p in zip(half, pitch_um))
    across = 2 * extent / (blur * min(1.0, shortest / wave))
    steep = 2 * wavefronts.steepest_um(lens, wave) / (wave * 1e-3) / TURNS
    usual = max(FEWEST, min(USUAL, BORDER * across), min(2 * across, 2 * WIDEST / PER_BLUR), steep)
    cells = _rounded(min(usual, MOST))
    size = sf.next_fast_len(int(np.ceil(cells * max(PER_BLUR, PER_TILE * blur / min(pitch_um)))))
    step = blur * cells / size
    reach = int(min(np.ceil(extent * max(1.0, wave / shortest) / step), WIDEST, size // 2 - 1))
    return Transform(cells, size, step, reach)


def pupil_light(lens: PupilOptics, flares: Sequence[Flare]) -> PupilLight:
    """Return the light through a pupil; it is computed once if it is the same at all wavelengths.

    Parameters
    ----------
    lens : `field_point_lens.PlaceLens`.
    flares : its flare components.
    """
    flare_shapes = pupil_shapes.all_shapes(flares)
    fixed = flare_shapes and not pupil_shapes.delays_um(lens, flares)
    energy = cache(partial(pupil_energy.open_energy_mm2, lens, flares))
    stop = cache(partial(_stop, lens, flares))
    return PupilLight(
        lambda w: energy(FIRST_NM if flare_shapes else w),
        lambda cells, w: stop(cells, FIRST_NM if fixed else w),
    )


def pattern(
    lens: PupilOptics,
    light: PupilLight,
    waves_nm: tuple[float, float],
    pitch_um: tuple[float, float],
    half: tuple[int, int],
) -> Pattern:
    """Return the pattern of a field point at one wavelength.

    Parameters
    ----------
    lens, waves_nm, pitch_um, half : as in `transform`.
    light : light through the pupil.
    """
    wave = waves_nm[0]
    total = light.energy_mm2(wave)  # raises an error if no light passes the stop
    radius = pupil_size.radius_mm(lens)
    cells, size, step, reach = transform(lens, waves_nm, pitch_um, half)
    stop = light.amplitude(cells, wave)
    axis = pupil_grid.axis_mm(lens, 2 * radius / cells)
    rows, columns = (
        slice(open_rows[0], open_rows[-1] + 1)
        for open_rows in (np.flatnonzero(stop.any(axis=a)) for a in (1, 0))
    )
    field = wavefront_cells.with_wavefront(
        lens, stop[rows, columns], axis[columns], axis[rows], wave
    )
    reached = np.arange(-reach, reach + 1)
    for a in (1, 0):
        field = sf.fft(field, size, axis=a).take(reached, axis=a, mode="wrap")
    loss = np.sinc(reached / size) ** -2  # undoes the averaging of the pupil over each cell
    scale = (2 * radius / cells / size) ** 2 / total
    down = (loss[:, None] * scale).astype(np.float32)
    return Pattern(np.square(np.abs(field)) * down * loss.astype(np.float32), step)


def _rounded(cells: float) -> int:
    """Return the number of cells, rounded up to a power of the root of two. Field points then share
    a few numbers of cells, and the stop is rasterised once for each number.
    """
    return int(np.ceil(2 ** (np.ceil(2 * np.log2(cells)) / 2)))


def _stop(lens: PupilOptics, flares: Sequence[Flare], cells: int, wave: float) -> np.ndarray:
    """Return the pupil amplitude (y, x) of a field point: the stop with its dirt, times the share
    of each cell that the rims leave open.
    """
    radius = pupil_size.radius_mm(lens)
    axis = pupil_grid.axis_mm(lens, 2 * radius / cells)
    drawn = pupil_cells.amplitude(replace(lens, rims=()), flares, axis, axis, wave)
    for rim in lens.rims:
        opening = disc(*(radius * v for v in rim))
        if lens.pupil_matrix is not None:
            opening = opening.mapped(lens.pupil_matrix)
        drawn = drawn * raster([(opening, 1.0)], axis, axis)
    return drawn

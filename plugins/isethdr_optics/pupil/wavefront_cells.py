"""Wavefront cells: cells of a pupil, multiplied by the phase of the lens's wavefront."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics.zernike import wavefront_at, wavefront_um

from . import apodization
from .pupil_grid import check_phase_sampling, turns_per_cell
from .pupil_map import over_pupil, stop_from_pupil
from .pupil_size import radius_mm
from .wavefronts import coefficients_um

if TYPE_CHECKING:
    from ..abilities import PupilOptics


def with_wavefront(
    lens: PupilOptics,
    cells: np.ndarray,
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return the cells times exp(2 pi i OPD / wavelength), and times the lens's apodization.

    Parameters
    ----------
    lens : a lens of this package.
    cells : (y, x) amplitude.
    x_mm : centres of the cells along x, mm, evenly spaced, rising.
    y_mm : the same along y.
    wavelength_nm : wavelength, nm.

    Raises
    ------
    ConfigError : the wavefront changes by half a wave or more from one cell to the next.
    """
    wavefront = coefficients_um(lens, wavelength_nm)
    if not (wavefront or lens.uneven):
        return cells
    check_phase_sampling(lens, max(x_mm[1] - x_mm[0], y_mm[1] - y_mm[0]), wavelength_nm)
    out = np.empty(cells.shape, np.complex64)
    # blocks of rows stay in the processor's cache: four times faster
    for start in range(0, len(y_mm), 64):
        rows = slice(start, start + 64)
        out[rows] = times_phase(lens, wavefront, cells[rows], x_mm, y_mm[rows], wavelength_nm)
    return out


def times_phase(
    lens: PupilOptics,
    wavefront: dict[int, float],
    cells: np.ndarray,
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return cells times the mean of exp(2 pi i OPD / wavelength) over each, and the apodization.

    The mean over a cell is the phase at its centre, reduced by `phase_mean`. y points up in OSA
    Zernike terms, and down in `y_mm`.

    Parameters
    ----------
    lens : a lens of this package.
    wavefront : {OSA index: micrometres rms} at this wavelength.
    cells : (y, x) amplitude.
    x_mm : centres of the cells along x, mm, evenly spaced, rising.
    y_mm : the same along y.
    wavelength_nm : wavelength, nm.
    """
    radius = radius_mm(lens)
    step = x_mm[1] - x_mm[0]
    tall = y_mm[1] - y_mm[0] if len(y_mm) > 1 else step
    # one more cell on every side, so that slopes do not depend on the block
    x = np.concatenate([[x_mm[0] - step], x_mm, [x_mm[-1] + step]])
    y = np.concatenate([[y_mm[0] - tall], y_mm, [y_mm[-1] + tall]])
    turns = _opd_um(lens, wavefront, x / radius, -y / radius) / (wavelength_nm * 1e-3)
    steep = turns_per_cell(lens, max(step, tall), wavelength_nm) > 1 / 128
    # the mean over a cell of a flatter wavefront is less than 1e-4 below the value at its centre
    mean = phase_mean(turns)[1:-1, 1:-1] if steep else np.float32(1.0)
    turns = turns[1:-1, 1:-1]
    turns -= np.rint(turns)  # without whole turns, float32 is exact to 1e-7 of a turn
    angle = (2 * np.pi * turns).astype(np.float32)
    out = np.empty(cells.shape, np.complex64)
    np.cos(angle, out=out.real)
    np.sin(angle, out=out.imag)
    out *= cells * mean
    if lens.uneven:
        out *= apodization.cell_amplitude(lens, x_mm, y_mm)
    return out


def _opd_um(
    lens: PupilOptics, wavefront: dict[int, float], x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return the optical path difference (y, x) in the open part of every cell, micrometres.

    `x` and `y` are in radii of the stop, y up. Polynomials grow without limit beyond the rim,
    faster for higher orders. Therefore cells that the rim crosses take the value at the middle of
    their part inside the rim, and cells beyond the rim the value at the rim. `half` is half the
    width of a cell along the radius.
    """
    out = wavefront_um(over_pupil(lens, wavefront), x, y)
    step_x = abs(x[1] - x[0])
    step_y = abs(y[1] - y[0])
    to_stop = stop_from_pupil(lens)
    stop_x = to_stop[0, 0] * x + to_stop[0, 1] * y[:, None]
    stop_y = to_stop[1, 0] * x + to_stop[1, 1] * y[:, None]
    widest = np.hypot(step_x, step_y) / 2 * np.linalg.norm(to_stop, 2)
    beside = stop_x**2 + stop_y**2 > max(1 - widest, 0.0) ** 2
    at = np.stack([stop_x[beside], stop_y[beside]])
    rho = np.hypot(*at)
    half = (np.abs(to_stop.T @ at) * np.array([[step_x], [step_y]])).sum(axis=0) / (2 * rho)
    middle = np.where(rho + half <= 1, rho, np.where(rho - half >= 1, 1.0, (1 + rho - half) / 2))
    out[beside] = wavefront_at(wavefront, *(at * middle / rho))
    return out


def phase_mean(turns: np.ndarray) -> np.ndarray | float:
    """Return the factor, float32, by which the mean of a phase over each cell is below 1.

    It is the product of the sincs of the slopes along x and y. `turns` is the phase (y, x) at the
    centres of the cells, in wavelengths. Cells are means, so the image is divided by the sinc of a
    cell at every point. The slope of a wavefront sends its light to the point where this sinc
    equals the factor. Without the factor, the light there would be too bright, by a tenth at a
    quarter wave per cell.
    """
    out = np.float32(1.0)
    for axis in (0, 1):
        if turns.shape[axis] > 2:
            t = np.square(
                np.pi * np.gradient(turns, axis=axis), dtype=np.float32, casting="same_kind"
            )
            # series of the sinc; exact to 1e-5 at half a wave per cell, the most allowed
            out = out * (1 - t / 6 * (1 - t / 20 * (1 - t / 42 * (1 - t / 72))))
    return np.broadcast_to(out, turns.shape)

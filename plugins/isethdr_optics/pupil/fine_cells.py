"""Fine cells: amplitude times phase, averaged from cells that are fine enough for the wavefront."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .pupil_cells import amplitude
from .pupil_grid import check_phase_sampling, turns_per_cell
from .pupil_size import radius_mm
from .wavefront_cells import times_phase, with_wavefront
from .wavefronts import coefficients_um, slopes

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

# Largest change of the wavefront from one cell to the next, in wavelengths, for which the mean
# amplitude of a cell is multiplied by its mean phase.
FINE_TURNS = 1 / 32
# Largest share of a point's light (L1 norm) that cells of this width misplace. Measured against
# cells a third as wide, for radial orders 2 to 40.
CELL_ERROR = 4e-4
# Numbers of parts, per axis, into which a cell may be divided. Half a wave per cell takes 16.
PARTS = (1, 2, 3, 4, 6, 8, 12, 16)
BLOCK = 16  # number of cells, per axis, in a block that is divided into equal parts


def resolved(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
    cells: np.ndarray | None = None,
) -> np.ndarray:
    """Return the means over cells of amplitude times phase.

    At the rim, the product of two means is not the mean of the product. At a quarter wave per cell,
    the light on the axis of a strongly defocused point is wrong by a fifth. The error falls with
    the square of the step: 0.3 % at `FINE_TURNS` per cell. Cells are therefore divided where the
    wavefront is steeper.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    x_mm : centres of the cells along x, mm, evenly spaced, rising.
    y_mm : the same along y.
    wavelength_nm : wavelength, nm.
    cells : (y, x) means of the amplitude, if they are known.

    Raises
    ------
    ConfigError : the wavefront changes by half a wave or more from one cell to the next. The mean
        of each cell would still be right, but the image of the cells would be aliased.
    """
    step = max(x_mm[1] - x_mm[0], y_mm[1] - y_mm[0])
    check_phase_sampling(lens, step, wavelength_nm)
    if turns_per_cell(lens, step, wavelength_nm) <= FINE_TURNS:
        cells = amplitude(lens, flares, x_mm, y_mm, wavelength_nm) if cells is None else cells
        return with_wavefront(lens, cells, x_mm, y_mm, wavelength_nm)
    return mean_of_products(lens, flares, x_mm, y_mm, wavelength_nm)


def mean_of_products(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return the means over cells of amplitude times phase on finer cells.

    Each block of cells is divided as finely as the wavefront in it requires.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    x_mm : centres of the cells along x, mm, evenly spaced, rising.
    y_mm : the same along y.
    wavelength_nm : wavelength, nm.
    """
    out = np.zeros((len(y_mm), len(x_mm)), np.complex64)
    for first in range(0, len(y_mm), BLOCK):
        rows = slice(first, first + BLOCK)
        for columns, parts in _runs(lens, x_mm, y_mm[rows], wavelength_nm):
            part = [x_mm[columns], y_mm[rows]]
            fine_x, fine_y = (
                ((np.arange(parts) + 0.5) / parts - 0.5) * (a[1] - a[0]) + b[:, None]
                for a, b in zip((x_mm, y_mm), part)
            )
            product = product_of_means(lens, flares, fine_x.ravel(), fine_y.ravel(), wavelength_nm)
            out[rows, columns] = product.reshape(len(fine_y), parts, len(fine_x), parts).mean(
                (1, 3)
            )
    return out


def product_of_means(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
) -> np.ndarray:
    """Return the mean amplitude of each cell, times its mean phase.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    x_mm : centres of the cells along x, mm, evenly spaced, rising.
    y_mm : the same along y.
    wavelength_nm : wavelength, nm.
    """
    cells = amplitude(lens, flares, x_mm, y_mm, wavelength_nm, points=1)
    wavefront = coefficients_um(lens, wavelength_nm)
    return (
        times_phase(lens, wavefront, cells, x_mm, y_mm, wavelength_nm)
        if wavefront or lens.uneven
        else cells
    )


def _runs(lens: PupilOptics, x_mm: np.ndarray, y_mm: np.ndarray, wavelength_nm: float) -> Any:
    """Return [(columns, parts), ...] of a strip of rows.

    `columns` is a slice of neighbouring blocks whose cells are all divided into `parts` per axis.
    Blocks beyond the rim are left out.
    """
    radius = radius_mm(lens)
    step = x_mm[1] - x_mm[0]
    tall = y_mm[1] - y_mm[0] if len(y_mm) > 1 else step
    rho, slope_um = slopes(lens, wavelength_nm)
    turns = slope_um * max(step, tall) / radius / (wavelength_nm * 1e-3)
    matrix = np.eye(2) if lens.pupil_matrix is None else np.array(lens.pupil_matrix)
    # least and largest factor from a distance in the pupil to the distance in the stop
    bounds = (1 / np.linalg.norm(matrix, 2), np.linalg.norm(np.linalg.inv(matrix), 2))
    # the last block never has one column only: the width of a cell follows from two
    starts = np.arange(0, max(len(x_mm) - 1, 1), BLOCK)
    ends = np.append(starts[1:], len(x_mm))
    along_y = _distances(y_mm[0] - tall / 2, y_mm[-1] + tall / 2)
    runs = []
    for start, end in zip(starts, ends):
        along_x = _distances(x_mm[start] - step / 2, x_mm[end - 1] + step / 2)
        near, far = (
            np.hypot(*pair) / radius * more for pair, more in zip(zip(along_x, along_y), bounds)
        )
        if near >= 1:
            continue
        within = slice(max(np.searchsorted(rho, near) - 1, 0), np.searchsorted(rho, far) + 1)
        parts = next((p for p in PARTS if turns[within].max() <= p * FINE_TURNS), PARTS[-1])
        if runs and runs[-1][1] == parts and runs[-1][0].stop == start:
            start = runs.pop()[0].start
        runs.append((slice(int(start), int(end)), parts))
    return runs


def _distances(low: float, high: float) -> tuple[float, float]:
    """Return the least and the largest distance of points of an interval from 0."""
    return (0.0 if low <= 0 <= high else min(abs(low), abs(high))), max(abs(low), abs(high))

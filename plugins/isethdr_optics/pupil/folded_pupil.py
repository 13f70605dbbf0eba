"""Folded pupil: a pupil with its wavefront, summed modulo a period, for patterns on a lattice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics import lattice as lattices

from .fine_cells import FINE_TURNS, mean_of_products, product_of_means
from .pupil_grid import turns_per_cell
from .pupil_size import reach_mm

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics


def folded(
    lens: PupilOptics,
    flares: Sequence[Flare],
    wavelength_nm: float,
    cells_mm: tuple[float, float],
    period: tuple[int, int],
    offsets: tuple[tuple[float, float], tuple[float, float]],
) -> list[np.ndarray]:
    """Return the pupil with its wavefront in smooth cells, summed modulo `period`.

    There is one sum for each offset; see `lattice.fold_cells`.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    wavelength_nm : wavelength, nm.
    cells_mm : (y, x) sides of a cell, mm.
    period : (y, x) period of the result, in cells.
    offsets : several (y, x) offsets, each the point between image samples, -1 to 1.

    Returns
    -------
    list of complex64 arrays (period_y, period_x), one for each offset.
    """
    half_y, half_x = (c / 2 for c in cells_mm)
    fine = turns_per_cell(lens, max(half_y, half_x), wavelength_nm) > FINE_TURNS
    count_y, count_x = (2 * (int(np.ceil(reach_mm(lens) / c)) + 1) for c in cells_mm)
    x, y = ((np.arange(2 * n) + 0.5 - n) * h for n, h in ((count_x, half_x), (count_y, half_y)))

    def blocks() -> Iterator[tuple[int, int, np.ndarray]]:
        for start in range(0, len(y), 64):
            rows = y[start : start + 64]
            nearest = 0.0 if rows[0] * rows[-1] <= 0 else min(abs(rows[0]), abs(rows[-1])) - half_y
            reach = np.sqrt(max(reach_mm(lens) ** 2 - nearest**2, 0.0)) + half_x
            inside = slice(*np.searchsorted(x, (-reach, reach)))
            if inside.stop > inside.start + 1:
                arguments = lens, flares, x[inside], rows, wavelength_nm
                yield (
                    start,
                    inside.start,
                    mean_of_products(*arguments)
                    if fine and len(rows) > 1
                    else product_of_means(*arguments),
                )

    return lattices.fold_cells(blocks(), period, offsets)

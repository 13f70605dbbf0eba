"""Pupil map: from points of the stop to points of the exit pupil, for functions over the stop.

A lens whose stop and exit pupil differ has a `pupil_matrix` (`field_point_lens`). The matrix is for
x right and y down; Zernike terms have y up.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Protocol

import numpy as np

from isethdr_core.physics.optics.pupil import Matrix
from isethdr_core.physics.optics.zernike import mapped

ROUNDING = 1e-12  # of Zernike coefficients, um or share of the amplitude


class MapsPupil(Protocol):
    """What maps the stop to the pupil: a matrix, or None where both are the same."""

    pupil_matrix: Matrix | None


def over_pupil(lens: MapsPupil, terms: dict[int, float]) -> dict[int, float]:
    """Return Zernike terms {OSA index: value} over the pupil of terms over the stop."""
    return (
        terms
        if lens.pupil_matrix is None
        else dict(_mapped(tuple(terms.items()), _matrix_up(lens)))
    )


def stop_from_pupil(lens: MapsPupil) -> np.ndarray:
    """Return the matrix from places in the pupil to places in the stop, y up."""
    return np.eye(2) if lens.pupil_matrix is None else np.linalg.inv(_matrix_up(lens))


@lru_cache(maxsize=64)
def _mapped(
    terms: tuple[tuple[int, float], ...], matrix_up: tuple[tuple[float, float], tuple[float, float]]
) -> tuple[tuple[int, float], ...]:
    return tuple((j, c) for j, c in mapped(dict(terms), matrix_up).items() if abs(c) > ROUNDING)


def _matrix_up(lens: MapsPupil) -> Matrix:
    (xx, xy), (yx, yy) = lens.pupil_matrix
    return (xx, -xy), (-yx, yy)

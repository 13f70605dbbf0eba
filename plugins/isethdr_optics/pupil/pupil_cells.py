"""Pupil cells: the mean amplitude transmission of stop and flares over each cell of a grid."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.pupil import raster
from isethdr_core.plugins.protocols import TransmitsPupil

from ..abilities import DrawsPupil
from .pupil_shapes import terms

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics

# Least share of a pupil's energy that its means over cells must keep. They keep this share if the
# phase changes by a quarter wave from cell to cell.
UNRESOLVED = 0.8


def amplitude(
    lens: PupilOptics,
    flares: Sequence[Flare],
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
    points: int = 3,
) -> np.ndarray:
    """Return the mean amplitude transmission (y, x) of each cell, real or complex, without the
    wavefront.

    Parameters
    ----------
    lens, flares : the lens and its flare components.
    x_mm, y_mm : centres of the cells, mm, evenly spaced, rising.
    wavelength_nm : wavelength, nm.
    points : number of samples per cell and axis, for flares without exact shapes.
    """
    low = y_mm[0] - (y_mm[1] - y_mm[0])
    high = y_mm[-1] + (y_mm[1] - y_mm[0])
    terms_near = [
        t for t in terms(lens, flares, wavelength_nm) if t[0].low < high and t[0].high > low
    ]
    out = raster(terms_near, x_mm, y_mm)
    for flare in flares:
        if isinstance(flare, TransmitsPupil) and not isinstance(flare, DrawsPupil):
            out = out * _sampled(flare, lens.pupil_matrix, x_mm, y_mm, wavelength_nm, points)
    return out


def _sampled(
    flare: TransmitsPupil,
    pupil_matrix: tuple[tuple[float, float], tuple[float, float]] | None,
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    wavelength_nm: float,
    points: int,
) -> np.ndarray:
    """Return the means over cells of a flare without exact shapes, from points of the stop."""
    (xx, xy), (yx, yy) = np.linalg.inv(pupil_matrix) if pupil_matrix is not None else np.eye(2)
    step_x = x_mm[1] - x_mm[0]
    step_y = y_mm[1] - y_mm[0]
    inner = (np.arange(points) + 0.5) / points - 0.5
    mean = 0.0
    energy = 0.0
    for dy in inner * step_y:
        for dx in inner * step_x:
            x = x_mm[None, :] + dx
            y = y_mm[:, None] + dy
            stop = (xx * x + xy * y, yx * x + yy * y) if pupil_matrix is not None else (x, y)
            point = np.asarray(flare.pupil(*stop, wavelength_nm))
            mean = mean + point
            energy = energy + float(np.mean(np.abs(point) ** 2))
    mean = mean / points**2
    if not np.isfinite(mean).all() or np.abs(mean).max() > 1 + 1e-9:
        raise ConfigError(
            f"flare {type(flare).__name__} has a pupil transmission that is not finite or above 1; "
            "expected amplitudes of at most 1 from pupil(x_mm, y_mm, wavelength_nm)"
        )
    if float(np.mean(np.abs(mean) ** 2)) < UNRESOLVED * energy / points**2:
        raise ConfigError(
            f"flare {type(flare).__name__} has a pupil that changes by more than about a quarter"
            f" wave per cell of {1e3 * max(step_x, step_y):.3g} um; expected a smoother phase, or a"
            " pupil written as shapes"
        )
    return np.broadcast_to(mean, (len(y_mm), len(x_mm)))

"""Paraxial matrices (height, angle) of any path through surfaces.

The angle is dy / d(path length), so that reflections need no mirror signs. Height y, angle u,
index n, curvature c, path length L; s is +1 for light towards larger z, else -1:

    refraction   n' u' = n u - s c (n' - n) y
    reflection   u' = u + 2 s c y
    transfer     y' = y + L u
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .surfaces import Surface


def matrices(
    surfaces: Sequence[Surface],
    indices: list[float | np.ndarray],
    path: list[tuple[int, bool]],
    start_mm: float,
) -> list[np.ndarray]:
    """Return, for every step of a path, the matrix from the plane `start_mm` to the light just
    after that surface.

    Parameters
    ----------
    surfaces : surfaces in the order of z.
    indices : refractive index in front of the first surface, between surfaces, and behind the last;
        numbers.
    path : [(surface, whether it reflects), ...].
    start_mm : z of the plane in front of the surfaces at which height and angle are given, mm.
    """
    total = np.eye(2)
    z = start_mm
    forward = 1
    out = []
    for k, reflects in path:
        surface = surfaces[k]
        c = surface.curvature_per_mm
        total = np.array([[1.0, forward * (surface.z_mm - z)], [0.0, 1.0]]) @ total
        z = surface.z_mm
        if reflects:
            total = np.array([[1.0, 0.0], [2 * forward * c, 1.0]]) @ total
            forward = -forward
        else:
            n_from, n_to = (
                (indices[k], indices[k + 1]) if forward > 0 else (indices[k + 1], indices[k])
            )
            total = (
                np.array([[1.0, 0.0], [-forward * c * (n_to - n_from) / n_to, n_from / n_to]])
                @ total
            )
        out.append(total)
    return out


def focal_length_mm(surfaces: Sequence[Surface], indices: list[float | np.ndarray]) -> float:
    """Return the focal length in the last medium, mm; infinite for an afocal system."""
    lower = _system_matrix(surfaces, indices)[1, 0]
    return float("inf") if lower == 0 else float(-1 / lower)


def back_focus_mm(surfaces: Sequence[Surface], indices: list[float | np.ndarray]) -> float:
    """Return the distance from the last vertex to the focus of light from infinity, mm."""
    system = _system_matrix(surfaces, indices)
    return float("inf") if system[1, 0] == 0 else float(-system[0, 0] / system[1, 0])


def _system_matrix(surfaces: Sequence[Surface], indices: list[float | np.ndarray]) -> np.ndarray:
    return matrices(
        surfaces, indices, [(k, False) for k in range(len(surfaces))], surfaces[0].z_mm
    )[-1]


def entrance_pupil(
    surfaces: Sequence[Surface], indices: list[float | np.ndarray]
) -> tuple[float, float]:
    """Return (z of the entrance pupil, its radius), mm. One of the surfaces must be the stop."""
    stop = next(k for k, s in enumerate(surfaces) if s.is_stop)
    to_stop = matrices(surfaces, indices, [(k, False) for k in range(stop + 1)], surfaces[0].z_mm)[
        -1
    ]
    # A ray of height y and angle u at the first vertex meets the stop's centre if A y + B u = 0.
    # Its line crosses the axis at -y / u = B / A, which is the position of the entrance pupil.
    return float(surfaces[0].z_mm + to_stop[0, 1] / to_stop[0, 0]), float(
        surfaces[stop].semi_diameter_mm / abs(to_stop[0, 0])
    )

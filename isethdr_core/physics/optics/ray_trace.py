"""Exact rays through a list of surfaces, along any path of refractions and reflections."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .surfaces import Surface, intersect, normal


@dataclass(frozen=True, eq=False)
class Rays:
    """Ends of traced rays; NaN where a ray missed a surface or was totally reflected."""

    position_mm: np.ndarray  # (3, ...) on the last surface
    direction: np.ndarray  # (3, ...) unit vectors
    weight: np.ndarray  # product of the fractions of power that the surfaces pass on
    margin: np.ndarray  # smallest 1 - (r / semi-diameter)^2 along the ray; negative: blocked
    hits_mm: tuple  # (x, y) at every step of the path, if they were asked for


def refract(
    direction: np.ndarray, normals: np.ndarray, n_from: float | np.ndarray, n_to: float | np.ndarray
) -> np.ndarray:
    """Return refracted unit directions (3, ...), NaN beyond the critical angle.

    Snell's law for vectors is n' d' = n d + (n' cos' - n cos) N, with the normal N in the sense of
    the light.

    Parameters
    ----------
    direction : (3, ...) unit directions of the light.
    normals : (3, ...) unit normals of the surface, on either side.
    n_from, n_to : refractive index before and behind the surface.
    """
    cosine = np.sum(direction * normals, axis=0)
    side = np.sign(cosine)
    ratio = n_from / n_to
    with np.errstate(invalid="ignore"):
        cosine_out = np.sqrt(1 - ratio**2 * (1 - cosine**2))
    return ratio * direction + (cosine_out - ratio * np.abs(cosine)) * side * normals


def reflect(direction: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return mirrored unit directions (3, ...): d - 2 (d N) N."""
    return direction - 2 * np.sum(direction * normals, axis=0) * normals


def sequential(count: int) -> list[tuple[int, bool]]:
    """Return the path of the image: every surface once, refracting."""
    return [(k, False) for k in range(count)]


def ghost_path(count: int, back: int, front: int) -> list[tuple[int, bool]]:
    """Return the path of a ghost: to surface `back`, where light is reflected, back to surface
    `front`, where it is reflected again, and to the last of `count` surfaces.
    """
    if not 0 <= front < back < count:
        raise ValueError(
            f"a ghost needs 0 <= front < back < {count}; got front {front}, back {back}"
        )
    path = [(k, False) for k in range(back)] + [(back, True)]
    path += [(k, False) for k in range(back - 1, front, -1)] + [(front, True)]
    return path + [(k, False) for k in range(front + 1, count)]


class Start(NamedTuple):
    """Positions from which rays start, and their directions."""

    position_mm: np.ndarray  # (3, ...)
    direction: np.ndarray  # (3, ...) unit vectors


def follow(
    surfaces: list[Surface],
    indices: list[float | np.ndarray],
    path: list[tuple[int, bool]],
    start: Start,
    power: Callable[..., np.ndarray] | None = None,
    keep_hits: bool = False,
) -> Rays:
    """Trace rays along a path.

    Parameters
    ----------
    surfaces : surfaces in the order of z.
    indices : refractive indices in front of the first surface, between surfaces, and behind the
        last; numbers or arrays that broadcast with the rays.
    path : [(surface, whether it reflects), ...].
    start : positions and directions of the rays; light starts towards larger z.
    power : function(surface, reflects, forward, cosine) -> fraction of the power that is reflected
        or transmitted; None: 1.
    keep_hits : whether (x, y) of every step are kept.

    Returns
    -------
    Rays on the last surface of the path. Rays that pass outside a semi-diameter are traced on, with
    a negative margin.
    """
    position, direction = start
    shape = np.broadcast_shapes(
        *(np.shape(n) for n in indices), position.shape[1:], direction.shape[1:]
    )
    weight = np.ones(shape)
    margin = np.full(shape, np.inf)
    forward = True
    hits = []
    for k, reflects in path:
        surface = surfaces[k]
        position = intersect(surface, position, direction)
        if np.isfinite(surface.semi_diameter_mm):
            margin = np.minimum(
                margin, 1 - (position[0] ** 2 + position[1] ** 2) / surface.semi_diameter_mm**2
            )
        if keep_hits:
            hits.append(position[:2])
        normals = normal(surface, position)
        if power is not None:
            cosine = np.abs(np.sum(direction * normals, axis=0))
            weight = weight * power(k, reflects, forward, cosine)
        if reflects:
            direction = reflect(direction, normals)
            forward = not forward
            continue
        n_from, n_to = (indices[k], indices[k + 1]) if forward else (indices[k + 1], indices[k])
        if n_from is not n_to:
            direction = refract(direction, normals, n_from, n_to)
    position = np.broadcast_to(position, (3, *shape))
    vignetted = ~np.isfinite(position).all(axis=0) | ~np.isfinite(direction).all(axis=0)
    return Rays(
        position,
        direction,
        np.where(vignetted, 0.0, weight),
        np.where(vignetted, -np.inf, margin),
        tuple(hits),
    )


def collimated(
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    z_mm: float,
    tangent_x: float | np.ndarray,
    tangent_y: float | np.ndarray,
) -> Start:
    """Return positions and directions of parallel light that crosses a plane.

    Parameters
    ----------
    x_mm, y_mm : points at which the rays cross the plane, mm; any shapes that broadcast.
    z_mm : position of the plane along the axis, mm.
    tangent_x, tangent_y : tangents of the rays' direction, dx/dz and dy/dz.
    """
    x, y, tx, ty = np.broadcast_arrays(
        *(np.asarray(v, float) for v in (x_mm, y_mm, tangent_x, tangent_y))
    )
    length = np.sqrt(1 + tx**2 + ty**2)
    return Start(
        np.stack([x, y, np.full(x.shape, float(z_mm))]),
        np.stack([tx / length, ty / length, 1 / length]),
    )

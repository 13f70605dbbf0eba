"""Point choice: the field points that a lens needs for the allowed error.

Light half way between two field points gets the mean of their cores. The error is the L1 distance
of that mean from the core computed half way between them, as a share of a point's light.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from . import grid
from .grid import AROUND, Place
from .meridian import Meridian

RINGS = (0, 1, 2, 4, 8)  # numbers of rings, tried in this order
# function(radius in field coordinates, azimuth in rad, wavelength in nm) -> core (y, x)
Core = Callable[[float, float, float], np.ndarray]


class Chosen(NamedTuple):
    """The field points that are needed, and the error between them."""

    # each with its distance to the next ring, or (to the next ring inside, to the next outside); an
    # empty list: the core of the axis serves everywhere
    points: list[tuple[Place, float | tuple[float, float]]]
    error: float  # largest L1 error, share of a point's light


def chosen_points(core: Core, radius: float, line: Meridian, allowed: float) -> Chosen:
    """Return the field points that are needed for all reference wavelengths.

    Parameters
    ----------
    core : function that returns a core; it is called several times with some arguments.
    radius : radius of the field, in field coordinates.
    line : the lens along +x of the field.
    allowed : largest allowed error, share of a point's light.
    """
    rings, error = _rings(core, radius, line, allowed)
    if rings == 0:
        return Chosen([], error)
    if len(RINGS) == 1:  # a study may set a single number of rings: all field points are kept
        return Chosen(
            [(place, radius / rings) for place in grid.places(rings, radius, line.symmetric)], error
        )
    return _thinned(core, rings, radius, line, allowed)


def _rings(core: Core, radius: float, line: Meridian, allowed: float) -> tuple[int, float]:
    """Return (number of rings, its error): the first number with an allowed error, or else the
    last.

    Wavelengths are tried only until one exceeds the allowed error, except for the last number.
    """
    for rings in RINGS:
        error = 0.0
        for wave in line.references_nm:
            error = max(error, _grid_error(core, rings, radius, line.symmetric, wave))
            if error > allowed and rings < RINGS[-1]:
                break
        if error <= allowed:
            break
    return rings, error


def _grid_error(core: Core, rings: int, radius: float, symmetric: bool, wave: float) -> float:
    """Return the largest error half way between two points of a grid with equidistant rings.
    Without rings, return the largest L1 distance between the core of the axis and cores off it.
    """
    if rings == 0:
        axis = core(0.0, 0.0, wave)
        return max(
            float(np.abs(core(r * radius, 0.0, wave) - axis).sum(dtype=float))
            for r in (0.5, 0.75, 1.0)
        )
    nodes = [ring * radius / rings for ring in range(rings + 1)]
    errors = [_between(core, *pair, wave) for pair in zip(nodes, nodes[1:])]
    if not symmetric:
        errors += [
            _around(core, at, 2 * np.pi / (AROUND * ring), wave)
            for ring, at in enumerate(nodes)
            if ring
        ]
    return max(errors)


def _thinned(core: Core, rings: int, radius: float, line: Meridian, allowed: float) -> Chosen:
    """Return the points of a grid that are needed, and the largest error half way between them."""

    def between(inner: float, outer: float) -> float:
        return max(_between(core, inner, outer, wave) for wave in line.references_nm)

    def around(at: float, turn_rad: float) -> float:
        return max(_around(core, at, turn_rad, wave) for wave in line.references_nm)

    points = grid.thinned(rings, radius, line.symmetric, between, around, allowed)
    counts = {place.radius: place.count for place, _ in points}
    radii = sorted(counts)
    errors = [between(*pair) for pair in zip(radii, radii[1:])]
    if not line.symmetric:
        errors += [around(r, 2 * np.pi / counts[r]) for r in radii[1:]]
    return Chosen(points, max(errors))


def _between(core: Core, inner: float, outer: float, wave: float) -> float:
    """Return the error half way between two field points on +x."""
    mean = (core(inner, 0.0, wave) + core(outer, 0.0, wave)) / 2
    return float(np.abs(mean - core((inner + outer) / 2, 0.0, wave)).sum(dtype=float))


def _around(core: Core, radius: float, turn_rad: float, wave: float) -> float:
    """Return the error half way between the field point on +x and the one at azimuth `turn_rad`."""
    mean = (core(radius, 0.0, wave) + core(radius, turn_rad, wave)) / 2
    return float(np.abs(mean - core(radius, turn_rad / 2, wave)).sum(dtype=float))

"""Openings on the device: rectangles at which surfaces behind them aim shadow rays to the sky.

A path that leaves a surface in a random direction seldom passes through a distant opening, and then
carries much light. A shadow ray towards a random point of the opening passes through it unless
something blocks it. Both techniques are weighted by their densities (balance heuristic: Veach and
Guibas 1995). Their sum is therefore unbiased for any rectangle, even if it is partly blocked or
covers only part of the mouth.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.scene import Opening

LEAST_COSINE = 1e-6  # smallest cosine between a direction and the normal of an opening


class SkyOpenings:
    """Device tables of openings. A point uses the openings that it lies behind."""

    def __init__(self, openings: Sequence[Opening]) -> None:
        """Make the tables of at least one opening."""
        first, second = (
            np.array([getattr(o, name) for o in openings], float)
            for name in ("first_m", "second_m")
        )
        outwards = np.cross(first, second)
        area = np.linalg.norm(outwards, axis=1)
        squared = lambda v: (v * v).sum(1, keepdims=True)
        table = lambda v: mi.Vector3f(*np.asarray(v, np.float32).T.tolist())
        self.count = len(openings)
        self.corner = table([o.corner_m for o in openings])
        self.first = table(first)
        self.second = table(second)
        self.normal = table(outwards / area[:, None])
        # the product with a vector from the corner is its position along a side, 0..1
        self.along = table(first / squared(first))
        self.across = table(second / squared(second))
        self.per_area = mi.Float((1 / (self.count * area)).tolist())
        dr.eval(self.corner, self.first, self.second, self.normal)
        dr.eval(self.along, self.across, self.per_area)

    def aim(self, rng: Any, place: Any, active: Any) -> tuple[Any, Any]:
        """Draw a direction towards a random point of a random opening.

        Parameters
        ----------
        rng : random numbers.
        place : point on a surface, m.
        active : lanes that take part.

        Returns
        -------
        The unit vector, and its density per solid angle; 0 where `place` is not behind the opening.
        """
        number = dr.minimum(mi.UInt32(rng.next_float32() * self.count), self.count - 1)
        take = lambda table: dr.gather(mi.Vector3f, table, number, active)
        target = take(self.corner) + take(self.first) * rng.next_float32()
        target += take(self.second) * rng.next_float32()
        way = dr.normalize(target - mi.Vector3f(place))
        behind = active & (dr.dot(way, take(self.normal)) > LEAST_COSINE)
        return way, dr.select(behind, self.density(place, way, active), 0)

    def density(self, place: Any, way: Any, active: Any) -> Any:
        """Return the density per solid angle with which `aim` draws the unit vector `way`.

        Parameters
        ----------
        place : point on a surface, m.
        way : unit vector.
        active : lanes that take part.
        """
        total = mi.Float(0)
        for k in range(self.count):
            take = lambda table, k=k: dr.gather(type(table), table, mi.UInt32(k), active)
            normal = take(self.normal)
            cosine = dr.dot(way, normal)
            to_corner = take(self.corner) - mi.Vector3f(place)
            away = dr.dot(to_corner, normal) / dr.maximum(cosine, LEAST_COSINE)
            across = way * away - to_corner
            inside = active & (cosine > LEAST_COSINE) & (away > 0)
            for side in (self.along, self.across):
                share = dr.dot(across, take(side))
                inside &= (share >= 0) & (share <= 1)
            per_angle = take(self.per_area) * dr.square(away) / dr.maximum(cosine, LEAST_COSINE)
            total += dr.select(inside, per_angle, 0)
        return total

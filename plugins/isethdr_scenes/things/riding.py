"""The points where a rider touches a bicycle, scooter or motorcycle.

Modules of two-wheelers provide them, and the module of riders uses them.
"""

from __future__ import annotations

from dataclasses import dataclass

Point = tuple[float, float, float]


@dataclass(frozen=True)
class RidingPosition:
    """Points in the coordinates of the two-wheeler, m: x forward, y left, z up from the ground.

    `feet` are where the balls of the feet rest: on pedals, pegs or the floor of a scooter. Pairs
    are (left, right).
    """

    saddle: Point  # middle of the top of the saddle, under the rider's seat bones
    grips: tuple[Point, Point]  # middles of the handlebar's grips
    feet: tuple[Point, Point]

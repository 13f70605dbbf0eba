"""Work-precision diagram of developments: error of a picture against CPU seconds."""

from __future__ import annotations

from collections.abc import Sequence

from ...accuracy.isp_cost import Cost
from ...accuracy.point import Point, Work

NETWORK = "network"


def work_of(lux: float, score: str, points: Sequence[tuple[str, float, Cost]]) -> Work:
    """Return the diagram of one illuminance.

    Parameters
    ----------
    lux : illuminance on the sensor, lux.
    score : name of the score that the errors belong to.
    points : [(setting, its mean error over held-out roads, its cost)].
    """
    return Work(
        f"pictures at {lux:g} lux",
        score,
        "true picture",
        0.0,
        [
            Point(name, error, *cost, "now" if name == NETWORK else "", name)
            for name, error, cost in points
        ],
    )

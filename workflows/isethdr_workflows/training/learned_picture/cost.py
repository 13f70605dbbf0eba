"""Cost of developments: CPU seconds and memory on one shot, and their work-precision diagram."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ...accuracy.point import Point, Work, timed

NETWORK = "network"


class Cost(NamedTuple):
    """Cost of one picture."""

    cpu_s: float  # of all threads
    peak_mb: float  # above the start; files are open


def cost_of(isp: Any, captures: Any) -> Cost:
    """Return the cost of a development: the cheapest of two calls or more."""
    _, cpu_s, peak_mb = timed(lambda: isp(captures))
    return Cost(cpu_s, peak_mb)


def work_of(lux: float, score: str, points: Sequence[tuple[str, float, Cost]]) -> Work:
    """Return the diagram of one illuminance.

    Parameters
    ----------
    score : what the errors are of.
    points : setting, its mean error over held-out roads, and its cost.
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

"""Families of vehicle lamps as tables of candela over two angles, within their regulations.

The families are models for right-hand traffic. They are designed by hand, not measured. `rules.csv`
holds the limits of each. The lamps of a bicycle rest on assumptions without a source: the front
lamp has 50 cd and only its light above the cut-off (the 1,000 cd of its core, StVZO TA 23, are left
out), and the widths of both lamps are assumed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from isethdr_core.scene import IntensityTable

from ..dipped_beam import CLASS_C, R112_B, beam_table, nodes_deg


class LampPattern(NamedTuple):
    """A table relative to its largest intensity, this intensity, cd, and the names of its rules."""

    table: IntensityTable
    intensity_cd: float
    rules: tuple[str, ...]


@dataclass(frozen=True)
class Signal:
    """A lamp with a Gaussian of both angles and a faint constant intensity."""

    axis_cd: float  # intensity on the axis
    aside_deg: float  # angle to the side at which the Gaussian has fallen to 1 / e
    up_deg: float  # the same angle upwards
    rules: tuple[str, ...] = ()
    # constant intensity / intensity on the axis. It keeps the lamp visible within 80 degrees to the
    # side and 20 degrees up and down.
    rest: float = 0.01


SIGNALS = {
    "daytime": Signal(800, 18, 8, ("daytime",)),
    "front_position": Signal(40, 14, 9, ("front_position",)),
    "rear_position": Signal(8, 14, 9, ("rear_position",)),
    "stop": Signal(90, 14, 9, ("stop",)),
    "stop_high": Signal(45, 15, 13, ("stop_high",)),
    "indicator_front": Signal(250, 14, 9, ("indicator_front",)),
    "indicator_rear": Signal(120, 14, 9, ("indicator_rear",)),
    "reversing": Signal(150, 40, 9, ("reversing",)),
    "side_marker": Signal(8, 30, 12, ("side_marker",)),
    "bicycle_front": Signal(50, 10, 5, ("bicycle_front",)),
    "bicycle_rear": Signal(5, 40, 12, ("bicycle_rear",)),
    "motorcycle_rear_position": Signal(8, 14, 9, ("rear_position",)),
    "motorcycle_stop": Signal(70, 14, 9, ("motorcycle_stop",)),
    "motorcycle_indicator_rear": Signal(120, 14, 9, ("motorcycle_indicator_rear",)),
}
# Gaussians of the driving beam, a hot spot and two wider ones: intensity, cd, and angles aside and
# up at which it has fallen to 1 / e, degrees
DRIVING = ((60_000.0, 3.2, 1.8), (12_000.0, 9.5, 3.5), (1_500.0, 25.0, 8.0))
FAMILIES = ("dipped_r112_b", "dipped_r149_c", "driving", *SIGNALS)


@cache
def family(name: str) -> LampPattern:
    """Return a lamp of `FAMILIES`."""
    if name == "dipped_r112_b":
        return LampPattern(*beam_table(R112_B), ("r112_b",))
    if name == "dipped_r149_c":
        return LampPattern(*beam_table(CLASS_C), ("r149_c",))
    if name == "driving":
        left, up = nodes_deg()
        value = sum(
            cd * np.exp(-((left / a) ** 2) - (up[:, None] / b) ** 2) for cd, a, b in DRIVING
        )
        return _pattern(left, up, value, ("r112_b_driving", "r149_b_driving"))
    signal = SIGNALS[name]
    left = np.arange(-80.0, 81.0, 2.0)
    up = np.arange(-20.0, 20.1, 1.0)
    fall = np.exp(-((left / signal.aside_deg) ** 2) - (up[:, None] / signal.up_deg) ** 2)
    value = signal.axis_cd * ((1 - signal.rest) * fall + signal.rest)
    return _pattern(left, up, value, signal.rules)


@cache
def family_of_traffic(name: str, right_hand: bool) -> LampPattern:
    """Return a lamp of `FAMILIES` for right-hand or left-hand traffic. That of left-hand traffic is
    mirrored, so that its cut-off rises on the left.
    """
    pattern = family(name)
    if right_hand:
        return pattern
    table = pattern.table
    mirrored = IntensityTable(-table.left_deg[::-1], table.up_deg, table.value[:, ::-1].copy())
    return pattern._replace(table=mirrored)


def _pattern(
    left: np.ndarray, up: np.ndarray, value: np.ndarray, rules: Sequence[str]
) -> LampPattern:
    peak = float(value.max())
    return LampPattern(IntensityTable(left, up, value / peak), peak, rules)

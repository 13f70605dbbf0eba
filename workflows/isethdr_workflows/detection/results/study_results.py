"""All results of a study."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..observer.observing import Check, Observer
from ..questions import Question
from .levels import Crossing
from .shares import Found, Needed


@dataclass(frozen=True)
class CurvePoint:
    """Share of objects found, or of pairs told apart, by one camera at one level of light.

    Parameters
    ----------
    difference : difference from the first camera for the same objects; NaN for the first camera.
        `difference_low` and `difference_high` are its interval.
    """

    camera: str
    level: float
    found: float
    low: float
    high: float
    objects: int
    roads: int
    difference: float = math.nan
    difference_low: float = math.nan
    difference_high: float = math.nan


@dataclass(frozen=True)
class Results:
    """All results of a study."""

    dataset: str
    question: str
    asked: Question
    how: Observer
    cameras: tuple[str, ...]
    overrides: tuple[str, ...]
    rows: tuple[Found, ...]
    checks: Mapping[str, Check]
    needed: tuple[Needed, ...] = ()
    curve: tuple[CurvePoint, ...] = ()
    crossings: Mapping[str, Crossing] = field(default_factory=dict)
    counted_curve: tuple[CurvePoint, ...] = ()  # share of pairs told apart by counting
    counted_crossings: Mapping[str, Crossing] = field(default_factory=dict)
    failed: tuple[tuple[int, str], ...] = ()

    @property
    def roads(self) -> int:
        """The number of roads."""
        return len({one.road for one in self.rows})

"""Texts of the numbers on the pages of a study: shares with intervals, roads, crossings, d'."""

from __future__ import annotations

import math

from ...dataset.study.intervals import Mean
from .levels import Crossing
from .shares import FEWEST_ROADS
from .study_results import CurvePoint


def share_text(mean: Mean) -> str:
    """Return a share, or a difference of shares, as text: `0.787 (0.516 to 1.000)`."""
    if not math.isfinite(mean.value):
        return "–"
    if not math.isfinite(mean.low):
        return _thousandths(mean.value)
    low = _thousandths(mean.low)
    return f"{_thousandths(mean.value)} ({low} to {_thousandths(mean.high)})"


def found_text(point: CurvePoint) -> str:
    """Return the share of a point of a curve with its interval as text."""
    return share_text(Mean(point.found, point.low, point.high, point.objects, point.roads))


def less_text(point: CurvePoint) -> str:
    """Return the difference from the first camera with its interval as text; a dash for the first
    camera itself.
    """
    low = point.difference_low
    high = point.difference_high
    return share_text(Mean(point.difference, low, high, point.objects, point.roads))


def d_text(mean: Mean) -> str:
    """Return d' with its interval as text: `12.4 (9.8 to 1206)`."""
    if not math.isfinite(mean.value):
        return "–"
    if not math.isfinite(mean.low):
        return _three_digits(mean.value)
    return f"{_three_digits(mean.value)} ({_three_digits(mean.low)} to {_three_digits(mean.high)})"


def crossing_text(one: Crossing) -> str:
    """Return a crossing as text: `0.052 (0.031 to 0.083)`."""
    if not math.isfinite(one.level):
        return "none within the levels"
    if not math.isfinite(one.low):
        return f"{one.level:.3g} (no interval)"
    return f"{one.level:.3g} ({one.low:.3g} to {one.high:.3g})"


def roads_text(roads: float) -> str:
    """Return the number of roads needed as text. Numbers up to `FEWEST_ROADS` share one text."""
    if not math.isfinite(roads):
        return "–"
    if roads <= FEWEST_ROADS:
        return f"{FEWEST_ROADS} or fewer"
    return str(math.ceil(roads))


def number(value: float) -> str:
    """Return a number as text with three digits; a dash if it is not known."""
    return f"{value:.3g}" if math.isfinite(value) else "–"


def _thousandths(value: float) -> str:
    return f"{round(value, 3) + 0.0:.3f}"  # adding zero turns -0.0 into 0.0


def _three_digits(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"  # no powers of ten

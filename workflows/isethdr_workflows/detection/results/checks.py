"""Checks of the observer by counting, and the tables of pairs told apart by counting."""

from __future__ import annotations

from ..observer.observing import CHECKED, Check
from .shares import Line, counted, lines
from .study_results import Results

# counted false alarms over stated ones, above which the page warns that other roads did not show
# the clutter
TOO_MANY = 2.0
OVERSTATED = 0.05  # share of objects stated minus share counted, above which the page warns
# titles of the tables that are repeated for counted pairs
COUNTED_TABLES = ("all", "class", "light", "light and distance")


def too_many(check: Check) -> bool:
    """Return whether far more places without an object exceed the threshold than stated."""
    return check.false_alarms > TOO_MANY * CHECKED * check.places


def overstated(check: Check) -> bool:
    """Return whether counting finds far fewer objects than the observer states."""
    return check.expected - check.hits > OVERSTATED * check.trials


def counted_lines(results: Results) -> list[Line]:
    """Return the tables of pairs told apart by counting; none if the study has curves."""
    if results.curve:
        return []
    tables = lines(counted(results.rows), results.cameras)
    return [line for line in tables if line.table in COUNTED_TABLES]

"""Rules of luminous intensity: read from `rules.csv`, and checked against any table of candela."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.scene import IntensityTable

STEP_DEG = 0.05  # spacing of the directions at which boxes and polygons are sampled
MOST_TRIED = 400  # largest number of steps along one side of a box


@dataclass(frozen=True)
class Rule:
    """One rule. `places` are points, the corners of a polygon, or two opposite corners of a box."""

    name: str
    kind: str  # point, sum, box, polygon, largest
    places: tuple[tuple[float, float], ...]  # degrees left and up
    least_cd: float
    most_cd: float
    of: str  # name of the rule; its largest intensity multiplies both limits; empty: none
    source: str


@dataclass(frozen=True)
class Finding:
    """Least and largest intensity of a lamp at the places of a rule, and the limits, cd."""

    rule: Rule
    low_cd: float
    high_cd: float
    least_cd: float
    most_cd: float

    @property
    def is_met(self) -> bool:
        """Return whether the rule is met."""
        return self.low_cd >= self.least_cd and self.high_cd <= self.most_cd


@cache
def rule_sets() -> dict[str, tuple[Rule, ...]]:
    """Return all sets of rules by name."""
    text = files(__package__).joinpath("rules.csv").read_text(encoding="utf-8").splitlines()
    grouped: dict[tuple[str, str], list[dict[str, str]]] = {}
    for row in csv.DictReader(line for line in text if not line.startswith("#")):
        grouped.setdefault((row["set"], row["name"]), []).append(row)
    out: dict[str, list[Rule]] = {}
    for (name, _), rows in grouped.items():
        out.setdefault(name, []).append(_rule(rows))
    return {name: tuple(rules) for name, rules in out.items()}


def check(table: IntensityTable, intensity_cd: float, rules: str) -> list[Finding]:
    """Return the findings for a lamp, one for each rule of a set.

    Parameters
    ----------
    table, intensity_cd : the lamp; its intensity, cd, is their product.
    rules : name of a set of `rule_sets`.

    Raises
    ------
    ConfigError : there is no such set.
    """
    sets = rule_sets()
    if rules not in sets:
        raise ConfigError(f"there is no set of rules {rules!r}{did_you_mean(rules, sets)}")
    findings: dict[str, Finding] = {}
    # rules that other rules refer to come first
    for rule in sorted(sets[rules], key=lambda r: bool(r.of)):
        values = intensity_cd * _values(table, rule)
        factor = findings[rule.of].high_cd if rule.of else 1.0
        limits = rule.least_cd * factor, rule.most_cd * factor
        findings[rule.name] = Finding(rule, float(values.min()), float(values.max()), *limits)
    return [findings[rule.name] for rule in sets[rules]]


def _rule(rows: Sequence[dict[str, str]]) -> Rule:
    first = rows[0]
    places = [(float(r["left_deg"] or 0), float(r["up_deg"] or 0)) for r in rows]
    if first["kind"] == "box":
        places.append((float(first["left_to_deg"]), float(first["up_to_deg"])))
    return Rule(
        first["name"],
        first["kind"],
        tuple(places),
        float(first["least_cd"] or 0),
        float(first["most_cd"] or math.inf),
        first["of"],
        first["source"],
    )


def _values(table: IntensityTable, rule: Rule) -> np.ndarray:
    left, up = np.array(rule.places).T
    if rule.kind == "largest":
        return table.value.max(keepdims=True)
    if rule.kind == "point":
        return table.at(left, up)
    if rule.kind == "sum":
        return table.at(left, up).sum(keepdims=True)
    across, along = (_steps(v.min(), v.max()) for v in (left, up))
    x, y = (v.ravel() for v in np.meshgrid(across, along))
    if rule.kind == "polygon":
        inside = within(rule.places, x, y)
        x = x[inside]
        y = y[inside]
    return table.at(x, y)


def _steps(low: float | np.ndarray, high: float | np.ndarray) -> np.ndarray:
    return np.linspace(low, high, min(round((high - low) / STEP_DEG), MOST_TRIED) + 1)


def within(corners: tuple[tuple[float, float], ...], x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return which points lie in a polygon or on its border.

    A point lies inside if a ray from it to the right crosses the border an odd number of times.

    Parameters
    ----------
    corners : corners (x, y) of the polygon, in order.
    x : first coordinates of the points, any shape.
    y : second coordinates of the points, of the same shape.
    """
    odd = np.zeros(np.shape(x), bool)
    border = np.zeros(np.shape(x), bool)
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0])):
        if y0 != y1:
            at = x0 + (y - y0) / (y1 - y0) * (x1 - x0)
            odd ^= ((y0 > y) != (y1 > y)) & (x < at)
        length = np.hypot(x1 - x0, y1 - y0)
        along = ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / length
        off = np.abs((x - x0) * (y1 - y0) - (y - y0) * (x1 - x0)) / length
        border |= (off < 1e-9) & (along >= 0) & (along <= length)
    return odd | border

"""Scores: one row per metric and object."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Score:
    """One number about one picture, or one object in it; `low` and `high` bound it at 95 % or are NaN."""

    metric: str
    value: float
    unit: str
    object: str = ""
    low: float = float("nan")
    high: float = float("nan")

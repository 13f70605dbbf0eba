"""Noise realisations: the same shot with several draws of the noise, so that every score has a 95 %
interval.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ..data.scores import Score, half_interval
from ..uncertainty import ledger
from ..uncertainty.score_intervals import UNKNOWN, RendererError, ScoreKey, interval, key_of


def over_draws(
    draws: list[list[Score]], renderer: Mapping[ScoreKey, RendererError] | None = None
) -> list[Score]:
    """Return each score of the first draw as its mean over all draws, with the interval of this
    mean.

    Parameters
    ----------
    draws : the scores of each draw, at least one. A score that is missing or not finite in some
        draw keeps its value of the first draw and has no interval.
    renderer : the error of each score due to renderer noise; a score that is missing here has none.

    Notes
    -----
    The interval covers shot, read and reset noise, and renderer noise if it is known
    (`score_intervals`). The device's fixed pattern is the same in all draws. The interval that a
    metric gives for one picture is replaced, because it describes the variation over the pixels of
    that picture.
    """
    renderer = renderer or {}
    tables = [{key_of(score): score.value for score in scores} for scores in draws]
    means = []
    for score in draws[0]:
        key = key_of(score)
        values = [table.get(key, math.nan) for table in tables]
        means.append(_mean(score, values, renderer.get(key)))
    return means


def _mean(score: Score, values: list[float], renderer: RendererError | None) -> Score:
    if not all(map(math.isfinite, values)):
        return replace(score, low=UNKNOWN.low, high=UNKNOWN.high)
    low, high = interval(values, renderer)
    return replace(score, value=math.fsum(values) / len(values), low=low, high=high)


def state_spread(scores: list[Score], count: int) -> None:
    """State in the ledger the widest relative half interval of the scores of whole pictures."""
    relative = [
        half_interval(s) / abs(s.value)
        for s in scores
        if not s.object and s.value and math.isfinite(half_interval(s))
    ]
    ledger.error(
        max(relative, default=0.0),
        "relative",
        "statistical",
        f"scores of the whole picture, 95 %, over {count} noise realisations",
    )

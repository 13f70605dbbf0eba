"""Draws: the same shot with other noise, so that every score comes with how much it would differ the next time."""

from __future__ import annotations

import math

from . import ledger
from .scores import Score, half_interval

CONFIDENCE = 0.95


def over_draws(draws: list[list[Score]]) -> list[Score]:
    """Return the scores of the first draw as means over all draws, with Student's 95 % interval of that mean.

    Parameters
    ----------
    draws : the scores of each draw, at least one. A score that some draw lacks, or whose value is not finite in one,
        stays as the first draw has it, with the interval that its metric gave it.

    Notes
    -----
    The interval covers shot, read and reset noise; the device's fixed pattern is the same in all draws (Student 1908).
    """
    tables = [{(s.metric, s.object, s.unit): s.value for s in scores} for scores in draws]
    return [_mean(score, [t.get((score.metric, score.object, score.unit), math.nan) for t in tables]) for score in draws[0]]


def _mean(score: Score, values: list[float]) -> Score:
    from scipy.special import stdtrit

    count = len(values)
    if count < 2 or not all(map(math.isfinite, values)):
        return score
    mean = math.fsum(values) / count
    deviation = math.sqrt(math.fsum((v - mean) ** 2 for v in values) / (count - 1))
    half = float(stdtrit(count - 1, (1 + CONFIDENCE) / 2)) * deviation / math.sqrt(count)
    return Score(score.metric, mean, score.unit, score.object, mean - half, mean + half)


def state_spread(scores: list[Score], count: int) -> None:
    """State in the ledger the widest relative half interval of the scores of whole pictures."""
    relative = [half_interval(s) / abs(s.value) for s in scores if not s.object and s.value and math.isfinite(half_interval(s))]
    ledger.error(max(relative, default=0.0), "relative", "statistical", f"scores of the whole picture, 95 %, over {count} draws of the noise")

"""Score intervals: one 95 % interval per score, over sensor noise and renderer noise together.

The interval is for the score of one camera on one scene. That score is the mean over all shots of
the same device, of the scene's light without renderer noise. Noise realisations show how far the
mean of a few shots is from the mean of all shots. Changed scenes show how far renderer noise moves
it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from scipy.special import ndtri, stdtrit

from ..data.scores import Score

CONFIDENCE = 0.95

ScoreKey = tuple[str, str, str]  # metric, unit, object


def key_of(score: Score) -> ScoreKey:
    """Return the key of a score among those of one picture."""
    return score.metric, score.unit, score.object


class RendererError(NamedTuple):
    """How far renderer noise moves one score, from a few changed scenes; in the unit of the
    score.
    """

    standard_error: float  # error of one rendering, without that which all renderings share
    degrees_of_freedom: float  # degrees of freedom of `standard_error`
    more_noise: float = 0.0  # mean change of the score if the scene has more renderer noise
    less_noise: float = 0.0  # change of the score if renderer noise is smoothed away


NOT_MEASURED = RendererError(math.nan, math.nan)


class Interval(NamedTuple):
    """Both ends of an interval, in the unit of the score."""

    low: float
    high: float


UNKNOWN = Interval(math.nan, math.nan)


def interval(values: list[float], renderer: RendererError | None = None) -> Interval:
    """Return the 95 % interval of a score from its values in several shots.

    Parameters
    ----------
    values : the score in each shot, at least two for an interval, in any unit.
    renderer : the error that renderer noise leaves in the mean of `values`; None if there is none.

    Returns
    -------
    The interval. It is NaN for fewer than two values, if a value is not finite, or if the
    renderer's part is `NOT_MEASURED`.

    Notes
    -----
    The two noises are independent, so their variances add. The degrees of freedom of the sum are
    those of Satterthwaite 1946, eq. 17; the factor is that of Student 1908. Renderer noise also
    shifts the mean of a score that is not linear in light. The shifts with more and with less noise
    show the size of that shift, not its exact value. So both count as standard deviations of
    further normal errors.
    """
    count = len(values)
    if count < 2 or not all(map(math.isfinite, values)):
        return UNKNOWN
    mean = math.fsum(values) / count
    noise_variance = math.fsum((v - mean) ** 2 for v in values) / (count - 1) / count
    if renderer is None:
        half = student_factor(count - 1) * math.sqrt(noise_variance)
        return Interval(mean - half, mean + half)
    variances = (noise_variance, renderer.standard_error**2)
    if math.isnan(renderer.standard_error):
        return UNKNOWN
    freedom = degrees_of_freedom(variances, (count - 1, renderer.degrees_of_freedom))
    scatter = student_factor(freedom) * math.sqrt(sum(variances))
    shift = student_factor(math.inf) * math.hypot(renderer.more_noise, renderer.less_noise)
    half = math.hypot(scatter, shift)
    return Interval(mean - half, mean + half)


def degrees_of_freedom(variances: tuple[float, ...], freedoms: tuple[float, ...]) -> float:
    """Return the degrees of freedom of a sum of estimated variances (Satterthwaite 1946, eq. 17).

    The result is infinite if all variances are 0, or if those above 0 are known exactly.
    """
    largest = max(variances)
    if largest == 0.0:
        return math.inf
    # over the largest: the square of a small variance would underflow
    shares = [variance / largest for variance in variances]
    spread = math.fsum(s**2 / f for s, f in zip(shares, freedoms, strict=True))
    return math.fsum(shares) ** 2 / spread if spread else math.inf


def student_factor(freedom: float) -> float:
    """Return half of a 95 % interval in standard errors, for these degrees of freedom."""
    upper = (1 + CONFIDENCE) / 2
    return float(ndtri(upper) if math.isinf(freedom) else stdtrit(freedom, upper))

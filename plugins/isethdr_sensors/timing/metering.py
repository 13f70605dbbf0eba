"""Metering: the level of the mean electrons that an exposure rule measures.

| rule         | metered level, as a share of a capture's full scale                         |
|--------------|-----------------------------------------------------------------------------|
| `centre`     | mean over pixels, clipped at 1, under a Gaussian a quarter of the diagonal  |
| `histogram`  | median over pixels, which does not depend on lamps                          |
| `percentile` | a percentile over pixels                                                    |
| `highlights` | brightest pixel that is no lamp, in the capture that fills last             |
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

RULES = ("fixed", "centre", "histogram", "percentile", "highlights")
LAMP_PERCENTILE = 95.0  # percentile of the pixels; much brighter pixels count as lamps


class Metering(NamedTuple):
    """The pixels and the level that are metered."""

    rule: str
    percentile: float  # of the rule `percentile`
    lamp_ratio: float  # of a lamp over `LAMP_PERCENTILE`; inf: nothing is a lamp


def meter(how: Metering, share: np.ndarray) -> Callable[[float], float]:
    """Return the metered level as a function of a factor on the light, rising with it.

    Parameters
    ----------
    share : (capture, y, x) electrons over the full scale of each capture, at a factor of 1.
    """
    if how.rule == "highlights":
        brightest = min(_brightest(plane, how.lamp_ratio) for plane in share)
        return lambda factor: brightest * factor
    first = share[0]
    if how.rule in ("histogram", "percentile"):
        level = (
            np.median(first) if how.rule == "histogram" else np.percentile(first, how.percentile)
        )
        return lambda factor: float(level * factor)
    height, width = first.shape
    y = np.arange(height)[:, None] - (height - 1) / 2
    x = np.arange(width) - (width - 1) / 2
    weight = np.exp(-(y**2 + x**2) / 2 / ((height**2 + width**2) / 16))
    weight /= weight.sum()
    return lambda factor: float(np.sum(weight * np.minimum(first * factor, 1.0)))


def _brightest(plane: np.ndarray, lamp_ratio: float) -> float:
    """Return the brightest of the pixels (y, x) that are no lamps."""
    if np.isinf(lamp_ratio):
        return float(plane.max())
    limit = lamp_ratio * float(np.percentile(plane, LAMP_PERCENTILE))
    return float(plane[plane <= limit].max())  # the least pixels always lie below

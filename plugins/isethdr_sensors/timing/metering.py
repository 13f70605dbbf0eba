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
LAMP_PERCENTILE = 95.0  # percentile of the pixels to which lamps are compared


class Metering(NamedTuple):
    """Rule and parameters of metering."""

    rule: str
    percentile: float  # percentile of the rule `percentile`
    # level above which a pixel counts as a lamp / level at `LAMP_PERCENTILE`; inf: no pixel does
    lamp_ratio: float


def meter(how: Metering, share: np.ndarray) -> Callable[[float], float]:
    """Return the metered level as an increasing function of a factor on the light.

    Parameters
    ----------
    how : rule and parameters.
    share : (capture, y, x) electrons / full scale of each capture, at a factor of 1.
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
    """Return the level of the brightest pixel (y, x) that is no lamp."""
    if np.isinf(lamp_ratio):
        return float(plane.max())
    limit = lamp_ratio * float(np.percentile(plane, LAMP_PERCENTILE))
    return float(plane[plane <= limit].max())  # 95 % of the pixels always remain

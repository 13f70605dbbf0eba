"""Share within: the limit that a share of uncertain errors does not exceed."""

from __future__ import annotations

import numpy as np
from scipy.special import erf

SHARE = 0.99  # share of the pixels within the figure that is stated for a picture
MOST_PIXELS = 65536  # largest regular sample of pixels
# relative tolerance of a figure: a figure with more errors is never smaller than one with fewer,
# except by this
CLOSE = 1e-9
SMALL = 1e-30  # share of the largest error; smaller limits count as 0


def within(bound: np.ndarray, deviation: np.ndarray, share: float = SHARE) -> float:
    """Return the limit that a share of all errors does not exceed.

    Each error is a bound plus the magnitude of a normal deviate.

    Parameters
    ----------
    bound : bound of each error, any shape and unit.
    deviation : standard deviation of each error's normal part, same shape and unit.
    share : share of the errors, above 0 and below 1.
    """
    from scipy.optimize import brentq

    step = max(1, bound.size // MOST_PIXELS) | 1  # odd: every colour of a filter array is sampled
    bound, deviation = (np.ravel(a)[::step].astype(float) for a in (bound, deviation))
    normal = deviation > 0
    scale = np.sqrt(2) * np.where(normal, deviation, 1.0)

    def missing(limit: float) -> float:
        with np.errstate(over="ignore"):  # the argument may overflow; erf(inf) is 1
            within_deviation = erf(np.maximum(limit - bound, 0.0) / scale)
        below = np.where(limit >= bound, np.where(normal, within_deviation, 1.0), 0.0)
        return target - float(below.mean())

    # just below `share`: the root is then the smallest limit with that share
    target = float(np.nextafter(share, 0.0))
    highest = float((bound + 10 * deviation).max())
    if not np.isfinite(highest) or missing(highest) > 0:
        return highest  # an error is infinite, or most errors are bounds of this value
    if missing(0.0) <= 0:
        return 0.0  # this share of the errors is exactly 0
    # Errors without a normal part make `missing` a function with steps. Brent's method then halves
    # the interval in each iteration, so that many iterations are allowed.
    xtol = SMALL * highest
    return float(brentq(missing, 0.0, highest, xtol=xtol, rtol=CLOSE, maxiter=1000))

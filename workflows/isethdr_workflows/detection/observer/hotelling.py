"""The channelised Hotelling observer: detectability, and the share of objects that it finds.

The best linear observer of channel outputs v knows the mean difference D that an object makes, and
the covariance K of v without the object. Its detectability is d'^2 = D' K^-1 D (Barrett and Myers,
Foundations of Image Science, 2004, section 13.2.12; Myers and Barrett 1987; Gallas and Barrett
2003).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import ndtr, ndtri


class Detectability(NamedTuple):
    """Detectability of an object in clutter and noise."""

    d: float  # d' against clutter and noise, corrected for a small number of windows
    noise_only: float  # d' against noise alone
    plain: float  # d' against clutter and noise, from the sample covariance without correction


def detectability(
    difference: np.ndarray,
    clutter: np.ndarray,
    noise: np.ndarray,
    samples: int,
    render: np.ndarray | None = None,
) -> Detectability:
    """Return the detectability of an object.

    Parameters
    ----------
    difference : (channel,) mean output with the object, minus that without it.
    clutter : (channel, channel) sample covariance over windows without objects.
    noise : (channel, channel) covariance of the noise, which is known.
    samples : number of windows behind `clutter`.
    render : (channel,) half of the difference of the renderer's half buffers in the object, which
        is another value of the renderer's noise in `difference`; None: it is not known.

    Notes
    -----
    Noise of the renderer in an object looks like signal: it adds trace(K^-1 C_render) to d'^2 on
    average. `render`, R here, has the same covariance, so D'K^-1 D - R'K^-1 R has no such bias.

    The inverse of a sample covariance is too large on average: with nu = n - 1 degrees of freedom
    and p channels, E[S^-1] = nu / (nu - p - 1) C^-1 (Anderson 2003, An Introduction to Multivariate
    Statistical Analysis, lemma 7.7.1). Here known noise is added to S, so the inverse is affected
    less. Let q = D'K^-1 S K^-1 D / d'^2 be the share of clutter, and p_e = trace(K^-1 S) the number
    of channels in which clutter dominates. Then d'^2 is divided by
    1 + q (p_e + 1) / (nu - p_e - 1). This factor is exact without noise, it is 1 without clutter,
    and between both it is right to first order in 1 / nu.
    """
    together = cho_factor(clutter + noise)
    template = cho_solve(together, difference)
    square = float(difference @ template)
    by_noise = cho_factor(noise)
    alone = float(difference @ cho_solve(by_noise, difference))
    if render is not None:
        square -= float(render @ cho_solve(together, render))
        alone -= float(render @ cho_solve(by_noise, render))
    if square <= 0:
        return Detectability(0.0, np.sqrt(max(alone, 0.0)), 0.0)
    share = min(float(template @ clutter @ template) / square, 1.0)
    ruled = float(np.trace(cho_solve(together, clutter)))
    left = samples - 2 - ruled  # nu - p_e - 1
    factor = 1 + share * (ruled + 1) / left if left > 0 else np.inf
    return Detectability(
        float(np.sqrt(square / factor)), float(np.sqrt(max(alone, 0.0))), float(np.sqrt(square))
    )


def template(difference: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Return the weights (channel,) that the observer gives to the outputs.

    Parameters
    ----------
    difference : (channel,) mean output with the object, minus that without it.
    covariance : (channel, channel) covariance of clutter and noise.
    """
    return cho_solve(cho_factor(covariance), difference)


def threshold(false_alarms: float, places: float) -> float:
    """Return the threshold, in standard deviations, that is exceeded `false_alarms` times on
    average in `places` places without an object.

    Parameters
    ----------
    false_alarms : false alarms in a picture.
    places : places that are examined in a picture, more than `false_alarms`.
    """
    return float(ndtri(1 - false_alarms / places))


def found(d: np.ndarray | float, limit: float) -> np.ndarray:
    """Return the probability that objects of detectability `d` exceed the threshold `limit`, both
    in standard deviations.
    """
    return ndtr(np.asarray(d, float) - limit)

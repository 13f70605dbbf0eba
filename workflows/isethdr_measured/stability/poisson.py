"""Poisson counts: the quantile of the distribution for each random word, compared with sums of the
distribution in long double.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from fractions import Fraction
from statistics import NormalDist
from typing import Any

import numpy as np
from isethdr_sensors.readout.shot import readings

from isethdr_core import generator
from isethdr_core.physics.detector.noise import poisson
from isethdr_core.physics.detector.random_words import words
from isethdr_core.plugins.registry import build

from .verdict import Measured


def cases() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield (case, measure)."""
    yield "mean 0", lambda: Measured(float(np.abs(_counts(0.0)).max()), 0.0, "0 e")
    yield "mean 1e-12, at the step to 1 e", lambda: step_to_one(1e-12)
    yield "mean 1e-18, at the step to 1 e", lambda: step_to_one(1e-18)
    for mean in (0.5, 30.0, 1e3, 1e6, 1e9):
        yield f"mean {mean:g}", lambda m=mean: quantiles(m)
    yield "mean 1e18", largest
    yield "mean 2e18 in a well without end: all saturated", too_many


def _words(count: int = 400) -> np.ndarray:
    return words(("stability",), 0, 1, 0, count)[0]


def _counts(mean: float) -> np.ndarray:
    word = _words()
    return poisson(np.full(word.shape, mean), word)


def step_to_one(mean: float) -> Measured:
    """Compare the counts of random words just above and below the step from 0 to 1 e. A word w >= 0
    stands for the probability (w + 1/2) 2^-64 of a larger count.
    """
    m = Fraction(mean)
    # the next term, m^3 / 6, is below 1e-17 of a word
    edge = (m - m**2 / 2) * 2**64 - Fraction(1, 2)
    near = [w for w in (math.floor(edge) + k for k in range(-3, 4)) if w >= 0]
    # the probability is float64; its relative error of 1e-16 moves the step by less than one word
    # for words up to 2^53
    counts = poisson(np.full(len(near), mean), np.array(near, np.int64))
    expected = np.array([1.0 if w < edge else 0.0 for w in near])
    return Measured(float(np.abs(counts - expected).max()), 0.0, "series in fractions, e")


def quantiles(mean: float) -> Measured:
    """Compare counts with the quantiles of the distribution, which is summed in long double to 12
    standard deviations on both sides of its peak.
    """
    word = _words()
    counts = _counts(mean)
    reach = int(12 * math.sqrt(mean) + 30)
    k = np.arange(max(0, int(mean) - reach), int(mean) + reach + 1)
    steps = np.log(np.longdouble(mean)) - np.log(k[1:].astype(np.longdouble))
    log = np.concatenate([[np.longdouble(0)], np.cumsum(steps)])
    weight = np.exp(log - log.max())
    tail = (np.where(word < 0, -1 - word, word).astype(np.longdouble) + 0.5) * np.longdouble(
        2
    ) ** -64
    # each tail is summed from its own end, so that small probabilities keep their digits
    at_most = np.cumsum(weight) / weight.sum()
    at_least = np.cumsum(weight[::-1]) / weight.sum()
    low = np.searchsorted(at_most, tail)
    high = len(k) - 1 - np.searchsorted(at_least, tail)
    expected = k[np.where(word < 0, low, high)]
    return Measured(
        float(np.abs(counts - expected).max()),
        0.0 if mean < 1e6 else 1.0,
        "distribution summed in long double, e",
    )


def too_many() -> Measured:
    """Check that more electrons than can be counted are marked as saturated, even in a well without
    a limit.
    """
    sensor = build("sensor", "single", bits=0, swing_v=1e20, full_well_e=math.inf)
    saturated = readings(sensor.model(), [np.full((8, 8), 2e18)], generator(1))[1]
    return Measured(
        float(np.mean(~saturated)), 0.0, "share of pixels that do not say they are saturated"
    )


def largest() -> Measured:
    """Compare counts of mean 1e18 with the Cornish-Fisher expansion. Its own error is below 1e-6 e
    here. It is computed in integers, because float64 has too few digits.
    """
    word = _words()
    counts = _counts(1e18)
    tail = ((np.where(word < 0, -1 - word, word).astype(float) + 0.5) * 2.0**-64).tolist()
    z = [
        NormalDist().inv_cdf(p) * (-1 if upper else 1)
        for p, upper in zip(tail, (word >= 0).tolist())
    ]
    expected = [10**18 + math.floor(1e9 * v + (v * v + 2) / 6) for v in z]
    # the normal quantile in float64 has an error of a few 1e-16; times 1e9, that is below 1e-6 e
    return Measured(
        float(max(abs(int(f) - w) for f, w in zip(counts, expected))),
        128.0,
        "Cornish-Fisher in whole numbers, e",
    )

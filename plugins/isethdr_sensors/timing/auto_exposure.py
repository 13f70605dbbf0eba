"""Automatic exposure: the time at which the metered level of the mean electrons meets its target.
Noise does not enter.

| rule         | metered level, as a share of the scale of a capture                      |
|--------------|--------------------------------------------------------------------------|
| `centre`     | mean over pixels, weighted by a Gaussian, a quarter of the diagonal wide |
| `histogram`  | median over pixels: half of them lie below it, whatever the lamps do     |
| `highlights` | brightest pixel, in the capture that fills last                          |

All captures keep their shares of the exposure, so several exposures form a bracket around the
solved one; or each is solved on its own (`exposed_each`).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.temporal_modulation import time_mean
from isethdr_core.errors import ConfigError, did_you_mean

RULES = ("fixed", "centre", "histogram", "highlights")
LOG_TOLERANCE = 1e-12  # of the natural logarithm of the exposure


def check(sensor) -> None:
    """Refuse a rule, a target or limits that no exposure can meet."""
    if sensor.exposure_rule not in RULES:
        raise ConfigError(
            "sensor.exposure_rule is"
            f" {sensor.exposure_rule!r}{did_you_mean(sensor.exposure_rule, RULES)}; expected one of"
            f" {', '.join(RULES)}"
        )
    if not 0 < sensor.exposure_target < 1:
        raise ConfigError(
            f"sensor.exposure_target is {sensor.exposure_target!r}; expected a share of the full"
            " scale between 0 and 1; type sensor.exposure_target=0.5"
        )
    if not 0 < sensor.exposure_min_s <= sensor.exposure_max_s <= 3600:
        raise ConfigError(
            f"sensor.exposure_min_s, exposure_max_s are {sensor.exposure_min_s!r},"
            f" {sensor.exposure_max_s!r}; expected seconds above 0, at most 3600, the smaller one"
            " first"
        )


def exposed(sensor, light, generator):
    """Return the captures of `sensor` at the exposure solved for this light; attribute
    `exposure_iterations` says in how many steps.
    """
    exposure_s, iterations = solve(sensor, light)
    out = replace(sensor, exposure_rule="fixed", exposure_s=exposure_s)(light, generator)
    out.attrs["exposure_iterations"] = iterations
    return out


def exposed_each(sensor, light, generator):
    """Return the captures of a staggered sensor with every exposure solved: the first by the rule,
    the last for the brightest pixel.

    Those between lie at equal ratios. Where the first already keeps the brightest pixel, the shares
    stay as they are: the bracket is then wider than the light.
    """
    first_s, iterations = solve(replace(sensor, exposure_each=False), light)
    last_s, more = solve(
        replace(sensor, exposure_each=False, exposure_rule="highlights", exposure_ratios=(1.0,)),
        light,
    )
    fixed = replace(sensor, exposure_rule="fixed", exposure_s=first_s)
    count = len(sensor.exposure_ratios)
    if count > 1 and last_s < first_s:
        fixed = replace(
            fixed,
            exposure_ratios=tuple(float(r) for r in np.geomspace(1.0, last_s / first_s, count)),
        )
    out = fixed(light, generator)
    out.attrs["exposure_iterations"] = iterations + more
    return out


def solve(sensor, light) -> tuple[float, int]:
    """Return the exposure in seconds and the iterations of Brent's method; the residual goes to the
    ledger.

    Mean electrons, dark charge included, are proportional to the exposure, so they are computed
    once. Light that varies in time is metered by its mean over time: a camera meters over many
    frames. A target out of reach within the limits gives the nearer limit.
    """
    from scipy.optimize import brentq

    share_per_s = (
        sensor.expected(time_mean(light)).values
        / np.reshape(sensor.full_scale_e(), (-1, 1, 1))
        / sensor.exposure_s
    )
    level = _meter(sensor.exposure_rule, share_per_s)
    shortest, longest, target = sensor.exposure_min_s, sensor.exposure_max_s, sensor.exposure_target
    iterations, exposure_s = 0, None
    if level(longest) <= target:
        exposure_s, limit = longest, "exposure_max_s"
    elif level(shortest) >= target:
        exposure_s, limit = shortest, "exposure_min_s"
    if exposure_s is None:
        log_s, run = brentq(
            lambda u: np.log(level(np.exp(u)) / target),
            np.log(shortest),
            np.log(longest),
            xtol=LOG_TOLERANCE,
            full_output=True,
        )
        exposure_s, iterations, limit = float(np.exp(log_s)), run.iterations, ""
    reached = f"at its limit {limit}" if limit else f"after {iterations} iterations"
    ledger.error(
        abs(level(exposure_s) / target - 1),
        "relative",
        "measured",
        f"metered level, {sensor.exposure_rule}, against its target, {reached}",
    )
    return exposure_s, iterations


def _meter(rule: str, share_per_s):
    """Return the metered level as a function of the exposure in seconds, from the shares (capture,
    y, x) filled per second.
    """
    if rule == "highlights":
        brightest = share_per_s.max(axis=(1, 2)).min()
        return lambda t: brightest * t
    first = share_per_s[0]
    if rule == "histogram":
        middle = np.median(first)
        return lambda t: middle * t
    height, width = first.shape
    y, x = np.arange(height)[:, None] - (height - 1) / 2, np.arange(width) - (width - 1) / 2
    weight = np.exp(-(y**2 + x**2) / 2 / ((height**2 + width**2) / 16))
    weight /= weight.sum()
    return lambda t: float(np.sum(weight * np.minimum(first * t, 1.0)))

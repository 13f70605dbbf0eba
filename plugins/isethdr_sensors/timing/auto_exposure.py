"""Automatic exposure and gain: the exposure time, then the analog gain, at which the metered level
of the mean electrons meets its target. Noise has no influence.

The exposure is solved first, within the limits of motion and flickering lamps. If the metered level
is then below the target, the analog gain is raised, up to the factor `auto_gain_max`. All captures
keep their shares of the exposure, so that several exposures follow the solved one in fixed ratios.
Alternatively the first and the last exposure are solved separately (`exposure_each`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.data.derived_once import once
from isethdr_core.data.temporal_modulation import time_mean
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.sequence.exposure import Exposure, ExposureLimits, SettledExposure

from ..limits import SMALLEST_RATIO
from .exposure_limits import exposure_limits, whole_periods_s
from .metering import RULES, Metering, meter

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.runs.seeds import Generator

    from ..bayer import BayerSensor
    from ..imaging_sensor import ImagingSensor
    from ..single import SingleSensor
    from ..staggered import StaggeredSensor

LOG_TOLERANCE = 1e-12  # tolerance of the natural logarithm of the exposure


class Automatic(NamedTuple):
    """The exposure that a sensor chooses for a shot."""

    exposure: Exposure
    iterations: int  # number of iterations of Brent's method


class Solved(NamedTuple):
    """An exposure in seconds, a factor on the analog gain, and how they were found."""

    exposure_s: float
    gain: float
    iterations: int  # number of iterations of Brent's method
    limit: str  # name of the field that limited the exposure, or empty
    residual: float  # relative difference between the metered level and its target


def check(sensor: ImagingSensor) -> None:
    """Refuse an unknown rule, and a target or limits that no exposure can meet."""
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
    exposure_limits(sensor, None)


def exposed(sensor: ImagingSensor, light: xr.DataArray, generator: Generator) -> xr.Dataset:
    """Return the captures of `sensor` at the exposure and gain that it chooses for this light.

    The attribute `exposure_iterations` is the number of steps, and `analog_gain_factor` the factor
    by which the analog gain was raised.

    Parameters
    ----------
    sensor : `ImagingSensor` with an exposure rule.
    light : irradiance or photocurrent DataArray on the sensor plane.
    generator : key of the noise of the shot.
    """
    chosen = sensor.automatic(light)
    out = sensor.at_exposure(chosen.exposure)(light, generator)
    out.attrs["exposure_iterations"] = chosen.iterations
    out.attrs["analog_gain_factor"] = chosen.exposure.gain
    return out


def at_exposure(sensor: ImagingSensor, exposure: Exposure) -> ImagingSensor:
    """Return `sensor` with this exposure and gain, fixed. Its captures keep their ratios."""
    fixed = sensor.with_gain(exposure.gain) if exposure.gain > 1 else sensor
    return replace(fixed, exposure_rule="fixed", exposure_s=exposure.exposure_s)


def settled_exposure(sensor: SingleSensor, light: xr.DataArray) -> SettledExposure:
    """Return the exposure and gain that `sensor` chooses for this light, and their limits."""
    limits = exposure_limits(sensor, 1e-3 * light.attrs["focal_length_mm"])
    hertz = sensor.exposure_flicker_hz
    return SettledExposure(
        sensor.automatic(light).exposure,
        ExposureLimits(
            limits.shortest_s,
            limits.longest_s,
            sensor.auto_gain_max,
            1 / hertz if hertz else 0.0,
        ),
    )


def one_for_all(sensor: ImagingSensor, light: xr.DataArray) -> Automatic:
    """Return the exposure solved by the rule of `sensor`; captures keep their ratios."""
    solution = settle(sensor, light)
    return Automatic(Exposure(solution.exposure_s, solution.gain), solution.iterations)


def one_by_one(sensor: StaggeredSensor, light: xr.DataArray) -> Automatic:
    """Return the exposures of a staggered sensor, with the first and the last one solved apart.

    The rule sets the first exposure. The brightest pixel, lamps included, sets the last one. The
    others lie between them at equal ratios. If the brightest pixel would allow a last exposure as
    long as the first, the ratios of the config are used. No exposure is shorter than
    `SMALLEST_RATIO` times the first.

    Parameters
    ----------
    sensor : a staggered sensor.
    light : irradiance or photocurrent on the sensor plane.
    """
    first = settle(replace(sensor, exposure_each=False), light)
    each_capture = metered(sensor)
    # the gain may reduce the full scale, by its factor or less
    amplified = each_capture.with_gain(first.gain) if first.gain > 1 else each_capture
    last_s, more = solve(
        replace(
            amplified,
            exposure_each=False,
            exposure_rule="highlights",
            exposure_ratios=(1.0,),
            exposure_lamp_ratio=inf,
            exposure_speed_m_s=0.0,
            exposure_flicker_hz=0.0,
        ),
        light,
    )
    count = len(sensor.exposure_ratios)
    ratios = sensor.exposure_ratios
    if count > 1 and last_s < first.exposure_s:
        shares = np.geomspace(1.0, max(last_s / first.exposure_s, SMALLEST_RATIO), count)
        ratios = tuple(float(r) for r in shares)
    exposure = Exposure(first.exposure_s, first.gain, tuple(ratios))
    return Automatic(exposure, first.iterations + more)


def solve(sensor: BayerSensor, light: xr.DataArray) -> tuple[float, int]:
    """Return the exposure in seconds and the iterations, as `settle` does."""
    solution = settle(sensor, light)
    return solution.exposure_s, solution.iterations


def settle(sensor: ImagingSensor, light: xr.DataArray) -> Solved:
    """Return the exposure and the gain solved for `light`, and state the residual in the ledger.

    Mean electrons, dark charge included, are proportional to the exposure, so they are computed
    once. Light that varies in time is metered by its mean over time, because a camera meters over
    many frames. If the target cannot be met within the limits, the result is the nearer limit.

    Raises
    ------
    ConfigError : no exposure meets the limits with the lens of this light.
    """
    solution = once(("automatic exposure", sensor), (light,), lambda: _settled(sensor, light))
    reached = f"after {solution.iterations} iterations"
    if solution.limit:
        reached = f"at its limit {solution.limit}"
    if solution.gain > 1:
        reached += f", analog gain times {solution.gain:.4g}"
    ledger.error(
        solution.residual,
        "relative",
        "measured",
        f"metered level, {sensor.exposure_rule}, against its target, {reached}",
    )
    return solution


def _settled(sensor: ImagingSensor, light: xr.DataArray) -> Solved:
    sensor = metered(sensor)
    electrons_per_s = sensor.expected(time_mean(light)).values / sensor.exposure_s
    return settled_at(sensor, electrons_per_s, 1e-3 * light.attrs["focal_length_mm"])


def metered(sensor: ImagingSensor) -> ImagingSensor:
    """Return the sensor for metering, in which the chip does not combine the readings."""
    if sensor.combine_bits:
        return replace(sensor, combine_bits=0, companding=())
    return sensor


def settled_at(sensor: ImagingSensor, electrons_per_s: np.ndarray, focal_length_m: float) -> Solved:
    """Return the exposure and the gain solved for mean electrons, without an entry in the ledger.

    Parameters
    ----------
    sensor : sensor as `metered` returns it.
    electrons_per_s : (capture, y, x) electrons per second, mean over time, dark charge included.
    focal_length_m : focal length of the lens, m, for the limits.

    Raises
    ------
    ConfigError : no exposure meets the limits with that lens.
    """
    limits = exposure_limits(sensor, focal_length_m)
    scale_e = np.reshape(sensor.full_scale_e(), (-1, 1, 1))
    how = Metering(sensor.exposure_rule, sensor.exposure_percentile, sensor.exposure_lamp_ratio)
    target = sensor.exposure_target
    level = meter(how, electrons_per_s / scale_e)
    exposure_s, iterations = _met(level, limits.shortest_s, limits.longest_s, target)
    limit = ""
    if not iterations:
        limit = limits.longest_by if exposure_s == limits.longest_s else limits.shortest_by
    exposure_s = whole_periods_s(exposure_s, sensor.exposure_flicker_hz)
    gain = 1.0
    at = level(exposure_s)
    if sensor.auto_gain_max > 1 and at < target:
        k = sensor.gained_reading()
        reading = sensor.model().readings[k]

        def amplified(factor: float) -> float:
            full_e = min(float(scale_e[k, 0, 0]), reading.swing_e / factor)
            return meter(how, electrons_per_s[k : k + 1] / full_e)(exposure_s)

        gain, more = _met(amplified, 1.0, sensor.auto_gain_max, target)
        iterations += more
        if gain > 1:
            at = amplified(gain)
    return Solved(exposure_s, gain, iterations, limit, abs(at / target - 1))


def _met(
    level: Callable[[float], float], least: float, most: float, target: float
) -> tuple[float, int]:
    """Return the argument between two limits at which the increasing function `level` meets
    `target`, and the number of iterations of Brent's method. If there is none, return the nearer
    limit and 0.
    """
    from scipy.optimize import brentq

    if level(most) <= target:
        return most, 0
    if level(least) >= target:
        return least, 0
    log, run = brentq(
        lambda u: np.log(level(np.exp(u)) / target),
        np.log(least),
        np.log(most),
        xtol=LOG_TOLERANCE,
        full_output=True,
    )
    return float(np.exp(log)), run.iterations

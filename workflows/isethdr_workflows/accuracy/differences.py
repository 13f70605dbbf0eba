"""Differences between the results of one setting and those of the reference, in the quantity's own
unit and in standard deviations of the sensor's noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.data.scores import half_interval
from isethdr_core.uncertainty import propagation
from isethdr_core.uncertainty.error_terms import Quantity

from .configured_knobs import Setting
from .stage_results import Results, captured

SHARE = propagation.SHARE  # share of the values that are within a stated error
RELATIVE = "relative"
LIGHT = {
    Quantity.RADIANCE: "mixed",
    Quantity.IRRADIANCE: "light",
    Quantity.PHOTOCURRENT: "light",
}


class Noise(NamedTuple):
    """The noise of the sensors in the configuration as it is, by camera."""

    sigma_e: dict[str, np.ndarray]  # (capture, y, x) standard deviation, electrons
    counts: dict[str, np.ndarray]  # (capture, y, x): pixels below saturation
    known: bool  # False: shot noise only, because the captures do not state the rest


class Difference(NamedTuple):
    """The error of one setting."""

    own: float  # largest error of 99 % of the values
    half: float  # largest error of half of the values
    unit: str  # unit of `own` and `half`
    compared: str  # name of the compared quantity
    of_noise: float  # largest error of 99 % of the pixels, standard deviations of the noise


def noise_of(configuration: Setting, results: Results) -> Noise:
    """Return the noise of every camera for the light of a configuration."""
    sigma = {}
    counts = {}
    known = True
    for name, captures in captured(configuration, results).items():
        electrons = results.electrons[name]
        counts[name] = ~captures["saturated"].values if "saturated" in captures else None
        shots = None
        if not propagation.missing(captures):
            shots = propagation.electrons(
                propagation.Exposure(captures, results.light, results.mixed, results.scene)
            )
            sigma[name] = np.stack([shot.sigma for shot in shots])
        if shots is None or sigma[name].shape != electrons.shape:
            known = False
            sigma[name] = np.sqrt(np.maximum(electrons.values, 1.0))
        if counts[name] is None or counts[name].shape != electrons.shape:
            counts[name] = np.ones(electrons.shape, bool)
    return Noise(sigma, counts, known)


def difference(
    measured: Results, reference: Results, error_of: Quantity, noise: Noise
) -> Difference:
    """Return the error of `measured` against the reference.

    If the light has another grid or other bands than the reference, electrons are compared instead.

    Parameters
    ----------
    measured, reference : results of the two configurations.
    error_of : the quantity to compare; electrons if the chain has no results of this quantity.
    noise : noise of the sensors.
    """
    if error_of == Quantity.SCORE:
        return _of_scores(measured, reference)
    if error_of == Quantity.PICTURE:
        return _of_pictures(measured, reference)
    of_noise = _largest(_in_noise(measured, reference, noise, name) for name in measured.electrons)
    if error_of in LIGHT:
        a, b = (getattr(results, LIGHT[error_of]) for results in (measured, reference))
        if _alike(a, b):
            off = _relative(a.values, b.values)
            return Difference(_most(off), _half(off), RELATIVE, a.name or error_of, of_noise)
    off_e = [
        np.abs(measured.electrons[name].values - right.values)[noise.counts[name]]
        for name, right in reference.electrons.items()
    ]
    worst = _largest(map(_most, off_e))
    half = _largest(map(_half, off_e))
    return Difference(worst, half, "electrons", Quantity.ELECTRONS, of_noise)


def _in_noise(results: Results, reference: Results, noise: Noise, name: str) -> float:
    off = np.abs(results.electrons[name].values - reference.electrons[name].values)
    shares = (off / noise.sigma_e[name])[noise.counts[name]]
    return _most(shares)


def _of_pictures(results: Results, reference: Results) -> Difference:
    relative_errors = []
    of_noise = []
    for name, right in reference.pictures.items():
        valid = right["valid"].values & results.pictures[name]["valid"].values
        y, y_right = (p["xyz"].sel(xyz_channel="Y").values for p in (results.pictures[name], right))
        relative_errors.append(_relative(y[valid], y_right[valid]))
        variance = right["variance"]
        if "xyz_channel" in variance.dims:
            variance = variance.sel(xyz_channel="Y")
        with np.errstate(invalid="ignore", divide="ignore"):
            shares = (np.abs(y - y_right) / np.sqrt(variance.values))[valid]
        of_noise.append(_most(shares[np.isfinite(shares)]))
    most = _largest(map(_most, relative_errors))
    half = _largest(map(_half, relative_errors))
    return Difference(most, half, RELATIVE, Quantity.PICTURE, _largest(of_noise))


def _of_scores(results: Results, reference: Results) -> Difference:
    """Return the largest difference of a score: relative, and over half of its interval.

    Only scores that differ count, because a knob leaves the scores of other metrics as they are.
    The share of the interval is NaN if one of them has no interval. All is NaN if no two numbers
    differ, and a score has no number on one side.
    """
    relative_errors: list[float] = []
    of_noise: list[float] = []
    compared = unknown = False
    for name, scores in reference.scores.items():
        by_name = {(s.metric, s.object): s for s in results.scores[name]}
        for right in scores:
            score = by_name.get((right.metric, right.object))
            if score is None or not math.isfinite(right.value - score.value):
                unknown |= score is None or math.isfinite(right.value) != math.isfinite(score.value)
                continue
            compared = True
            off = abs(score.value - right.value)
            if off > 0:
                relative_errors.append(off / abs(right.value) if right.value else off)
                half = half_interval(right)
                of_noise.append(off / half if half > 0 else math.nan)
    if not relative_errors:
        none = 0.0 if compared and not unknown else math.nan
        return Difference(none, none, RELATIVE, Quantity.SCORE, none)
    return Difference(
        max(relative_errors),
        float(np.median(relative_errors)),
        RELATIVE,
        Quantity.SCORE,
        float(np.max(of_noise)),  # NaN if one is NaN
    )


def _alike(a: Any, b: Any) -> bool:
    return a.dims == b.dims and all(np.array_equal(a[d].values, b[d].values) for d in a.dims)


def _relative(values: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return the relative errors, where the reference has light."""
    lit = right > 0
    return np.abs(values[lit] - right[lit]).astype(float) / right[lit]


def _most(errors: np.ndarray) -> float:
    return float(np.quantile(errors, SHARE)) if errors.size else math.nan


def _half(errors: np.ndarray) -> float:
    return float(np.median(errors)) if errors.size else math.nan


def _largest(errors: Iterable[float]) -> float:
    """Return the largest error of the cameras; NaN if none is known. A camera with only saturated
    pixels has no known error.
    """
    return max((error for error in errors if not math.isnan(error)), default=math.nan)

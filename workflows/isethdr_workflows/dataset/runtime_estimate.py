"""Estimate of the run time and the disk space of a dataset, from the scenes that are made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t

from .record import SceneRecord

FEWEST = 2  # fewest scenes for an estimate; one scene does not show how scenes differ


@dataclass(frozen=True)
class Total:
    """A sum over scenes with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class RuntimeEstimate:
    """Expected time and disk space of all scenes of a dataset."""

    seconds: Total  # time of one machine
    cpu_seconds: Total | None  # CPU time; None if it was not recorded for every scene
    stored_bytes: Total
    sample: int  # number of scenes behind the estimate


def runtime_estimate(records: Sequence[SceneRecord], count: int) -> RuntimeEstimate | None:
    """Return the expected time and disk space of `count` scenes; None if fewer than two are made.

    The scenes that are made count with their own values, and each other scene with the mean of
    these. The interval is Student's interval for the sum of new draws from the same recipe.

    Parameters
    ----------
    records : records of the scenes that are made.
    count : number of scenes of the dataset.
    """
    own = [record for record in records if record.number < count]  # fewer scenes may be asked for
    if len(own) < FEWEST:
        return None
    cpu_s = [record.cpu_seconds for record in own]
    return RuntimeEstimate(
        _total([record.machine_s for record in own], count),
        _total(cpu_s, count) if all(cpu_s) else None,
        _total([float(record.stored_bytes) for record in own], count),
        len(own),
    )


def _total(values: Sequence[float], count: int) -> Total:
    made = np.asarray(values)
    left = max(count - len(values), 0)
    mean = made.mean()
    spread = made.std(ddof=1)
    # variance of the sum of new draws: their own variance, and that of the estimated mean
    width = t.ppf(0.975, made.size - 1) * spread * math.sqrt(left + left**2 / made.size)
    total = made.sum() + left * mean
    return Total(float(total), float(max(total - width, made.sum())), float(total + width))

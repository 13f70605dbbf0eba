"""Runtime estimate of a dataset, and its disk space, from the scenes that are made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t

from .record import SceneRecord

FEWEST = 2  # scenes: one alone says nothing about how they differ


@dataclass(frozen=True)
class Total:
    """A sum over scenes with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class RuntimeEstimate:
    """What a dataset takes, all scenes counted."""

    seconds: Total  # of one machine
    cpu_seconds: Total | None  # of the processor; None where a scene has no record of it
    stored_bytes: Total
    sample: int  # scenes that it is from


def runtime_estimate(records: Sequence[SceneRecord], count: int) -> RuntimeEstimate | None:
    """Return what `count` scenes take; None from fewer than two.

    The scenes that are made count as they are. Each other one is taken for their mean; the interval
    is Student's, of the sum of new draws from the same recipe.

    Parameters
    ----------
    records : records of the scenes that are made.
    count : number of scenes of the dataset.
    """
    if len(records) < FEWEST:
        return None
    cpu_s = [record.cpu_seconds for record in records]
    return RuntimeEstimate(
        _total([record.machine_s for record in records], count),
        _total(cpu_s, count) if all(cpu_s) else None,
        _total([float(record.stored_bytes) for record in records], count),
        len(records),
    )


def _total(values: Sequence[float], count: int) -> Total:
    made = np.asarray(values)
    left = max(count - len(values), 0)
    mean = made.mean()
    spread = made.std(ddof=1)
    # variance of the sum of new draws: their own, and that of the mean they are taken for
    width = t.ppf(0.975, made.size - 1) * spread * math.sqrt(left + left**2 / made.size)
    total = made.sum() + left * mean
    return Total(float(total), float(max(total - width, made.sum())), float(total + width))

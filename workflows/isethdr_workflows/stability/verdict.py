"""Verdicts: a case is right within its bound, refused with an error that says what to do, or wrong."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import IsetHdrError

SHORTEST_MESSAGE = 25   # characters: less cannot say what was wrong, what was expected and what to type


@dataclass(frozen=True)
class Measured:
    """How far a result lies from the truth, how far it may, and what the truth is."""

    error: float
    bound: float
    against: str


def judged(stage: str, case: str, measure: Callable[[], Measured]) -> dict:
    """Return the row of one case; any exception but a clear refusal is wrong, and so is a RuntimeWarning or NaN."""
    error = bound = float("nan")
    try:
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always", RuntimeWarning)
            found = measure()
        error, bound, against = float(found.error), float(found.bound), found.against
        trouble = [w for w in told if issubclass(w.category, RuntimeWarning)]
        verdict = "right" if error <= bound and not trouble else "WRONG"
        if trouble:
            against += f"; warned: {trouble[0].message}"
    except (IsetHdrError, ValueError) as refusal:
        against = str(refusal)
        verdict = "refused" if len(against) >= SHORTEST_MESSAGE else "WRONG"
    except Exception as crash:  # noqa: BLE001 - a crash is a verdict here
        verdict, against = "WRONG", f"{type(crash).__name__}: {crash}"
    return {"stage": stage, "case": case, "verdict": verdict, "error": error, "bound": bound, "against": against}


def relative(found, truth) -> float:
    """Return the largest relative error, in long double; a truth of exactly 0 must be met exactly."""
    found, truth = np.asarray(found, np.longdouble), np.asarray(truth, np.longdouble)
    dark = truth == 0
    miss = np.where(dark, np.where(found == 0, 0.0, np.inf), np.abs(found - truth) / np.where(dark, 1.0, np.abs(truth)))
    return float(miss.max())


def with_ledger(call):
    """Return (result, row): what `call()` returned, and what it stated about its errors."""
    rows = ledger.Ledger()
    with ledger.stage(rows, "case") as row:
        result = call()
    return result, row

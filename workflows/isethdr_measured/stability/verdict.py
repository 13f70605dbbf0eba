"""Verdicts: every case names its expected outcome, which is a right result or a refusal with an
error of isethdr. Everything else is wrong.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import IsetHdrError

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from isethdr_core.uncertainty.ledger import Row

# characters: a shorter message cannot state the mistake, the expected value and a remedy
SHORTEST_MESSAGE = 25


@dataclass(frozen=True)
class Measured:
    """Error of a result, its bound, and the source of the true value."""

    error: float
    bound: float
    against: str


class Case(NamedTuple):
    """One hard case: a call, and the error that it must raise; None if its result must be right."""

    name: str
    measure: Callable[[], object]
    refused_with: type[IsetHdrError] | None = None


def judged(stage: str, case: Case) -> dict:
    """Return the row of one case.

    A case is right if a result was expected and its error is within its bound, without a
    RuntimeWarning. It is refused if the expected error of isethdr was raised with a message.
    Everything else is wrong: another exception, another error, or no error where one was expected.
    """
    error = bound = float("nan")
    verdict = "WRONG"
    try:
        with warnings.catch_warnings(record=True) as raised:
            warnings.simplefilter("always", RuntimeWarning)
            measurement = case.measure()
        if case.refused_with is None:
            error = float(measurement.error)
            bound = float(measurement.bound)
            against = measurement.against
            trouble = [w for w in raised if issubclass(w.category, RuntimeWarning)]
            verdict = "right" if error <= bound and not trouble else "WRONG"
            if trouble:
                against += f"; warned: {trouble[0].message}"
        else:
            against = f"no error; expected {case.refused_with.__name__}"
    except IsetHdrError as refusal:
        against = str(refusal)
        refused_as_expected = case.refused_with is not None and isinstance(
            refusal, case.refused_with
        )
        if refused_as_expected and len(against) >= SHORTEST_MESSAGE:
            verdict = "refused"
        else:
            against = f"{type(refusal).__name__}: {against}"
    except Exception as crash:  # noqa: BLE001 - a crash is a verdict here
        against = f"{type(crash).__name__}: {crash}"
    outcome = case.refused_with.__name__ if case.refused_with else "right"
    return {
        "stage": stage,
        "case": case.name,
        "expected": outcome,
        "verdict": verdict,
        "error": error,
        "bound": bound,
        "against": against,
    }


def relative(values: ArrayLike, truth: ArrayLike) -> float:
    """Return the largest relative error, in long double. It is infinite if a value is not 0 where
    the truth is exactly 0.

    Parameters
    ----------
    values : values under test.
    truth : true values, in the same unit.
    """
    values = np.asarray(values, np.longdouble)
    truth = np.asarray(truth, np.longdouble)
    dark = truth == 0
    miss = np.where(
        dark,
        np.where(values == 0, 0.0, np.inf),
        np.abs(values - truth) / np.where(dark, 1.0, np.abs(truth)),
    )
    return float(miss.max())


def with_ledger(call: Callable[..., Any]) -> tuple[xr.Dataset, Row]:
    """Return the result of `call()` and its row of the ledger."""
    rows = ledger.Ledger()
    with ledger.stage(rows, "case") as row:
        result = call()
    return result, row

"""Companding: a piecewise linear compression of linear codes to fewer bits, and the table that
inverts it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from isethdr_core.errors import ConfigError


def table(knees: Sequence[tuple[float, float]], top_code: float) -> tuple[np.ndarray, np.ndarray]:
    """Return (linear DN, companded DN) of the knees with (0, 0) in front, both increasing.

    Parameters
    ----------
    knees : pairs (linear DN, companded DN).
    top_code : largest linear code, DN; the last knee must reach it.

    Raises
    ------
    ConfigError : the knees are no pairs, do not increase, expand a part, or end too early.
    """
    if any(len(knee) != 2 for knee in knees):
        raise ConfigError(
            f"sensor.companding is {knees!r}; expected pairs [linear DN, companded DN]"
        )
    linear, companded = np.array([(0.0, 0.0), *knees], float).T
    if (
        not np.all(np.isfinite([linear, companded]))
        or np.any(np.diff(linear) <= 0)
        or np.any(np.diff(companded) <= 0)
    ):
        raise ConfigError(
            f"sensor.companding is {knees!r}; expected both linear DN and companded DN to increase"
            " from knee to knee"
        )
    if np.any(np.diff(companded) > np.diff(linear) * (1 + 1e-9)):
        raise ConfigError(
            f"sensor.companding is {knees!r}; expected compression: no segment may have more"
            " companded codes than linear codes"
        )
    if linear[-1] < top_code:
        raise ConfigError(
            f"sensor.companding ends at {linear[-1]:g} DN; expected its last knee at the top code"
            f" {top_code:g} or above"
        )
    return linear, companded


def compand(
    linear_dn: np.ndarray, knees: Sequence[tuple[float, float]], top_code: float
) -> np.ndarray:
    """Return whole companded codes of linear codes.

    Parameters
    ----------
    linear_dn : linear codes of any shape, DN.
    knees : knee points (linear DN, companded DN), increasing.
    top_code : largest linear code, DN.
    """
    return np.floor(np.interp(linear_dn, *table(knees, top_code)) + 0.5)


def decompand(
    companded_dn: np.ndarray, knees: Sequence[tuple[float, float]], top_code: float
) -> np.ndarray:
    """Return linear codes. The error is at most half a companded code times the local compression.

    Parameters
    ----------
    companded_dn : companded codes of any shape, DN.
    knees : knee points (linear DN, companded DN), increasing.
    top_code : largest linear code, DN.
    """
    linear, companded = table(knees, top_code)
    return np.interp(companded_dn, companded, linear)

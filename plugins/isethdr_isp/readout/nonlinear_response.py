"""Nonlinear response: the table from linear DN to electrons, for captures of nonlinear pixels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import UnitError

if TYPE_CHECKING:
    import xarray as xr

NAMES = ("response_dn", "response_e", "response_variance_e2")


@dataclass(frozen=True, eq=False)
class BentResponse:
    """The table from linear DN to electrons; all arrays are (entry,)."""

    dn: np.ndarray  # linear DN, increasing
    electrons: np.ndarray  # arriving electrons, dark charge included
    variance_e2: np.ndarray  # variance of one reading, shot noise included

    def electrons_at(self, dn: float | np.ndarray) -> np.ndarray:
        """Return the electrons that have to arrive for `dn`. Below the first entry the first
        segment is extended.
        """
        slope = (self.electrons[1] - self.electrons[0]) / (self.dn[1] - self.dn[0])
        return np.interp(dn, self.dn, self.electrons) + slope * np.minimum(dn - self.dn[0], 0.0)

    def electrons_per_dn(self, dn: np.ndarray) -> np.ndarray:
        """Return the slope of the table at `dn`, electrons per DN; below the first entry, the slope
        of the first segment.
        """
        slopes = np.diff(self.electrons) / np.diff(self.dn)
        segment = np.searchsorted(self.dn, dn, side="right") - 1
        return slopes[np.clip(segment, 0, len(slopes) - 1)]

    def read_variance_e2(self, dn: np.ndarray) -> np.ndarray:
        """Return the variance of a reading minus the Poisson variance of the electrons, e^2, 0 or
        above.
        """
        poisson = np.maximum(np.interp(dn, self.dn, self.electrons), 0.0)
        return np.maximum(np.interp(dn, self.dn, self.variance_e2) - poisson, 0.0)


def bent_response(captures: xr.Dataset, i: int) -> BentResponse | None:
    """Return the table of capture `i` without its padding; None if the capture is linear."""
    if NAMES[0] not in captures:
        return None
    columns = np.array([captures[name].values[i] for name in NAMES], float)
    columns = columns[:, np.isfinite(columns).all(axis=0)]
    return BentResponse(*columns) if columns.shape[1] else None


def check_responses(captures: xr.Dataset) -> None:
    """Refuse a table that is incomplete, too short or not increasing, or has negative variances."""
    present = [name for name in NAMES if name in captures]
    if not present:
        return
    if len(present) < len(NAMES):
        raise UnitError(
            f"captures have {' and '.join(present)} alone; expected {', '.join(NAMES)}, or none of"
            " them"
        )
    for i in range(captures.sizes["capture"]):
        table = bent_response(captures, i)
        if table is None:
            continue
        if (
            len(table.dn) < 2
            or np.any(np.diff(table.dn) <= 0)
            or np.any(np.diff(table.electrons) <= 0)
        ):
            raise UnitError(
                "a response table does not rise from entry to entry; expected at least two rising"
                " pairs of response_dn and response_e"
            )
        if np.any(table.variance_e2 < 0):
            raise UnitError("response_variance_e2 holds values below 0; expected variances in e2")

"""Luminance ramp: equal ratios from column to column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..limits import Decades, Luminance
from .chart import Chart

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class LuminanceRamp(Chart):
    """Luminance ramp over eight decades, dark on the left, equal ratios from column to column."""

    luminance_cd_m2: Luminance = 1e6  # luminance of the last column
    # logarithm (base 10) of the luminance ratio of the last and the first column
    decades: Decades = 8.0

    def __call__(self) -> xr.Dataset:
        """Return scene radiance with the single group `sky`. The first and the last column have the
        end values exactly.
        """
        level = self.luminance_cd_m2 * np.logspace(-self.decades, 0.0, self.width)
        return self.dataset({"sky": self.white()[:, None, None] * level})

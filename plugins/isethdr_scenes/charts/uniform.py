"""Uniform field: electrons and noise of every pixel have a closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from .chart import Chart

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Uniform(Chart):
    """Uniform field of one stated luminance."""

    def __call__(self) -> xr.Dataset:
        """Return scene radiance with the single group `sky`, luminance `luminance_cd_m2`
        everywhere.
        """
        return self.dataset({"sky": (self.luminance_cd_m2 * self.white())[:, None, None]})

"""Slanted edge: a straight border between two luminances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..limits import Angle, Contrast
from .chart import Chart
from .coverage import half_plane

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class SlantedEdge(Chart):
    """Slanted edge through the centre, bright on the right, exact area coverage in every tile."""

    angle_deg: Angle = 5.0  # angle of the edge, clockwise from vertical
    contrast_ratio: Contrast = 10.0  # luminance of the bright side / luminance of the dark side

    def __call__(self) -> xr.Dataset:
        """Return scene radiance with the single group `sky`. The luminance of the bright side is
        `luminance_cd_m2`.
        """
        bright = half_plane(*self.tiles(), self.angle_deg)
        dark = 1 / self.contrast_ratio
        return self.dataset(
            {
                "sky": self.luminance_cd_m2
                * self.white()[:, None, None]
                * (dark + (1 - dark) * bright)
            }
        )

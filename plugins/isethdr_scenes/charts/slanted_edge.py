"""Slanted edge: a straight border between two luminances."""

from __future__ import annotations

from dataclasses import dataclass

from isethdr_core.errors import ConfigError

from .chart import Chart


@dataclass(frozen=True)
class SlantedEdge(Chart):
    """Slanted edge through the centre, bright on the right, exact area coverage in every tile."""

    angle_deg: float = 5.0         # of the edge, clockwise from upright
    contrast_ratio: float = 10.0   # bright / dark

    def __post_init__(self):
        super().__post_init__()
        if not self.contrast_ratio >= 1:
            raise ConfigError(f"contrast_ratio is {self.contrast_ratio:g}; expected bright / dark, at least 1")

    def __call__(self):
        """Return scene radiance with the single group `sky`; the bright side has `luminance_cd_m2`."""
        from .coverage import half_plane

        bright = half_plane(*self.tiles(), self.angle_deg)
        dark = 1 / self.contrast_ratio
        return self.dataset({"sky": self.luminance_cd_m2 * self.white()[:, None, None] * (dark + (1 - dark) * bright)})

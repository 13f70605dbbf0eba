"""Luminance ramp: equal ratios from column to column."""

from __future__ import annotations

from dataclasses import dataclass

from isethdr_core.errors import ConfigError

from .chart import Chart


@dataclass(frozen=True)
class LuminanceRamp(Chart):
    """Luminance ramp over eight decades, dark on the left, equal ratios from column to column."""

    luminance_cd_m2: float = 1e6   # of the last column
    decades: float = 8.0           # the first column is darker by 10 to this power

    def __post_init__(self):
        super().__post_init__()
        if not 0 < self.decades <= 30:
            raise ConfigError(f"decades is {self.decades:g}; expected more than 0, at most 30 (float32 ends there)")

    def __call__(self):
        """Return scene radiance with the single group `sky`; first and last column hold the end values exactly."""
        import numpy as np

        level = self.luminance_cd_m2 * np.logspace(-self.decades, 0.0, self.width)
        return self.dataset({"sky": self.white()[:, None, None] * level})

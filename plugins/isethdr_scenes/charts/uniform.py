"""Uniform field: electrons and noise of every pixel have a closed form."""

from __future__ import annotations

from dataclasses import dataclass

from .chart import Chart


@dataclass(frozen=True)
class Uniform(Chart):
    """Uniform field of one stated luminance."""

    def __call__(self):
        """Return scene radiance with the single group `sky`, luminance `luminance_cd_m2`
        everywhere.
        """
        return self.dataset({"sky": (self.luminance_cd_m2 * self.white())[:, None, None]})

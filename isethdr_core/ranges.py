"""Ranges: the values that a field may have. Public path of `plugins.ranges`."""

from .plugins.ranges import (
    Percent,
    Range,
    Seed,
    Share,
    Wavelength,
    check_ranges,
)

__all__ = ["Percent", "Range", "Seed", "Share", "Wavelength", "check_ranges"]

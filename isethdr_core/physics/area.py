"""Public path of `physics.resampling.area`."""

from .resampling.area import (
    SLACK,
    detail_error,
    integrate_tiles,
    overlaps,
    resample_mean,
)

__all__ = ["SLACK", "detail_error", "integrate_tiles", "overlaps", "resample_mean"]

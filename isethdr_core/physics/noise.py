"""Public path of `physics.detector.noise`."""

from .detector.noise import (
    EXACT_BELOW_E,
    LARGEST_MEAN_E,
    SERIES_BELOW_E,
    normal,
    normal_float32,
    normal_pair,
    poisson,
    poisson_image,
    rows_per_block,
)

__all__ = [
    "EXACT_BELOW_E",
    "LARGEST_MEAN_E",
    "SERIES_BELOW_E",
    "normal",
    "normal_float32",
    "normal_pair",
    "poisson",
    "poisson_image",
    "rows_per_block",
]

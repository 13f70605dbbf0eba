"""Public path of `data.reference_picture`."""

import warnings
from typing import Any

from .data.reference_picture import (
    FIXED_PATTERN,
    FLOAT32,
    PICTURE_DIMS,
    TIE,
    UNDENOISED,
    VARIANCE_KNOWN,
    before_denoising,
    check_picture,
    labels_on,
    make_picture,
    mean_over_pixels,
    objects_on,
    total_variance,
    truth,
    variance_known,
    with_undenoised,
)

__all__ = [
    "FIXED_PATTERN",
    "FLOAT32",
    "PICTURE_DIMS",
    "TIE",
    "UNDENOISED",
    "VARIANCE_KNOWN",
    "before_denoising",
    "check_picture",
    "labels_on",
    "make_picture",
    "mean_over_pixels",
    "objects_on",
    "total_variance",
    "truth",
    "variance_known",
    "with_undenoised",
]


def __getattr__(name: str) -> Any:
    """Return `mean_over_pixels` under its earlier name `seen`, with a warning."""
    if name != "seen":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    message = "isethdr_core.truth.seen is now isethdr_core.truth.mean_over_pixels"
    warnings.warn(message, DeprecationWarning, stacklevel=2)
    return mean_over_pixels

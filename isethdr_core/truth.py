"""Public path of `data.reference_picture`."""

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
    objects_on,
    seen,
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
    "objects_on",
    "seen",
    "total_variance",
    "truth",
    "variance_known",
    "with_undenoised",
]

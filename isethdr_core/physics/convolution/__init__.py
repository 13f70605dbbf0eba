"""Convolution: linear (not circular), with a bound on its error.

| module        | content                                                                    |
|---------------|----------------------------------------------------------------------------|
| `direct_sums` | direct sums for dark pixels in images with very bright ones                |
| `fourier`     | Fourier transforms along one axis by the fastest installed library         |
| `linear`      | convolution that is accurate next to light 1e12 times brighter             |
| `mirrored`    | kernels that equal their own mirror image; only one half is stored         |
| `spectral`    | convolution of all bands at once, directly to channels                     |
| `transform`   | transforms of padded images in blocks that fit the cache                   |
"""

from .linear import (
    RELATIVE,
    Bound,
    Kernel,
    convolve,
    convolve_into,
    convolve_with_bound,
    prepare,
)

__all__ = [
    "Bound",
    "Kernel",
    "RELATIVE",
    "convolve",
    "convolve_into",
    "convolve_with_bound",
    "prepare",
]

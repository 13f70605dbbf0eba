"""Convolution: linear, never circular, with a bound on its error.

| module        | content                                                                    |
|---------------|----------------------------------------------------------------------------|
| `direct_sums` | direct sums for dark pixels beside very bright ones                        |
| `fourier`     | Fourier transforms along one axis by the fastest library at hand           |
| `linear`      | linear, never circular, right in the dark beside light 1e12 times brighter |
| `mirrored`    | kernels that equal their own mirror image, kept as a half                  |
| `spectral`    | convolution of all bands at once, straight to channels                     |
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

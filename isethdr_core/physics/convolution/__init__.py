"""Convolution: linear, never circular, with a bound on its error.

| module        | what                                                                       |
|---------------|----------------------------------------------------------------------------|
| `direct_sums` | the light of pixels so dark that the rounding of a transform could matter  |
| `fourier`     | fourier transforms along one axis, by the fastest library at hand          |
| `linear`      | linear, never circular, right in the dark beside light 1e12 times brighter |
| `spectral`    | convolution of all bands at once, straight to channels                     |
| `transform`   | transforms of padded images                                                |
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

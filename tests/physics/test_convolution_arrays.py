"""Convolution on another array library than NumPy: the same code, the same result."""

import numpy as np
import pytest

from isethdr_core.physics.convolution import Kernel, convolve, convolve_with_bound, prepare

xp = pytest.importorskip("array_api_strict", reason="the strict reference library of the array API standard; pip install array-api-strict")


def skirt(reach):
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    k = (1 + np.hypot(y, x)) ** -3.0
    return k / k.sum()


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("mirrored", [True, False])
def test_same_light_on_either_library(dtype, mirrored):
    rng = np.random.default_rng(0)
    image, psf = rng.uniform(0.5, 1.5, (37, 50)).astype(dtype), skirt(12).astype(dtype)
    image[20, 30] = 1e8
    if not mirrored:
        psf[3, 4] *= 2
    theirs = convolve(xp.asarray(image), xp.asarray(psf))
    assert isinstance(theirs, type(xp.asarray(image)))  # it stayed where it was
    # their transforms are NumPy's, ours another library's: float64 rounding beside a lamp of 1e8 times the background
    np.testing.assert_allclose(np.from_dlpack(theirs), convolve(image, psf), rtol=3e-8)


def test_doubtful_pixels_are_summed_there_too():
    y = np.arange(-20, 21)
    psf = np.exp(-0.5 * (y[:, None] ** 2 + y**2) / 2.0**2)  # below 1e-13 of its peak: rounding of the transform would show
    image = np.random.default_rng(1).uniform(0.5, 1.5, (60, 50))
    image[30, 25] = 1e12
    kernel = prepare(xp.asarray(psf), image.shape)
    assert isinstance(kernel, Kernel) and not isinstance(kernel.spectrum, np.ndarray)
    theirs, bound = convolve_with_bound(xp.asarray(image), kernel)
    assert bound.pixels == 0
    np.testing.assert_allclose(np.from_dlpack(theirs), convolve(image, psf), rtol=6e-8)  # what either transform is allowed, and not more


def test_what_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="NaN"):
        convolve(xp.asarray([[np.nan, 1.0]]), xp.asarray(np.ones((1, 1))))

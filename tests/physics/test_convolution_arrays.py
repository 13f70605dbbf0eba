"""Convolution with another array library than NumPy: the same code and the same result."""

import numpy as np
import pytest

from isethdr_core.physics import arrays
from isethdr_core.physics.convolution import Kernel, convolve, convolve_with_bound, prepare


@pytest.fixture(params=["array_api_strict", "torch"])
def place(request):
    """Return a function that moves a NumPy array to a device of another library.

    Where there is one, the device is not the library's default device.
    """
    xp = pytest.importorskip(request.param)
    if request.param == "torch":
        where = "cuda" if xp.cuda.is_available() else "cpu"
        return lambda a: xp.asarray(a, device=where)
    return lambda a: xp.asarray(a, device=xp.Device("device1"))


def skirt(reach):
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    k = (1 + np.hypot(y, x)) ** -3.0
    return k / k.sum()


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("mirrored", [True, False])
def test_same_light_on_either_library(place, dtype, mirrored):
    rng = np.random.default_rng(0)
    image = rng.uniform(0.5, 1.5, (37, 50)).astype(dtype)
    psf = skirt(12).astype(dtype)
    image[20, 30] = 1e8
    if not mirrored:
        psf[3, 4] *= 2
    theirs = convolve(place(image), place(psf))
    assert isinstance(theirs, type(place(image)))  # the result stays in the library
    # both use different transforms: float64 rounding next to a lamp of 1e8 times the background
    np.testing.assert_allclose(arrays.on_host(theirs), convolve(image, psf), rtol=3e-8)


def test_doubtful_pixels_are_summed_there_too(place):
    y = np.arange(-20, 21)
    # the kernel falls below 1e-13 of its peak, so that rounding of the transform would be visible
    psf = np.exp(-0.5 * (y[:, None] ** 2 + y**2) / 2.0**2)
    image = np.random.default_rng(1).uniform(0.5, 1.5, (60, 50))
    image[30, 25] = 1e12
    kernel = prepare(place(psf), image.shape)
    assert isinstance(kernel, Kernel) and not isinstance(kernel.spectrum, np.ndarray)
    theirs, bound = convolve_with_bound(place(image), kernel)
    assert bound.pixels == 0
    # the sum of the errors that the two transforms are allowed
    np.testing.assert_allclose(arrays.on_host(theirs), convolve(image, psf), rtol=6e-8)


def test_what_does_not_fit_is_refused(place):
    with pytest.raises(ValueError, match="NaN"):
        convolve(place(np.array([[np.nan, 1.0]])), place(np.ones((1, 1))))

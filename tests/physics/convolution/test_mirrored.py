"""Mirrored kernels: the stored half gives the whole array for every kind of access."""

import numpy as np
import pytest

from isethdr_core.physics.convolution import convolve, fourier, prepare
from isethdr_core.physics.convolution.mirrored import Mirrored

rng = np.random.default_rng(0)


def mirrored(rows=8, columns=13):
    """Return a half and the whole array."""
    half = rng.uniform(0.1, 1.0, (rows, columns)).astype(np.float32)
    half[0] = (half[0] + half[0, ::-1]) / 2
    return Mirrored(half), np.concatenate([half[:0:-1, ::-1], half])


@pytest.mark.parametrize(
    "key",
    [
        (3, 4),
        (12, 0),
        (slice(2, 11, 3), slice(None)),
        (slice(None, None, -1), slice(None, None, -1)),
        (slice(1, 9), 5),
        (2, slice(3, 9)),
        (np.array([[0, 14], [7, 3]]), np.array([[1, 2], [12, 0]])),
        5,
    ],
)
def test_values_are_those_of_the_whole(key):
    some, whole = mirrored()
    np.testing.assert_array_equal(some[key], whole[key])


def test_sums_arithmetic_and_parts():
    some, whole = mirrored()
    assert some.shape == whole.shape and len(some) == len(whole) and some.size == whole.size
    np.testing.assert_array_equal(np.asarray(some), whole)
    np.testing.assert_array_equal(2 * some - whole, whole)
    for axis in (None, 0, 1):
        np.testing.assert_allclose(some.sum(axis, float), whole.sum(axis, float), rtol=1e-12)
    np.testing.assert_allclose(some.squares(), (whole.astype(float) ** 2).sum(), rtol=1e-12)
    np.testing.assert_array_equal(np.asarray(some.within(2, 3)), whole[5:10, 3:10])
    rest = whole.copy()
    rest[5:10, 3:10] = 0.0
    np.testing.assert_array_equal(np.asarray(some.beyond(2, 3)), rest)


@pytest.mark.parametrize("library", ["SciPy", "ducc0"])
@pytest.mark.parametrize("shape", [(8, 7), (20, 15), (5, 4)])
def test_convolutions_are_those_of_the_whole(shape, library, monkeypatch):
    if library == "SciPy":
        monkeypatch.setattr(fourier, "duccs", None)
    elif fourier.duccs is None:
        pytest.skip("ducc0 is not installed: pip install 'isethdr[fast]'")
    some, whole = mirrored()
    image = rng.uniform(0, 1, shape)
    image[2, 1] = 1e9  # then dark pixels need direct sums with the whole kernel
    want = convolve(image, whole)
    np.testing.assert_allclose(convolve(image, some), want, rtol=1e-7)
    assert prepare(some, shape).spectrum.dtype == float

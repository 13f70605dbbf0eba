"""Convolution against direct sums in long double, for dark pixels next to very bright ones."""

import numpy as np
import pytest

from isethdr_core.physics.convolution import (
    convolve,
    convolve_with_bound,
    direct_sums,
    linear,
    transform,
)


def direct(image, psf, pixels):
    """Return direct sums in long double at `pixels`, which are independent of any transform."""
    ny, nx = image.shape
    cy = psf.shape[0] // 2
    cx = psf.shape[1] // 2
    image = image.astype(np.longdouble)
    psf = psf.astype(np.longdouble)
    out = []
    for i, j in pixels:
        total = np.longdouble(0)
        for a in range(ny):
            k = i - a + cy
            if 0 <= k < psf.shape[0]:
                b = np.arange(nx)
                m = j - b + cx
                ok = (m >= 0) & (m < psf.shape[1])
                total += np.sum(image[a, ok] * psf[k, m[ok]])
        out.append(total)
    return np.array(out)


def skirt(ny, nx, power=3.0):
    y = np.arange(ny) - ny // 2
    x = np.arange(nx) - nx // 2
    k = (1 + np.hypot(y[:, None], x[None, :])) ** -power
    return k / k.sum()


def gaussian(n, sd):
    g = np.exp(-0.5 * ((np.arange(n) - n // 2) / sd) ** 2)
    return np.outer(g, g) / g.sum() ** 2


@pytest.mark.parametrize(
    "ratio",
    # the ratios between these three are tested among the slow tests
    [1e2, 1e7, 1e12, *(pytest.param(r, marks=pytest.mark.slow) for r in (1e4, 1e6, 1e8, 1e10))],
)
@pytest.mark.parametrize("kernel", ["skirt", "gaussian", "point"])
@pytest.mark.parametrize("lamps", [1, 60])
@pytest.mark.parametrize("few", [0, 1e8])
def test_dark_pixels_beside_lamps(ratio, kernel, lamps, few, monkeypatch):
    # both kinds of direct sums: over the few bright sources, and for the dark pixels
    monkeypatch.setattr(direct_sums, "FEW_PRODUCTS", few)
    rng = np.random.default_rng(3)
    image = rng.uniform(0.5, 1.5, (60, 80))
    image[20 : 20 + max(1, lamps // 6), 30 : 30 + min(6, lamps)] = ratio
    psf = {"skirt": skirt(119, 159), "gaussian": gaussian(41, 2.5), "point": np.pad([[1.0]], 3)}[
        kernel
    ]
    got = convolve(image, psf)
    pixels = [(20, 40), (21, 29), (0, 0), (59, 79), (40, 30), *rng.integers(0, 60, (40, 2))]
    want = direct(image, psf, pixels)
    error = np.abs(np.array([got[i, j] for i, j in pixels]) / want - 1).max()
    assert error < 1e-7  # stated accuracy
    assert got.min() > 0


@pytest.mark.parametrize("few", [0, 1e8])
def test_black_stays_black_and_nothing_is_negative(few, monkeypatch):
    monkeypatch.setattr(direct_sums, "FEW_PRODUCTS", few)
    image = np.zeros((64, 96))
    image[:, :30] = np.random.default_rng(0).uniform(1, 2, (64, 30))
    image[5, 5] = 1e12
    got = convolve(image, gaussian(21, 1.5))
    assert got.min() >= 0
    assert np.all(got[:, 41:] == 0)  # out of the kernel's reach: exactly 0
    assert np.all(got[:, :40] > 0)
    assert np.all(convolve(np.zeros((5, 4)), skirt(9, 7)) == 0)


@pytest.mark.parametrize("shape", [(9, 11), (8, 10), (1, 1), (25, 5), (80, 91), (2, 1)])
def test_any_size_odd_or_even_is_linear_not_circular(shape):
    rng = np.random.default_rng(1)
    image = rng.uniform(0, 1, (17, 23))
    psf = rng.uniform(0, 1, shape)
    got = convolve(image, psf)
    pixels = [(i, j) for i in (0, 3, 8, 16) for j in (0, 5, 22)]
    # float64 rounding
    np.testing.assert_allclose(
        [got[p] for p in pixels], direct(image, psf, pixels).astype(float), rtol=1e-12
    )


def test_centre_is_at_half_the_size():
    for shape in ((5, 5), (4, 6), (40, 41)):
        psf = np.zeros(shape)
        psf[shape[0] // 2, shape[1] // 2] = 1
        image = np.random.default_rng(2).uniform(0, 1, (12, 13))
        np.testing.assert_allclose(convolve(image, psf), image, atol=1e-15)  # a few roundings
    psf = np.zeros((5, 5))
    psf[2, 3] = 1  # one to the right: light moves right
    image = np.zeros((6, 6))
    image[3, 2] = 1
    assert np.argwhere(convolve(image, psf) > 0.5).tolist() == [[3, 3]]


def test_energy_is_kept_where_the_kernel_stays_inside():
    image = np.zeros((90, 100))
    image[40:50, 45:55] = 10.0 ** np.random.default_rng(4).uniform(0, 12, (10, 10))
    # float64 sums
    assert convolve(image, gaussian(61, 4.0)).sum() == pytest.approx(image.sum(), rel=1e-13)


def test_linear_and_scale_free():
    rng = np.random.default_rng(5)
    a = rng.uniform(0, 1, (30, 40))
    b = rng.uniform(0, 1e6, (30, 40))
    psf = skirt(59, 79)
    # 1e-8: the stated accuracy
    np.testing.assert_allclose(
        convolve(2 * a + b, psf), 2 * convolve(a, psf) + convolve(b, psf), rtol=1e-8
    )
    np.testing.assert_allclose(
        convolve(a * 1e-200, psf * 1e150), convolve(a, psf) * 1e-50, rtol=1e-12
    )


@pytest.mark.parametrize("products", [4e10, 0])
def test_bound_says_what_was_kept(monkeypatch, products):
    monkeypatch.setattr(direct_sums, "MOST_PRODUCTS", products)
    monkeypatch.setattr(direct_sums, "FEW_PRODUCTS", 0)
    monkeypatch.setattr(direct_sums, "_few_sources", lambda *a: None)
    image = np.random.default_rng(8).uniform(0.5, 1.5, (50, 60))
    image[::3, ::2] *= 1e13
    image[30:, 20:] = 1e-6
    psf = gaussian(15, 1.2)
    got, bound = convolve_with_bound(image, psf)
    assert (bound.pixels > 0) == (products == 0)
    pixels = [(i, j) for i in range(0, 50, 3) for j in range(0, 60, 3)]
    want = direct(image, psf, pixels).astype(float)
    error = np.abs(np.array([got[p] for p in pixels]) - want)
    assert np.all(error <= bound.relative * want + bound.absolute)
    if products == 0:
        # the fallback has a measurable error
        assert error.max() / bound.absolute > 1e-3 or (error / want).max() > 1e-8


@pytest.mark.parametrize("mirror", [True, False])
def test_a_prepared_kernel_and_float32_lose_nothing(mirror):
    rng = np.random.default_rng(9)
    image = rng.uniform(0, 1, (40, 50)).astype(np.float32)
    psf = rng.uniform(0, 1, (79, 99)).astype(np.float32)
    if mirror:
        psf = psf + psf[::-1, ::-1]
    kernel = linear.prepare(psf, image.shape)
    assert np.isrealobj(kernel.spectrum) == mirror  # half the memory, without loss
    pixels = [(i, j) for i in (0, 20, 39) for j in (0, 25, 49)]
    want = direct(image, psf, pixels).astype(float)
    # float64 rounding, not float32's 6e-8
    np.testing.assert_allclose([convolve(image, kernel)[p] for p in pixels], want, rtol=1e-12)
    with pytest.raises(ValueError, match="prepare"):
        convolve(image[1:], kernel)


def test_signed_input_is_allowed():
    image = np.random.default_rng(6).normal(size=(20, 20))
    psf = np.random.default_rng(7).normal(size=(7, 7))
    np.testing.assert_allclose(
        convolve(image, psf)[10, 10], float(direct(image, psf, [(10, 10)])[0]), atol=1e-13
    )


def test_rounding_beside_one_lamp_is_within_the_stated_multiple_of_white_noise():
    psf = gaussian(41, 0.6)
    image = np.zeros((180, 320))
    row = 97
    column = 243
    image[row, column] = 1.0
    size = transform.sizes(image.shape, psf.shape)
    got, norm = transform.convolved(image, transform.spectrum(psf, size, 1.0, True), size)
    want = np.zeros_like(image)
    want[row - 20 : row + 21, column - 20 : column + 21] = psf
    dark = want < 1e-9
    white = transform.error(norm * np.linalg.norm(psf), np.linalg.norm(got), size)
    error = np.where(dark, np.abs(got - want), 0.0)
    assert error.max() < 14 * white
    assert np.median(error.max(axis=1)) < 0.5 * white  # only few rows exceed white noise


def test_bad_input_is_refused():
    with pytest.raises(ValueError, match="NaN"):
        convolve(np.array([[np.nan, 1.0]]), np.ones((1, 1)))
    with pytest.raises(ValueError, match="dimensions"):
        convolve(np.ones((2, 3, 3)), np.ones((3, 3)))

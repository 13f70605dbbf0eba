"""Guided colour fits each window with weights, keeps the mean of flat fields, takes no colour from
invalid samples, and reduces fringes on arrays without a denser channel.
"""

import numpy as np
from isethdr_isp.demosaic.guided_colour import LEAST_VARIANCE_E2, guided_colour
from isethdr_isp.demosaic.learned import learned
from isethdr_isp.demosaic.methods import interpolate

RG_WB = np.array([[0, 1], [3, 2]])
NAMES = list("RGBW")


def tiled(cell, shape):
    return np.tile(cell, [n // k + 1 for n, k in zip(shape, cell.shape)])[: shape[0], : shape[1]]


def test_each_pixel_takes_the_mean_of_weighted_line_fits():
    """Compare with a fit by numpy in each of the 49 windows, one pixel at a time."""
    rng = np.random.default_rng(0)
    planes = rng.uniform(10, 1000, (3, 31, 33))
    variance = np.where(np.arange(33) < 16, 5.0, 80.0) * np.ones((31, 1))
    usable = rng.uniform(size=(31, 33)) > 0.2
    usable[15, 16] = True
    noise = np.zeros(usable.shape)
    for y in range(9, 22):
        for x in range(10, 23):
            around = np.s_[y - 5 : y + 6, x - 5 : x + 6]
            noise[y, x] = 3 * variance[around][usable[around]].mean()
    total = planes.sum(0)
    seen = guided_colour(planes, variance, usable)
    expected = []
    for y in range(12, 19):
        for x in range(13, 20):
            if not usable[y, x]:
                continue
            window = np.s_[y - 3 : y + 4, x - 3 : x + 4]
            w = (usable[window] / noise[window]).ravel()
            s = total[window].ravel()
            k = planes[(slice(None), *window)].reshape(3, -1)
            covariance = np.cov(np.vstack([s, k]), aweights=w, ddof=0)
            slope = covariance[0, 1:] / (covariance[0, 0] + noise[y, x])
            mean = np.average(np.vstack([s, k]), axis=1, weights=w)
            expected.append(mean[1:] + slope * (total[15, 16] - mean[0]))
    # 1e-9: rounding of running sums
    np.testing.assert_allclose(seen[:, 15, 16], np.mean(expected, 0), rtol=1e-9)
    np.testing.assert_array_equal(seen[:, ~usable], planes[:, ~usable])


def test_planes_of_one_colour_come_back_whatever_the_light():
    """If the ratios of the channels are the same everywhere, each channel is an exact linear
    function of the sum.
    """
    rng = np.random.default_rng(1)
    light = rng.uniform(1, 10, (40, 40)) * np.where(np.arange(40) < 20, 1.0, 1e4)
    planes = np.array([0.6, 1.0, 0.5, 2.0])[:, None, None] * light
    seen = guided_colour(planes, np.full((40, 40), LEAST_VARIANCE_E2), np.ones((40, 40), bool))
    # 1e-5: noise of 1e-6 e^2 against a spread of 10 e^2 or more, and rounding of values of 1e4 next
    # to values of 1
    np.testing.assert_allclose(seen, planes, rtol=1e-5)


def test_values_that_are_not_usable_change_no_other_pixel():
    rng = np.random.default_rng(2)
    planes = rng.uniform(10, 20, (4, 30, 30))
    usable = np.ones((30, 30), bool)
    usable[10:14, 12:15] = False
    clipped = np.where(usable, planes, 1e5)
    variance = np.full((30, 30), 15.0)
    variance_clipped = np.where(usable, variance, 1e5)  # shot noise of the clipped values
    first = guided_colour(planes, variance, usable)
    second = guided_colour(clipped, variance_clipped, usable)
    # 1e-9: rounding of running sums
    np.testing.assert_allclose(first[:, usable], second[:, usable], rtol=1e-9)


def test_dark_flat_fields_keep_their_mean():
    rng = np.random.default_rng(3)
    filters = tiled(RG_WB, (160, 160))
    colour = 3 * np.array([0.6, 0.9, 0.5, 1.6])
    mosaic = rng.poisson(colour[filters]) + 2 * rng.standard_normal(filters.shape)
    variance = np.maximum(mosaic + 4, 0.4)
    planes = learned(mosaic, filters, NAMES, variance)
    guided = guided_colour(planes, variance, np.ones(filters.shape, bool))
    change = (guided - planes).mean((1, 2)) / colour
    # over 2^20 pixels the change is at most 0.06 %; over the 25 600 pixels here, four standard
    # deviations of it are 0.2 %. Weights from the noise of 5 x 5 pixels would change the mean by
    # 0.6 to 0.9 %, weights from the noise of one pixel by 6 %.
    assert np.all(np.abs(change) < 0.0026)


def test_fine_grey_detail_has_less_colour_where_no_channel_is_denser():
    """The scene is grey, with posts two pixels wide before a dark field."""
    y, x = np.mgrid[:64, :72]
    light = 50 + 5000 * (x % 13 < 2) + 2000 * (x + 2 * y > 160)
    planes = np.array([0.6, 0.9, 0.5, 1.6])[:, None, None] * light
    filters = tiled(RG_WB, light.shape)
    mosaic = np.take_along_axis(planes, filters[None], 0)[0]
    variance = mosaic + 4
    clean = np.zeros(light.shape, bool)
    seen = interpolate("learned", mosaic, filters, NAMES, variance, clean).planes
    before = learned(mosaic, filters, NAMES, variance)
    grey = planes[0, 0, 0] / planes[:, 0, 0].sum()
    error, error_before = ((p[0] / p.sum(0) - grey)[8:-8, 8:-8].std() for p in (seen, before))
    assert error < 0.7 * error_before  # measured: 0.55


def test_arrays_with_a_denser_channel_keep_the_learned_filters_alone():
    rng = np.random.default_rng(4)
    for cell, names in (
        (np.array([[0, 1], [1, 2]]), "RGB"),
        (np.array([[3, 1, 3, 0], [1, 3, 0, 3], [3, 2, 3, 1], [2, 3, 1, 3]]), "RGBW"),
    ):
        filters = tiled(cell, (24, 28))
        mosaic = rng.uniform(50, 100, filters.shape)
        args = mosaic, filters, list(names), mosaic
        seen = interpolate("learned", *args, np.zeros(filters.shape, bool)).planes
        np.testing.assert_array_equal(seen, learned(*args))

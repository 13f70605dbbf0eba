"""Steps of the demosaic that take less time than the plain ones give the same values."""

import numpy as np
import pytest
from isethdr_isp.demosaic import learned, local_classes, methods
from scipy.ndimage import binary_dilation, maximum_filter, minimum_filter


def bayer(shape):
    return np.indices(shape)[0] % 2 + np.indices(shape)[1] % 2


def noisy(shape, seed=0):
    return np.random.default_rng(seed).gamma(0.5, 200.0, shape)


@pytest.mark.parametrize("shape", [(9, 31), (40, 57)])
def test_extremes_of_windows_are_those_of_all_neighbours(shape):
    values = noisy(shape)
    values[3, ::4] = np.inf
    lowest = learned._of_windows(np.minimum, values)
    np.testing.assert_array_equal(lowest, minimum_filter(values, learned.SIDE, mode="mirror"))
    highest = learned._of_windows(np.maximum, values)
    np.testing.assert_array_equal(highest, maximum_filter(values, learned.SIDE, mode="mirror"))
    assert lowest.flags.c_contiguous  # a transposed result would slow down all that follows


@pytest.mark.parametrize("shape, reach", [((2, 3), 3), ((30, 41), 2), ((30, 41), 3)])
def test_pixels_near_a_bad_one_are_those_of_a_square_around_it(shape, reach):
    bad = np.random.default_rng(1).random(shape) < 0.01
    bad[0, -1] = True
    side = 2 * reach + 1
    near = methods._dilated(bad, reach)
    np.testing.assert_array_equal(near, binary_dilation(bad, np.ones((side, side))))
    assert near.flags.c_contiguous


def test_values_equal_to_an_edge_and_not_a_number_count_as_in_a_sorted_search():
    edges = local_classes.SNR_EDGES
    values = np.array([[-np.inf, 0.0, *edges], [np.nan, np.inf, *np.nextafter(edges, np.inf)]])
    np.testing.assert_array_equal(
        local_classes._edges_below(edges, values), np.searchsorted(edges, values)
    )


def test_classes_of_two_arrays_of_one_size_do_not_mix():
    shape = (24, 24)
    mosaic = noisy(shape)
    variance = mosaic + 4.0
    white_between = np.tile([[3, 1, 3, 0], [1, 3, 0, 3], [3, 2, 3, 1], [2, 3, 1, 3]], (6, 6))
    first = [local_classes.classes(mosaic, f, variance) for f in (bayer(shape), white_between)]
    local_classes._same_filter.cache_clear()
    again = [local_classes.classes(mosaic, f, variance) for f in (white_between, bayer(shape))]
    np.testing.assert_array_equal(first, again[::-1])
    assert np.any(first[0] != first[1])


def test_shipped_filters_of_an_array_are_looked_up_once(monkeypatch):
    shape = (40, 44)
    names = ["R", "G", "B"]
    mosaic = noisy(shape)
    given = learned.learned(mosaic, bayer(shape), names, mosaic + 4.0, learned.load())
    learned._shipped.cache_clear()
    np.testing.assert_array_equal(learned.learned(mosaic, bayer(shape), names, mosaic + 4.0), given)
    monkeypatch.setattr(learned, "matching", None)
    np.testing.assert_array_equal(learned.learned(mosaic, bayer(shape), names, mosaic + 4.0), given)


def test_the_number_of_pixels_computed_at_a_time_does_not_matter(monkeypatch):
    shape = (150, 200)
    mosaic = noisy(shape, seed=5)
    of_size = []
    for size in (1 << 11, 1 << 16):
        monkeypatch.setattr(learned, "AT_ONCE", size)
        of_size.append(learned.learned(mosaic, bayer(shape), ["R", "G", "B"], mosaic + 4.0))
    # a library may add the 49 products of a filter in another order: each of 49 additions of at
    # most 1e5 e is rounded by at most 2^-53 of them
    np.testing.assert_allclose(*of_size, rtol=0, atol=49 * 1e5 * 2**-53)

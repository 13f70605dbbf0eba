"""Laws that hold for any input, tried on inputs that hypothesis generates."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from isethdr_core.lighting import WeightsLighting
from isethdr_core.physics.convolution import convolve, convolve_with_bound
from isethdr_core.physics.detector.noise import poisson
from isethdr_core.physics.resampling.area import resample_mean
from isethdr_core.quantities import centres, scene_radiance

few = settings(max_examples=40, deadline=None, derandomize=True, database=None)
light = st.one_of(st.just(0.0), st.floats(1e-6, 1e6))  # twelve decades, and 0
image = arrays(float, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=light)
kernel = arrays(float, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=light)


@few
@given(image, kernel, st.floats(1e-6, 1e6))
def test_convolution_is_linear_in_brightness(picture, psf, factor):
    a = convolve(picture * factor, psf)
    b = convolve(picture, psf) * factor
    # each result is within its relative bound of 1e-8, plus rounding
    np.testing.assert_allclose(a, b, rtol=3e-8)


@few
@given(image, kernel, st.integers(0, 10**6))
def test_convolution_of_a_sum_is_the_sum(picture, psf, seed):
    other = 10.0 ** np.random.default_rng(seed).uniform(-6, 6, picture.shape)
    np.testing.assert_allclose(
        convolve(picture + other, psf), convolve(picture, psf) + convolve(other, psf), rtol=3e-8
    )


@few
@given(image, kernel)
def test_convolution_is_never_negative_and_makes_no_light(picture, psf):
    out, bound = convolve_with_bound(picture, psf)
    assert out.min() >= 0
    # light may leave at the border, none may come
    assert out.sum() <= picture.sum() * psf.sum() * (1 + bound.relative + 1e-12)


@few
@given(image, kernel)
def test_convolution_keeps_all_light_that_stays_inside(picture, psf):
    ky, kx = psf.shape
    wide = np.pad(picture, ((ky, ky), (kx, kx)))
    assert (
        abs(convolve(wide, psf).sum() - picture.sum() * psf.sum())
        <= 3e-8 * picture.sum() * psf.sum()
    )


@few
@given(
    arrays(float, st.tuples(st.integers(2, 15), st.integers(2, 15)), elements=light),
    st.integers(1, 9),
    st.integers(1, 9),
)
def test_resampling_onto_rectangles_that_cover_the_tiles_keeps_their_light(tiles, rows, columns):
    ny, nx = tiles.shape
    out = resample_mean(
        tiles,
        centres(nx, 1.0),
        centres(ny, 1.0),
        centres(columns, 1.0),
        centres(rows, 1.0),
        1 / columns,
        1 / rows,
    )
    assert out.min() >= 0 and out.max() <= tiles.max() * (1 + 1e-12)
    # float64 sums of positive terms
    assert abs(out.mean() - tiles.mean()) <= 1e-12 * tiles.mean()


@few
@given(
    st.lists(
        st.one_of(st.floats(0, 10), st.floats(0, 1e9), st.floats(0, 1e18)), min_size=2, max_size=30
    ),
    st.integers(-(2**63), 2**63 - 1),
)
def test_a_brighter_pixel_never_counts_less(means, word):
    counts = poisson(np.sort(means), np.full(len(means), word, np.int64))
    assert np.all(np.diff(counts) >= 0) and counts.min() >= 0 and np.all(counts == np.rint(counts))


@few
@given(st.floats(0, 1e12), st.lists(st.integers(-(2**63), 2**63 - 1), min_size=2, max_size=30))
def test_a_luckier_word_never_counts_less(mean, words):
    # words from 0 up give the upper tail, with the largest count at 0; negative words give the
    # lower tail, with the smallest count at -1
    ordered = sorted(words, key=lambda w: -1 - w if w < 0 else 2**64 - w)
    counts = poisson(np.full(len(ordered), mean), np.array(ordered, np.int64))
    assert np.all(np.diff(counts) >= 0)


@few
@given(
    arrays(
        np.float32,
        (2, 3, 4, 5),
        elements=st.one_of(st.just(np.float32(0)), st.floats(2.0**-20, 2.0**20, width=32)),
    ),
    st.floats(1e-6, 1e6),
    st.floats(1e-6, 1e6),
    st.floats(1e-3, 1e3),
)
def test_lighting_is_linear_in_its_weights(cube, first, second, factor):
    scene = scene_radiance(
        cube, ["a", "b"], [450.0, 550.0, 650.0], centres(5, 0.1), centres(4, 0.1)
    )
    mixed = WeightsLighting(weights={"a": first, "b": second})(scene).values
    np.testing.assert_allclose(
        WeightsLighting(weights={"a": first * factor, "b": second * factor})(scene).values,
        mixed * factor,
        rtol=3e-7,
    )
    parts = sum(
        WeightsLighting(weights={g: w})(scene).values.astype(float)
        for g, w in (("a", first), ("b", second))
    )
    np.testing.assert_allclose(mixed, parts, rtol=2e-7)  # both sides are rounded to float32

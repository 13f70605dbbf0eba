"""Bands convolved together into channels, against one convolution per band; and the basis with
which few functionals are enough.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from isethdr_core.physics.colour.spectral_basis import (
    directions,
    kernel_moments,
    predictor,
    shot_noise_moments,
)
from isethdr_core.physics.convolution import convolve, prepare
from isethdr_core.physics.convolution.spectral import channels, matrix_product

BANDS = 9
SHAPE = (40, 53)
rng = np.random.default_rng(0)
WAVE = np.linspace(0, 1, BANDS)
WEIGHTS = np.stack([np.exp(-(((WAVE - c) / 0.25) ** 2)) for c in (0.2, 0.5, 0.8)])


def psf(band, mirrored=True):
    y = np.arange(1 - SHAPE[0], SHAPE[0])
    x = np.arange(1 - SHAPE[1], SHAPE[1])
    k = (1 + np.hypot(y[:, None], x)) ** -(2.5 + WAVE[band]) * (
        1 + 0.9 * np.cos((1 + WAVE[band]) * (y[:, None] + 2 * x))
    )
    if not mirrored:
        k = k * (1 + 0.1 * np.tanh(x))
    return k / k.sum()


def night(count=4):
    """Return a cube (band, y, x) mixed from `count` spectra, with lamps of 1e8 times the
    background.
    """
    spectra = rng.uniform(0.1, 1, (count, BANDS))
    amount = rng.uniform(0.5, 1.5, (count, *SHAPE))
    amount[0, 20, 30] = amount[1, 5, 50] = 1e8
    return np.tensordot(spectra.T, amount, 1)


def by_bands(cube, kernels, factor=1.0):
    each = np.stack([convolve(c * factor, k) for c, k in zip(cube, kernels)])
    return np.tensordot(WEIGHTS, each, 1)


def given(cube, kernels, project, predict, factor=1.0, **more):
    ready = [prepare(k, SHAPE) for k in kernels]
    out = np.zeros((len(WEIGHTS), *SHAPE))
    combine = WEIGHTS[:, None, :] * predict.T * [k.peak for k in ready]
    planes = np.tensordot(project, cube, 1) * factor
    channels(
        out,
        lambda rows: planes[:, rows],
        combine,
        np.stack([k.spectrum for k in ready]),
        ready[0].size,
        **more,
    )
    return out


@pytest.mark.parametrize("mirrored", [True, False])
def test_with_as_many_functionals_as_bands_nothing_is_lost(mirrored):
    cube = night()
    kernels = [psf(b, mirrored) for b in range(BANDS)]
    project = rng.normal(size=(BANDS, BANDS))
    factor = rng.uniform(0.2, 1, SHAPE)
    with ThreadPoolExecutor(2) as pool:
        out = given(cube, kernels, project, np.linalg.inv(project), factor=factor, apply=pool.map)
    # float64 rounding of transforms with lamps of 1e8, times the condition number of the random
    # basis
    np.testing.assert_allclose(out, by_bands(cube, kernels, factor), rtol=1e-7)


def test_as_many_functionals_as_there_are_spectra_are_enough():
    cube = night(4)
    kernels = [psf(b) for b in range(BANDS)]
    moments = shot_noise_moments(cube.reshape(BANDS, -1).T, cube.sum(0).ravel())
    points = np.stack([k[::3, ::3].ravel() for k in kernels], axis=1)
    rows = directions(WEIGHTS, moments / np.trace(moments), kernel_moments(points, WEIGHTS))
    want = by_bands(cube, kernels)
    errors = []
    for count in (3, 4):
        project = rows[:count]
        out = given(cube, kernels, project, predictor(project, moments))
        errors.append(np.abs(out / want - 1).max())
    assert errors[1] < 1e-9, errors  # four functionals for four spectra: rounding of a fit
    assert errors[0] > 1e-6  # three are too few, so the test can fail


def test_what_the_channels_see_is_exact_where_the_blur_is_the_same_in_every_band():
    cube = night(6)
    kernels = [psf(0)] * BANDS
    rows = directions(WEIGHTS, np.eye(BANDS), np.eye(BANDS))[:3]
    out = given(cube, kernels, rows, predictor(rows, np.eye(BANDS)))
    # the residual spectrum makes no electrons
    np.testing.assert_allclose(out, by_bands(cube, kernels), rtol=1e-9)


def test_directions_begin_with_the_channels_and_are_independent():
    rows = directions(WEIGHTS, np.eye(BANDS) + 0.5, np.diag(np.arange(1.0, BANDS + 1)))
    assert rows.shape == (BANDS, BANDS)
    assert np.linalg.matrix_rank(np.concatenate([rows[:3], WEIGHTS]), tol=1e-9) == 3
    assert np.linalg.matrix_rank(rows, tol=1e-6) == BANDS
    alike = directions(np.concatenate([WEIGHTS, 2 * WEIGHTS]), np.eye(BANDS), np.eye(BANDS))
    # channels with proportional weights count once
    assert np.linalg.matrix_rank(np.concatenate([alike[:3], WEIGHTS]), tol=1e-9) == 3


def test_matrix_product_is_the_matrix_product():
    weights = rng.normal(size=(5, BANDS))
    values = rng.normal(size=(BANDS, 60, 1100))
    np.testing.assert_allclose(
        matrix_product(weights, values), np.einsum("kb,byx->kyx", weights, values), atol=1e-12
    )

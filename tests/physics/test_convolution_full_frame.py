"""Convolution of 1080 x 1920 pixels with a kernel that reaches from any pixel to any other, against
long double sums at some pixels.
"""

import numpy as np
import pytest

from isethdr_core.physics.convolution import convolve, prepare

SHAPE = (1080, 1920)
pytestmark = pytest.mark.slow


def kernel(name):
    y, x = (np.arange(1 - n, n) for n in SHAPE)
    if name == "skirt":
        psf = (1 + np.hypot(y[:, None], x)) ** -3.0
    else:  # falls below 1e-13 of its peak beyond 1000 pixels
        psf = np.exp(-np.hypot(y[:, None], x) / 33.0)
    return psf / psf.sum()


@pytest.fixture(scope="module", params=["skirt", "steep"])
def prepared(request):
    return prepare(kernel(request.param), SHAPE)


@pytest.mark.parametrize("ratio", [1e8, 1e12])
@pytest.mark.parametrize("lamp", ["pixel", "area"])
def test_right_everywhere_beside_a_lamp(prepared, ratio, lamp):
    rng = np.random.default_rng(0)
    image = rng.uniform(0.5, 1.5, SHAPE)
    image[100 : 100 + (30 if lamp == "area" else 1), 200 : 200 + (40 if lamp == "area" else 1)] = (
        ratio
    )
    got = convolve(image, prepared)
    assert got.min() > 0
    darkest = np.unravel_index(int(np.argmin(got)), SHAPE)
    wide = image.astype(np.longdouble)
    flipped = prepared.psf[::-1, ::-1]
    for i, j in [
        darkest,
        (100, 201),
        (99, 199),
        (1079, 1919),
        *zip(rng.integers(0, SHAPE[0], 8), rng.integers(0, SHAPE[1], 8)),
    ]:
        want = np.sum(
            wide
            * flipped[
                SHAPE[0] - 1 - i : 2 * SHAPE[0] - 1 - i, SHAPE[1] - 1 - j : 2 * SHAPE[1] - 1 - j
            ]
        )
        assert abs(got[i, j] / want - 1) < 1e-7  # stated accuracy


def test_no_light_is_lost_or_made(prepared):
    image = np.zeros(SHAPE)
    image[540, 960] = 1e12
    image[500:580, 900:1000] += 1.0
    ny, nx = SHAPE
    # share of each lit pixel's light that stays in the frame, from sums of the kernel over
    # rectangles
    total = np.zeros((2 * ny, 2 * nx))
    total[1:, 1:] = prepared.psf.cumsum(0).cumsum(1)
    i, j = np.nonzero(image)
    top = ny - 1 - i
    left = nx - 1 - j
    stays = (
        total[top + ny, left + nx]
        - total[top, left + nx]
        - total[top + ny, left]
        + total[top, left]
    )
    # sums of 2e6 float64 values
    assert convolve(image, prepared).sum() == pytest.approx(
        float(np.sum(image[i, j] * stays)), rel=1e-9
    )

"""Overlap-add: sums of convolved parts against the exact convolution of each part, with lamps
up to 1e14 times as bright as the rest.
"""

import numpy as np
import pytest
from isethdr_optics.imaging import overlap_add as overlaid_module
from isethdr_optics.imaging.overlap_add import overlaid

from isethdr_core.physics.convolution import convolve, convolve_with_bound

ALL = (slice(None), slice(None))


def skirt(ny, nx, power=3.0):
    y, x = np.ogrid[-(ny // 2) : ny // 2 + 1, -(nx // 2) : nx // 2 + 1]
    return 1 / (1 + np.hypot(y, x) ** power)


@pytest.mark.parametrize(
    "shape, kernel",
    [((50, 60), (21, 21)), ((30, 40), (59, 79)), ((9, 64), (31, 31)), ((1, 7), (1, 5))],
)
@pytest.mark.parametrize("lamp", [1.0, 1e8])
def test_every_pixel_of_the_sum_is_right(shape, kernel, lamp):
    rng = np.random.default_rng(3)
    light = 10 ** rng.uniform(-6, 0, shape)
    light[0, 5] = lamp
    share = np.linspace(0, 1, shape[1])[None, :] * np.ones(shape)
    k = skirt(*kernel)
    parts = [(ALL, share * light, k), (ALL, (1 - share) * light, skirt(*kernel, 2.0))]
    total, bound = overlaid(parts, shape)
    exact = convolve(share * light, k) + convolve((1 - share) * light, parts[1][2])
    assert total.min() >= 0 and bound.pixels == 0
    # the exact convolution itself has an error of 3e-8
    np.testing.assert_allclose(total, exact, rtol=bound.relative + 3e-8)


@pytest.mark.parametrize("allowed", [1e-2, 1e-4])
def test_an_error_allowed_is_kept_and_spares_work(allowed, monkeypatch):
    """Keep the allowed error without exact sums where the transform is good enough.

    Next to a lamp of 1e10 times the rest, a kernel that falls fast leaves pixels for which the
    transform alone would err by percents.
    """
    calls = []
    monkeypatch.setattr(
        overlaid_module,
        "convolve_with_bound",
        lambda *given: calls.append(1) or convolve_with_bound(*given),
    )
    light = np.full((40, 60), 1e-3)
    k = skirt(79, 119, 6.0)
    light[5, 5] = 1e7
    parts = [(ALL, 0.5 * light, k), (ALL, 0.5 * light, skirt(79, 119, 5.0))]
    exact = sum(convolve(part, kernel) for _, part, kernel in parts)
    total, bound = overlaid(parts, light.shape, allowed)
    spared = len(calls)
    np.testing.assert_allclose(total, exact, rtol=allowed)
    assert bound.relative <= allowed * (1 + 1e-6) and bound.pixels == 0
    overlaid(parts, light.shape)
    # with an allowed error no convolution was repeated; without one, some are
    assert len(calls) - spared > spared == 0


def test_parts_stay_in_their_windows_and_fade_without_trouble():
    light = np.zeros((40, 60))
    light[20, 10:50] = 1.0
    windows = [(slice(None), slice(0, 40)), (slice(None), slice(20, 60))]
    share = np.clip((40 - np.arange(60)) / 20, 0, 1)[None, :]
    k = skirt(21, 21)
    parts = [(w, (light * s)[w], k) for w, s in zip(windows, (share, 1 - share))]
    total, _ = overlaid(parts, light.shape)
    middle = (slice(None), slice(30, 31))
    np.testing.assert_allclose(total[middle], convolve(light, k)[middle], rtol=1e-7)
    assert total[:, :9].max() > 0 and total[20, 30] == pytest.approx(
        convolve(light, k)[20, 30], rel=1e-7
    )


def test_a_part_without_any_light_adds_nothing():
    """Add a part without light, as of a field point from which no light passes the lens."""
    rng = np.random.default_rng(4)
    light = rng.uniform(0.5, 1.5, (20, 24))
    kernel = np.full((5, 5), 0.04)
    window = (slice(0, 20), slice(0, 24))
    alone, _ = overlaid([(window, light, kernel)], (20, 24))
    both, bound = overlaid(
        [(window, light, kernel), (window, np.zeros((20, 24)), kernel)], (20, 24)
    )
    np.testing.assert_array_equal(both, alone)
    assert np.isfinite([bound.relative, bound.absolute]).all()

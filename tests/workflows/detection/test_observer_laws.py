"""The observer follows its closed forms: noise alone, scaling, change of channels, few windows.

d' is the detectability of an object against its surroundings.
"""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_workflows.detection.observer.channels import SCALE, channels, count
from isethdr_workflows.detection.observer.hotelling import detectability, found, threshold

BOX = (18.0, 12.0)
SHAPE = (49, 37)
MIDDLE = (24.5, 18.5)
MANY = 10**9  # number of windows; the correction for few windows is below 1e-7


def made(order: int = 3):
    return channels(SHAPE, MIDDLE, BOX, order)


def blob(width: float = 1.0) -> np.ndarray:
    """Return a Gaussian (1, y, x) `width` times as wide as the channel of order 0, peak 1."""
    y, x = (
        (np.arange(size) + 0.5 - centre) / (SCALE * side * width)
        for size, centre, side in zip(SHAPE, MIDDLE, BOX, strict=True)
    )
    return np.exp(-(y[:, None] ** 2 + x**2) / 4)[None]


def random_covariance(size: int, seed: int = 1) -> np.ndarray:
    factor = np.random.default_rng(seed).normal(size=(size, size))
    return factor @ factor.T


@pytest.mark.parametrize(("width", "least"), [(1.0, 1 - 1e-9), (0.8, 0.95), (1.3, 0.95)])
def test_in_white_noise_a_gaussian_blob_has_its_norm_over_the_noise(width, least):
    """The ideal observer has d' = |s| / sigma. The channel of order 0 is the blob itself, so
    nothing is lost; blobs of other widths lose less than 5 % to the orders above 3. Channels never
    have a larger d' than the ideal observer.
    """
    signal = 0.7 * blob(width)
    at = made()
    d = detectability(at.of(signal), np.zeros((10, 10)), at.noise(1), MANY).d
    ideal = np.linalg.norm(signal)
    assert least * ideal <= d <= ideal * (1 + 1e-9)


@pytest.mark.parametrize(("order", "rectangle", "ellipse"), [(1, 0.78, 0.73), (3, 0.89, 0.87)])
def test_even_objects_lose_as_much_to_the_channels_as_the_docs_say(order, rectangle, ellipse):
    """The docs state two digits; another size in cells changes the third."""
    # the borders of the rectangle lie between cells, so that it fills its box of 20 by 12 cells
    at = channels((54, 34), (27.0, 17.0), (20.0, 12.0), order)
    y, x = np.mgrid[:54, :34] + 0.5
    square = (np.abs(y - 27.0) <= 10) & (np.abs(x - 17.0) <= 6)
    round_one = ((y - 27.0) / 10) ** 2 + ((x - 17.0) / 6) ** 2 <= 1
    for shape, kept in ((square, rectangle), (round_one, ellipse)):
        signal = shape[None] * 1.0
        d = detectability(at.of(signal), np.zeros_like(at.noise(1)), at.noise(1), MANY).d
        assert d / np.linalg.norm(signal) == pytest.approx(kept, abs=0.01)


def test_colours_add_up_in_squares():
    at = made()
    one = 0.3 * blob()
    both = np.concatenate([one, 2 * one])
    d = detectability(at.of(both), np.zeros((20, 20)), at.noise(2), MANY).d
    assert d == pytest.approx(np.sqrt(5) * np.linalg.norm(one))


def test_without_clutter_it_is_noise_alone_and_clutter_only_lowers_it():
    at = made()
    difference = at.of(blob(0.8))
    spread = random_covariance(count(3))
    values = [
        detectability(difference, scale * spread, at.noise(1), MANY) for scale in (0, 1e-9, 0.1, 10)
    ]
    assert values[0].d == pytest.approx(values[0].noise_only)
    assert values[1].d == pytest.approx(values[0].d, rel=1e-6)
    assert values[0].d > values[2].d > values[3].d
    assert {round(value.noise_only, 9) for value in values} == {round(values[0].d, 9)}


def test_it_is_proportional_to_the_inverse_of_all_noise():
    at = made()
    difference = at.of(blob())
    spread = random_covariance(count(3))
    one = detectability(difference, spread, at.noise(1), MANY)
    three = detectability(difference, 9 * spread, 9 * at.noise(1), MANY)
    assert three.d == pytest.approx(one.d / 3)


def test_a_linear_change_of_channels_changes_nothing():
    """This holds with few windows, too: the correction does not depend on coordinates."""
    at = made()
    difference = at.of(blob())
    spread = random_covariance(count(3))
    change = np.random.default_rng(5).normal(size=(10, 10))
    plain = detectability(difference, spread, at.noise(1), 60)
    changed = detectability(
        change @ difference, change @ spread @ change.T, change @ at.noise(1) @ change.T, 60
    )
    assert changed == pytest.approx(plain, rel=1e-6)  # its condition number is below 1e3


@pytest.mark.parametrize("noise", [1e-9, 1.0, 10.0])
def test_few_windows_do_not_raise_it(noise):
    """The inverse of a sample covariance of 10 channels and 40 windows is too large by
    39 / 28 = 1.39. Over 300 samples the corrected square is right within 4 %: its standard error
    is about 0.2 / sqrt(300) = 1.3 %, and with noise the correction is only of first order.
    """
    random = np.random.default_rng(3)
    size = 10
    true = random_covariance(size, 8) / size
    difference = random.normal(size=size)
    factor = np.linalg.cholesky(true)
    known = noise * np.eye(size)
    squares = []
    plain = []
    for _ in range(300):
        samples = random.normal(size=(40, size)) @ factor.T
        value = detectability(difference, np.cov(samples.T), known, 40)
        squares.append(value.d**2)
        plain.append(value.plain**2)
    right = difference @ np.linalg.solve(true + known, difference)
    assert np.mean(squares) == pytest.approx(right, rel=0.04)
    if noise < 1e-6:
        assert np.mean(plain) > 1.25 * right


def test_the_threshold_passes_the_stated_false_alarms():
    limit = threshold(0.1, 2000)
    assert 2000 * (1 - found(limit, 0.0)) == pytest.approx(0.1, rel=1e-6)
    assert found(limit, limit) == pytest.approx(0.5)
    assert np.all(np.diff(found(np.array([0.0, 2.0, 5.0]), limit)) > 0)


@pytest.mark.slow
def test_noise_of_the_renderer_is_no_signal():
    """The differences of an object contain noise of the renderer. Half the difference of the two
    half buffers has the same covariance, and corrects d'^2. Over 4000 renderings the corrected
    square is right within 5 %: its standard error is about 1.2 %.
    """
    random = np.random.default_rng(7)
    at = made(1)
    true = at.of(0.5 * blob())
    spread = random_covariance(3, 2) / 20
    factor = np.linalg.cholesky(random_covariance(3, 4))
    drawn = random.normal(size=(2, 4000, 3)) @ factor.T
    plain = detectability(true, spread, at.noise(1), MANY)
    values = [
        detectability(true + noise, spread, at.noise(1), MANY, half)
        for noise, half in zip(*drawn, strict=True)
    ]
    # d'^2 below 0 counts as 0; the mean is taken over the squares before this
    together = np.linalg.inv(spread + at.noise(1))
    squares = [
        (true + noise) @ together @ (true + noise) - half @ together @ half
        for noise, half in zip(*drawn, strict=True)
    ]
    assert np.mean(squares) == pytest.approx(plain.d**2, rel=0.05)
    assert [v.plain**2 for v in values] == pytest.approx(np.maximum(squares, 0), abs=1e-9)
    wrong = detectability(true + drawn[0][0], spread, at.noise(1), MANY).plain
    assert wrong**2 > values[0].plain ** 2


def test_a_frame_without_a_free_window_has_outputs_of_no_window():
    made = channels((9, 9), (4.5, 4.5), (4.0, 4.0), 3)
    assert made.of(np.zeros((0, 3, 9, 9))).shape == (0, 3 * count(3))

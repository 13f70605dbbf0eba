"""Statistics of pictures, tested on random pictures of known slopes, histograms and differences."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_measured.photographs import (
    NORMAL_KURTOSIS,
    SLOPES,
    amplitude_slope,
    photographs,
    statistics,
)

SHAPE = (108, 192)


def noise(slope: float, seed: int, shape: tuple[int, int] = SHAPE) -> np.ndarray:
    """Return normal noise (y, x) of variance 1 with an amplitude spectrum of a given log slope."""
    random = np.random.default_rng(seed)
    frequency = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1]))
    frequency[0, 0] = np.inf
    spectrum = np.fft.rfft2(random.normal(size=shape)) * frequency**slope
    drawn = np.fft.irfft2(spectrum, shape)
    return drawn / drawn.std()


@pytest.mark.parametrize("slope", [0.0, -0.8, -1.2, -1.5])
def test_the_slope_of_drawn_noise_is_found(slope):
    """The slope of each picture is right to 0.12: three standard deviations of one picture of this
    size (0.04, measured over 50 draws). The mean of eight is right to 0.06, including the bias of
    the window.
    """
    found = [amplitude_slope(noise(slope, seed)) for seed in range(8)]
    assert np.mean(found) == pytest.approx(slope, abs=0.06)
    assert np.abs(np.array(found) - slope).max() < 0.12


def test_a_factor_and_an_offset_change_no_slope():
    picture = noise(-1.2, 3)
    expected = amplitude_slope(picture)
    assert amplitude_slope(1e4 * picture + 7.0) == pytest.approx(expected, abs=1e-9)


def test_a_log_normal_picture_has_the_spread_skew_and_kurtosis_of_its_law():
    """Neighbours are independent, so the differences are normal too. Of 20736 tiles the standard
    errors are 0.5 % of the spread, 0.017 of the skew and 0.034 of the kurtosis.
    """
    random = np.random.default_rng(5)
    spread_decades = 0.7
    picture = 10.0 ** (2.0 + spread_decades * random.normal(size=SHAPE))
    found = statistics(picture)
    assert found.spread_decades == pytest.approx(spread_decades, rel=0.02)
    assert abs(found.skew) < 0.06
    assert found.kurtosis == pytest.approx(NORMAL_KURTOSIS, abs=0.15)
    assert found.log_slope == pytest.approx(0.0, abs=0.12)
    scaled = statistics(1e-6 * picture)
    assert scaled == pytest.approx(found, rel=1e-9, abs=1e-9)


def test_skew_and_kurtosis_of_other_laws():
    """Log luminance that is exponential has a skew of 2, and its differences are Laplace's, of
    kurtosis 6. The standard errors are 0.06 and 0.3.
    """
    picture = np.exp(np.random.default_rng(1).exponential(size=SHAPE))
    found = statistics(picture)
    assert found.skew == pytest.approx(2.0, abs=0.2)
    assert found.kurtosis == pytest.approx(6.0, abs=1.0)


def test_tiles_without_light_do_not_count_as_minus_infinity():
    picture = np.exp(noise(-1.0, 2))
    picture[0, :5] = 0.0
    assert np.isfinite(statistics(picture)).all()


def test_rows_say_what_photographs_have(monkeypatch):
    """The street of one lighting is 1/f noise, and that of the other is white noise."""
    drawn = {"day": np.exp(0.3 * noise(-1.2, 1)), "dusk": np.exp(0.3 * noise(0.0, 1))}
    place = "isethdr_measured.photographs.street_luminance"
    monkeypatch.setattr(place, lambda road, lighting, effort: drawn[lighting])
    rows = photographs(roads="village", lightings="day,dusk")
    assert [row["lighting"] for row in rows] == ["day", "dusk"]
    assert [row["slope_seen"] for row in rows] == [True, False]
    assert SLOPES[0] < rows[0]["slope"] < SLOPES[1]

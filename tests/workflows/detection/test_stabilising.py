"""Stabilised values have a noise of 1 for any captures, and saturate where all captures do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from isethdr_workflows.detection.exposing import few
from isethdr_workflows.detection.stabilising import (
    Reading,
    Readings,
    Stabiliser,
    information,
    readings,
    variances,
)

from isethdr_core.plugins.registry import build

WELL_E = 20_000.0


def reading(charge=0, read=2.0, top=WELL_E, sensitivity=1.0, **more) -> Reading:
    fields = {"dark_e": 0.5, "prnu": 0.0} | more
    return Reading(charge, fields["dark_e"], read**2, top, fields["prnu"], np.array([sensitivity]))


def test_one_capture_has_the_closed_form():
    """The information is I = 1 / (s + dark + read^2). The integral of its square root is
    2 sqrt(s + dark + read^2), minus the value at s = 0. Tables of 60 points per decade are right
    to 1e-3.
    """
    level = np.array([0.01, 1.0, 30.0, 1000.0])
    made = Stabiliser(Readings((reading(),)), 5000.0)
    floor = 0.5 + 4.0
    expected = 2 * (np.sqrt(level + floor) - np.sqrt(floor))
    assert made(level, 0) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("mean_e", [20.0, 300.0, 5000.0])
def test_the_noise_of_a_stabilised_value_is_1(mean_e):
    """40 000 pixels give a standard deviation to 0.35 %; 2 % covers the curvature of the function
    at 20 e.
    """
    random = np.random.default_rng(2)
    made = Stabiliser(Readings((reading(),)), 2 * WELL_E)
    counts = random.poisson(mean_e + 0.5, 40_000) - 0.5 + random.normal(0, 2.0, 40_000)
    assert made(counts, 0).std() == pytest.approx(1.0, abs=0.02)


def test_charges_add_their_information_and_reads_of_one_charge_share_the_shot_noise():
    level = np.array([100.0])
    one = information(Readings((reading(),)), 0, level)
    twice = information(Readings((reading(), reading())), 0, level)
    apart = information(Readings((reading(), reading(charge=1))), 0, level)
    assert apart == pytest.approx(2 * one)
    assert twice == pytest.approx(1 / (level + 0.5 + 2.0))  # read variance 4 / 2


def test_beyond_all_tops_nothing_is_told_apart_and_a_small_photodiode_goes_on():
    long = reading()
    short = reading(charge=1, sensitivity=0.01, top=7900.0)
    alone = Stabiliser(Readings((long,)), 1e7)
    both = Stabiliser(Readings((long, short)), 1e7)
    bright = np.array([5e4, 2e5])
    assert np.ptp(alone(bright, 0)) == pytest.approx(0.0, abs=1e-6)
    # the difference is sqrt(0.01) of that of the large photodiode, 2 sqrt(s)
    assert np.ptp(both(bright, 0)) == pytest.approx(0.2 * np.ptp(np.sqrt(bright)), rel=0.02)


def test_response_nonuniformity_ends_the_growth():
    """With a PRNU of 1 % the signal to noise ratio of a pixel stays below 100."""
    level = np.array([1e4, 1e6])
    made = Readings((reading(prnu=0.01, top=1e9),))
    snr = level * np.sqrt(information(made, 0, level))
    assert snr[0] == pytest.approx(1 / np.sqrt(1e-4 + 1e-4), rel=0.01)
    assert snr[1] == pytest.approx(100, rel=0.01)


def test_companded_codes_have_the_noise_of_their_own_steps():
    """Steps are 1 DN (10 e) below the knee at 512 DN, and 4 DN (40 e) above it."""
    captures = xr.Dataset(
        {
            "companding_dn": (("capture", "entry"), [[0.0, 512.0, 768.0, np.nan]]),
            "companding_linear_dn": (("capture", "entry"), [[0.0, 512.0, 1536.0, np.nan]]),
            "gain_dn_per_e": ("capture", [0.1]),
            "black_dn": ("capture", [16.0]),
            "quantisation_e": ("capture", [10.0]),
        }
    )
    made = replace(reading(read=2.0), variances=variances(captures, 0, 4.0))
    levels = np.array([100.0, 4900.0, 5000.0, 15_000.0])
    expected = 4.0 + np.array([10.0, 10.0, 40.0, 40.0]) ** 2 / 12
    assert made.variance_beyond_shot(levels) == pytest.approx(expected)
    assert variances(captures.drop_vars("companding_dn"), 0, 4.0) is None


@pytest.fixture(scope="module")
def even_light():
    """Return a uniform field of daylight on the sensor plane, 24 x 24 tiles of 3 um."""
    scene = build("scene", "uniform", width=24, height=24, luminance_cd_m2=100.0)()
    mixed = build("lighting", "ideal")(scene)
    focal_mm = 24 * 3e-3 / mixed.attrs["field_width"]
    return build("lens", "ideal", focal_length_mm=focal_mm, falloff="none")(mixed)


def test_a_code_combined_on_the_chip_tells_no_more_than_its_captures_and_as_much_in_the_dark(
    even_light,
):
    """In the dark the code comes from LPHG alone; the other captures of the same charge have 4
    times its steps, and would add 3 % at most. In bright light the code comes from SPLG alone, and
    the other charge would add nothing.
    """
    apart = readings(few(build("sensor", "split_pixel"), even_light))
    levels = np.geomspace(0.1, 1e6, 36)
    whole = information(apart, 1, levels)
    for bits in (20, 24):
        sensor = build("sensor", "split_pixel", combine_bits=bits)
        joined = information(readings(few(sensor, even_light)), 1, levels)
        assert np.all(joined <= 1.001 * whole)
        dark = levels < 100
        assert joined[dark] == pytest.approx(whole[dark], rel=0.1)
        bright = (levels > 1e5) & (levels < 5e5)
        assert np.all(joined[bright] > 0.3 * whole[bright])

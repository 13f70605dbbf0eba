"""Automatic exposure is inversely proportional to the light, stays within its limits, and does not
depend on noise.
"""

import numpy as np
import pytest
from isethdr_sensors.timing import auto_exposure

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.uncertainty import ledger

RULES = ["centre", "histogram", "percentile", "highlights"]


def light_of(make_light, factor=1.0):
    """Return light over three decades, and one pixel of 1600 a hundred times brighter."""
    level = np.geomspace(1e-6, 1e-3, 40 * 40).reshape(40, 40)
    level[20, 20] = 0.1
    return make_light(np.broadcast_to(factor * level, (31, 40, 40)).copy(), pitch_um=3.75)


def sensor(name="bayer", **fields):
    return hdr.build(
        "sensor",
        name,
        **{"exposure_rule": "centre", "exposure_min_s": 1e-9, "exposure_max_s": 100.0, **fields},
    )


@pytest.mark.parametrize("rule", RULES)
def test_twice_the_light_takes_half_the_time(rule, make_light):
    camera = sensor(exposure_rule=rule, dark_e_per_s=0.0)
    once, iterations = auto_exposure.solve(camera, light_of(make_light))
    twice, _ = auto_exposure.solve(camera, light_of(make_light, 2.0))
    assert twice == pytest.approx(once / 2, rel=1e-9) and 0 < iterations < 50


@pytest.mark.parametrize("rule", RULES)
def test_the_level_meets_its_target(rule, make_light):
    """Meter again, independently of the solver, on the mean electrons at the solved exposure."""
    light = light_of(make_light)
    camera = sensor(exposure_rule=rule, exposure_target=0.4)
    with ledger.stage(ledger.Ledger(), "sensor") as row:
        exposure_s, _ = auto_exposure.solve(camera, light)
    share = hdr.build("sensor", "bayer", exposure_s=exposure_s).expected(light).values[0] / 25455
    offset = np.arange(40) - 19.5
    weight = np.exp(-(offset[:, None] ** 2 + offset**2) / 2 / (np.hypot(40, 40) / 4) ** 2)
    level = {
        "centre": np.average(np.minimum(share, 1), weights=weight),
        "histogram": np.median(share),
        "percentile": np.percentile(share, 95.0),
        "highlights": np.sort(share, axis=None)[-2],  # all but the lamp
    }[rule]
    # 3e-4: one code of the converter, 6.3 e of 25 455
    assert level == pytest.approx(0.4, rel=3e-4)
    assert row.errors[0].value < 1e-9 and "iterations" in row.errors[0].label


@pytest.mark.parametrize(("limits", "expected_s"), [((1e-9, 1e-8), 1e-8), ((50.0, 100.0), 50.0)])
def test_limits_hold_and_are_stated(limits, expected_s, make_light):
    camera = sensor(exposure_min_s=limits[0], exposure_max_s=limits[1])
    with ledger.stage(ledger.Ledger(), "sensor") as row:
        found, iterations = auto_exposure.solve(camera, light_of(make_light))
    assert (found, iterations) == (expected_s, 0)
    assert "at its limit" in row.errors[0].label and row.errors[0].value > 0.1


@pytest.mark.parametrize(
    "name", ["bayer", "split_pixel", "dual_gain", "staggered", "lofic", "lin_log", "interleaved"]
)
def test_every_sensor_exposes_by_its_means(name, make_light):
    light = light_of(make_light)
    noisy, calm = (
        sensor(name, noise=noise)(light, hdr.generator(seed=seed))
        for noise, seed in ((True, 1), (False, 2))
    )
    np.testing.assert_array_equal(noisy.exposure_s.values, calm.exposure_s.values)
    fixed = hdr.build("sensor", name, exposure_s=float(noisy.exposure_s[0]))(
        light, hdr.generator(seed=1)
    )
    np.testing.assert_array_equal(noisy.raw.values, fixed.raw.values)
    assert noisy.attrs["exposure_iterations"] > 0 and "exposure_iterations" not in fixed.attrs


@pytest.mark.parametrize("name", ["bayer", "split_pixel", "staggered", "lofic", "lin_log"])
def test_highlights_are_kept_in_some_capture(name, make_light):
    camera = sensor(name, exposure_rule="highlights", exposure_lamp_ratio=np.inf)
    out = camera(light_of(make_light), hdr.generator())
    assert not out.saturated.values.all(axis=0).any()


def test_a_chart_by_day_and_by_night_fills_the_same_share():
    def shot(luminance, **fields):
        scene = hdr.build(
            "scene",
            "macbeth",
            width=60,
            height=40,
            horizontal_field_deg=5.0,
            luminance_cd_m2=luminance,
        )()
        mixed = hdr.build("lighting", "weights", weights={"sky": 1.0})(scene)
        return sensor(**fields)(hdr.build("lens", "ideal")(mixed), hdr.generator())

    assert shot(1e4, exposure_rule="fixed").saturated.values.any()
    day, night = (shot(level, exposure_rule="highlights", dark_e_per_s=0.0) for level in (1e4, 1.0))
    assert not day.saturated.values.any()
    # spectral radiance is float32
    assert float(night.exposure_s[0]) == pytest.approx(1e4 * float(day.exposure_s[0]), rel=1e-6)


def test_darkness_takes_the_longest_exposure(make_light):
    dark = make_light(np.zeros((31, 16, 16)), pitch_um=3.75)
    out = sensor(exposure_max_s=0.033, dark_e_per_s=0.0)(dark, hdr.generator())
    assert float(out.exposure_s[0]) == 0.033 and not out.saturated.values.any()


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"exposure_rule": "center"}, "exposure_rule"),
        ({"exposure_target": 1.0}, "exposure_target"),
        ({"exposure_min_s": 0.0}, "exposure_min_s"),
        ({"exposure_min_s": 200.0}, "exposure_min_s"),
        ({"exposure_s": 0.0}, "exposure_s"),
        ({"exposure_s": 3.2e7}, "to 3600"),
        ({"exposure_s": float("nan")}, "exposure_s"),
    ],
)
def test_bad_fields_are_refused_by_name(fields, said):
    from isethdr_sensors import BayerSensor

    with pytest.raises(ConfigError, match=said):
        BayerSensor(**fields)


def test_each_exposure_is_solved_on_its_own(make_light):
    """T1 meets its rule, the last exposure has the brightest pixel at the target, and the ratios
    between neighbouring exposures are equal.
    """
    light = light_of(make_light)
    camera = sensor(
        "staggered",
        exposure_each=True,
        exposure_rule="histogram",
        exposure_ratios=(1.0, 0.5, 0.25, 0.125),
        noise=False,
    )
    shot = camera(light, hdr.generator(1))
    exposures = np.asarray(shot["exposure_s"].values, float)
    alone, _ = auto_exposure.solve(sensor("bayer", exposure_rule="histogram"), light)
    # T1 equals the exposure of a sensor with one exposure
    assert exposures[0] == pytest.approx(alone, rel=1e-6)
    np.testing.assert_allclose(
        exposures[1:] / exposures[:-1], exposures[1] / exposures[0], rtol=1e-9
    )
    full_e = sensor("staggered").full_scale_e()[0]
    brightest = (
        hdr.build("sensor", "bayer", exposure_s=float(exposures[-1])).expected(light).values.max()
    )
    # 0.5 is the target; it includes dark charge
    assert brightest / full_e == pytest.approx(0.5, rel=1e-3)


@pytest.mark.parametrize("full_well_e", [3000.0, 25455.0])
def test_the_last_exposure_meets_its_target_at_the_gain_of_the_first(make_light, full_well_e):
    """A gain of 16 reduces the full scale from the full well, or from the swing, to 1590 e."""
    light = light_of(make_light)
    camera = sensor(
        "staggered",
        exposure_each=True,
        exposure_rule="histogram",
        exposure_max_s=1e-3,
        auto_gain_max=16.0,
        full_well_e=full_well_e,
    )
    chosen = camera.automatic(light).exposure
    settled = camera.at_exposure(chosen)
    last_e = settled.expected(light).values[-1].max()
    assert chosen.gain == 16.0
    assert last_e / settled.full_scale_e()[-1] == pytest.approx(0.5, rel=1e-3)


def test_captures_combined_on_the_chip_get_the_same_exposures(make_light):
    light = light_of(make_light)
    fields = {"exposure_each": True, "exposure_rule": "histogram"}
    apart, together = (
        sensor("staggered", **fields, combine_bits=bits).automatic(light).exposure
        for bits in (0, 20)
    )
    assert together == apart and apart.ratios[-1] < 0.1


def test_the_last_exposure_is_a_share_that_the_sensor_has(make_light):
    level = np.full((31, 8, 8), 1e-9)
    level[:, 4, 4] = 1e6
    camera = sensor("staggered", exposure_each=True, exposure_rule="histogram")
    chosen = camera.automatic(make_light(level, pitch_um=3.75)).exposure
    assert chosen.ratios[-1] == 1e-7
    assert camera.at_exposure(chosen).exposure_ratios == chosen.ratios


def test_a_shot_takes_no_longer_than_stated(make_light):
    """In even light, all exposures are nearly as long as the first."""
    level = np.full((31, 8, 8), 1e-5)
    level[:, 4, 4] = 1.1e-5
    size_m = 8 * 3.75e-6, 8 * 3.75e-6
    camera = sensor("staggered", exposure_each=True, exposure_rule="histogram")
    chosen = camera.automatic(make_light(level, pitch_um=3.75)).exposure
    tight = sensor(
        "staggered",
        exposure_each=True,
        exposure_rule="histogram",
        exposure_max_s=chosen.exposure_s,
    )
    settled = camera.at_exposure(chosen)
    assert settled.shot_time_s(*size_m) > 2.5 * chosen.exposure_s
    assert settled.shot_time_s(*size_m) <= tight.shot_time_s(*size_m)


def test_dim_light_keeps_the_bracket_as_it_is(make_light):
    camera = sensor("staggered", exposure_each=True, exposure_max_s=1e-3, noise=False)
    shot = camera(make_light(np.full((31, 8, 8), 1e-9), pitch_um=3.75), hdr.generator(1))
    np.testing.assert_allclose(
        np.asarray(shot["exposure_s"].values, float),
        1e-3 * np.array(camera.exposure_ratios),
        rtol=1e-9,
    )

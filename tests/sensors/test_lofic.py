"""The LOFIC sensor conserves charge, reads it twice, spills with the right noise, and is linear
below its knee.
"""

import numpy as np
import pytest
from isethdr_sensors.charge import soft_knee_shot
from isethdr_sensors.lofic import LoficSensor
from isethdr_sensors.readout.shot import readings as linear_readings

from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector import charge_dynamics as cd
from isethdr_core.physics.detector.charge_dynamics_noise import EMPTY, flow_moments
from isethdr_core.plugins.registry import build
from isethdr_core.seeds import generator
from isethdr_core.testing import check

SIZE = (150, 200)
CLEAN = {
    "prnu": 0.0,
    "dark_spread": 0.0,
    "dark_e_per_s": 0.0,
    "bits": 0,
    "read_noise_e": (0.0, 0.0),
    "column_e": (0.0, 0.0),
    "swing_v": (1e9, 1e9),
}


def electrons(sensor, mean_e, collects=(True, False), **kw):
    """Return the electrons (capture, y, x) that a light of `mean_e` mean photoelectrons gives, and
    the mask of saturated pixels.
    """
    light = np.broadcast_to(np.asarray(mean_e, float), SIZE)
    return soft_knee_shot.readings(
        soft_knee_shot.SoftKneePixel(sensor.model(), sensor.well(), collects),
        light,
        generator(3),
        **kw,
    )


@pytest.mark.slow
def test_keeps_the_promises_of_a_sensor():  # default fields: tests/core/test_conformance.py
    check("sensor", "lofic", bits=0)


def test_below_the_knee_it_is_a_linear_sensor_bit_for_bit():
    sensor = LoficSensor()
    # 1800 e at most: from 2200 e on, 1e-6 e or more spill
    light = np.linspace(0.0, 1800.0, SIZE[0] * SIZE[1]).reshape(SIZE)
    raw, saturated = electrons(sensor, light)
    want, want_saturated = linear_readings(sensor.model(), [light], generator(3))
    np.testing.assert_array_equal(raw, want)
    np.testing.assert_array_equal(saturated, want_saturated)


def test_low_gain_counts_every_electron_on_both_sides_of_the_knee():
    sensor = LoficSensor(**CLEAN)
    for mean in (100.0, 7000.0, 9000.0, 60000.0):
        (total, charge), _ = electrons(sensor, mean)
        n = total.size
        # raw is float32, which holds 60 000 e to 0.004 e
        assert np.array_equal(total, np.round(total)) and np.all(total - charge >= -1e-3)
        # 5 standard errors: charge plus spill is Poisson
        assert total.mean() == pytest.approx(mean, abs=5 * np.sqrt(mean / n))
        assert total.var() == pytest.approx(mean, rel=5 * np.sqrt(2 / n))


@pytest.mark.parametrize("mean", [6500.0, 9000.0, 50000.0])
def test_the_photodiode_has_the_noise_of_its_dynamics(mean):
    sensor = LoficSensor(**CLEAN)
    (total, charge), _ = electrons(sensor, mean)
    want = flow_moments(EMPTY, mean / sensor.exposure_s, sensor.exposure_s, sensor.well())
    charge = charge.astype(float)
    total = total.astype(float)
    n = charge.size
    # 5 standard errors, and 3 e in the mean: the moments neglect the curvature of the knee over the
    # range of the shot noise
    assert charge.mean() == pytest.approx(
        float(want.charge_e), abs=5 * np.sqrt(charge.var() / n) + 3.0
    )
    assert charge.var() == pytest.approx(float(want.charge_var_e2), rel=5 * np.sqrt(2 / n) + 0.05)
    if mean > 8000:
        assert charge.var() < 0.1 * mean
        assert (total - charge).mean() == pytest.approx(float(want.spilled_e), rel=2e-3)


def test_the_high_gain_says_where_it_stops_being_linear():
    sensor = LoficSensor(swing_v=(1.0, 3.0), bits=14)  # a high gain that reaches past the knee
    light = np.linspace(0.0, 15000.0, SIZE[0] * SIZE[1]).reshape(SIZE)
    model = sensor.model()
    top = soft_knee_shot.tops(soft_knee_shot.SoftKneePixel(model, sensor.well(), (True, False)))
    _, high = model.readings
    limit = (top[1] - high.black_dn) / high.gain_dn_per_e
    assert top[0] == 2**14 - 1 and top[1] < 2**14 - 1
    assert (
        cd.flow(0.0, limit / 0.016, 0.016, sensor.well())[1]
        <= soft_knee_shot.LINEAR_WITHIN * sensor.knee_e
    )
    _, saturated = electrons(sensor, light)
    # 600 e: 6 standard deviations of the shot noise
    assert not saturated[1][light < limit - 600].any() and saturated[1][light > limit + 600].all()
    assert not saturated[0].any()
    # with the default fields, the converter ends before the knee
    model = LoficSensor().model()
    assert (
        soft_knee_shot.tops(
            soft_knee_shot.SoftKneePixel(model, LoficSensor().well(), (True, False))
        )[1]
        == 4095.0
    )


def test_the_capacitor_ends_at_the_full_well():
    (total, _), saturated = electrons(LoficSensor(**CLEAN), 1e12)
    assert np.all(total == 100000.0) and saturated.all()


def test_blocks_do_not_matter_and_noise_off_gives_means():
    sensor = LoficSensor()
    light = np.linspace(0.0, 90000.0, SIZE[0] * SIZE[1]).reshape(SIZE)
    for a, b in zip(electrons(sensor, light), electrons(sensor, light, block_rows=7)):
        np.testing.assert_array_equal(a, b)
    quiet = LoficSensor(**{**CLEAN, "noise": False})
    (total, charge), _ = electrons(quiet, light)
    want, _ = cd.flow(0.0, light / 0.016, 0.016, quiet.well())
    np.testing.assert_allclose(charge, want, rtol=1e-6, atol=1e-5)  # float32 raw
    np.testing.assert_allclose(total, light, rtol=1e-6)


def test_warm_pixels_have_a_softer_knee():
    assert LoficSensor(temperature_c=60.0).well().thermal_e == 240.0
    assert LoficSensor(temperature_c=0.0).well().thermal_e == pytest.approx(240.0 * 273.15 / 333.15)


def test_the_merge_joins_both_readings_without_bias(make_light):
    """Merged readings are proportional to the light, at levels on both sides of the high gain's end
    and of the knee.
    """
    sensor = build("sensor", "lofic", cfa="RGGB", prnu=0.0, dark_spread=0.0, column_e=(0.0, 0.0))
    light = make_light(np.ones((31, 48, 48)), 5.6)
    unit = float(sensor.expected(light).max())
    found = []
    levels = np.array([500.0, 4000.0, 6000.0, 8000.0, 40000.0])
    for level_e in levels:
        shot = sensor(light.copy(data=light.values * np.float32(level_e / unit)), generator(2))
        picture = build("isp", "merge", balance="daylight")(shot)
        assert bool(picture.valid.values[4:-4, 4:-4].all())
        found.append(float(picture.xyz.values[4:-4, 4:-4, 1].mean()) / level_e)
    # 5 standard errors over 1600 pixels: shot noise of each level and of the last one, to which all
    # are compared
    assert np.all(
        np.abs(np.array(found) / found[-1] - 1)
        <= 5 * np.sqrt((1 / levels + 1 / levels[-1]) / 1600) + 5e-4
    )


def test_the_preset_has_the_published_figures_and_closed_forms_for_the_rest():
    from omegaconf import OmegaConf
    from scipy.constants import Boltzmann, elementary_charge

    from isethdr_core.config.composition import compose

    fields = OmegaConf.to_container(compose(["sensor=lofic_miyauchi2019"]).sensor, resolve=True)
    sensor = build("sensor", fields.pop("name"), **fields)
    assert (sensor.pitch_um, sensor.full_well_e, sensor.conversion_gain_uv_per_e[1]) == (
        2.8,
        120000.0,
        160.0,
    )
    low, high = sensor.model().readings
    assert low.swing_e == pytest.approx(120000.0, rel=1e-6) and high.swing_e == pytest.approx(
        1 / 160e-6
    )
    thermal_v = Boltzmann * 333.15 / elementary_charge
    # sqrt(k T C) / e of the capacitor C = 120 000 e / 1 V
    assert sensor.read_noise_e[0] == pytest.approx(np.sqrt(thermal_v * 120000.0), rel=2e-3)
    assert sensor.thermal_e == pytest.approx(1.2 * thermal_v / (1.0 / 8750.0), rel=2e-3)
    # the high gain ends before the photodiode bends, so both gains read the same electrons
    assert (
        soft_knee_shot.tops(
            soft_knee_shot.SoftKneePixel(sensor.model(), sensor.well(), (True, False))
        )[1]
        == 4095.0
    )


@pytest.mark.parametrize(
    "field, value",
    [
        ("knee_e", 0.0),
        ("thermal_e", -1.0),
        ("knee_e_per_s", float("nan")),
        ("blooming_percent", 3.0),
    ],
)
def test_bad_fields_are_refused_by_name(field, value):
    with pytest.raises(ConfigError, match=field):
        LoficSensor(**{field: value})


def test_exposures_are_metered_up_to_the_charge_that_spills(make_light):
    sensor = LoficSensor(knee_e=3000.0)
    shot = sensor(make_light(np.full((31, 4, 4), 1e-5), pitch_um=5.6), generator(3))
    linear = (shot.top_dn - shot.black_dn) / shot.gain_dn_per_e
    assert linear.values[1] < 1000.0
    np.testing.assert_allclose(sensor.full_scale_e(), linear.values)

"""Limits of the exposure: that of motion by projecting a moving point, that of flicker by lamps at
several phases.
"""

import numpy as np
import pytest

import isethdr_core as hdr
from isethdr_core.data.temporal_modulation import stacked
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.temporal_modulation import Modulation

SPEED = 50 / 3.6  # 50 km/h


def camera(**fields):
    return hdr.build("sensor", "bayer", **{"exposure_rule": "percentile", **fields})


def exposure_of(sensor, light):
    return float(sensor(light, hdr.generator()).exposure_s[0])


def test_the_object_beside_the_lane_moves_by_two_pixels(make_light):
    """`make_light` states a focal length of 4 mm. In darkness the exposure is as long as the limits
    allow.
    """
    dark = make_light(np.zeros((31, 8, 8)), pitch_um=3.75)
    t = exposure_of(camera(exposure_speed_m_s=SPEED), dark)
    before, after = (4e-3 * 5.0 / distance for distance in (20.0, 20.0 - SPEED * t))
    assert (after - before) / 3.75e-6 == pytest.approx(2.0, rel=1e-9)
    assert exposure_of(camera(exposure_speed_m_s=0.0), dark) == 0.033


def test_bright_light_needs_no_limit(make_light):
    bright = make_light(np.full((31, 8, 8), 1e-3), pitch_um=3.75)
    limited, free = (exposure_of(camera(exposure_speed_m_s=v), bright) for v in (SPEED, 0.0))
    assert limited == free < 0.01


@pytest.mark.parametrize("level", [1e-5, 2e-4])
def test_no_phase_and_no_row_shows_where_exposures_are_whole_periods(level, make_light):
    """A lamp that flashes at 90 Hz gives its mean in every row, up to the rounding of its phase. An
    exposure longer by half a line time would fail.
    """
    scene = make_light(np.full((31, 40, 8), level), pitch_um=3.75)
    lamp = make_light(np.full((31, 40, 8), 0.3 * level), pitch_um=3.75)
    steady = camera(exposure_flicker_hz=90.0, line_time_s=1e-3).expected(scene + lamp).values
    exposures = set()
    for phase in (0.0, 0.21, 0.74):
        light = stacked(
            ["constant", "lamp"],
            [Modulation(), Modulation(90.0, duty=0.1, phase=phase)],
            [scene, lamp],
        )
        shot = camera(exposure_flicker_hz=90.0, line_time_s=1e-3, noise=False)
        found = shot(light, None)
        exposures.add(float(found.exposure_s[0]))
        fixed = hdr.build(
            "sensor", "bayer", exposure_s=float(found.exposure_s[0]), line_time_s=1e-3
        )
        want = steady * float(found.exposure_s[0]) / 0.016
        np.testing.assert_allclose(fixed.expected(light).values, want, rtol=1e-9)
    [exposure_s] = exposures
    assert (exposure_s * 90) % 1 == pytest.approx(0.0, abs=1e-9)
    assert 1 <= round(exposure_s * 90) <= 2  # 33 ms hold two whole periods


def test_gain_makes_up_for_what_whole_periods_cut_off(make_light):
    light = make_light(np.full((31, 8, 8), 3e-5), pitch_um=3.75)
    free = camera(exposure_max_s=0.5)(light, hdr.generator())
    whole = camera(exposure_max_s=0.5, exposure_flicker_hz=90.0, auto_gain_max=8.0)(
        light, hdr.generator()
    )
    assert whole.attrs["analog_gain_factor"] * float(whole.exposure_s[0]) == pytest.approx(
        float(free.exposure_s[0]), rel=1e-3
    )


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"exposure_speed_m_s": -1.0}, "exposure_speed_m_s is"),
        ({"exposure_flicker_hz": -90.0}, "exposure_flicker_hz is"),
        ({"exposure_flicker_hz": 20.0}, "exposure_flicker_hz = 20 needs .*exposure_max_s"),
        ({"exposure_percentile": 101.0}, "exposure_percentile is"),
        ({"exposure_lamp_ratio": 0.5}, "exposure_lamp_ratio is"),
    ],
)
def test_bad_limits_are_refused_when_the_sensor_is_made(fields, said):
    with pytest.raises(ConfigError, match=said):
        camera(**fields)


def test_motion_and_flicker_that_contradict_are_refused_before_any_work():
    from isethdr_core.pipeline.field_check import check_fields

    scene = hdr.build("scene", "macbeth", width=60, height=40)
    lens = hdr.build("lens", "ideal")
    both = camera(exposure_speed_m_s=40.0, exposure_flicker_hz=90.0)
    with pytest.raises(ConfigError, match="exposure_flicker_hz = 90 .*exposure_speed_m_s = 40"):
        check_fields(scene, lens, [both])
    check_fields(scene, lens, [camera(exposure_speed_m_s=4.0, exposure_flicker_hz=90.0)])

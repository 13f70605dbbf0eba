"""Lamps that flash during an exposure: each row of each capture integrates exactly the light of its
own exposure.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from isethdr_core.conformance.inputs import in_components, pattern
from isethdr_core.data.temporal_modulation import stacked, time_mean
from isethdr_core.physics.detector.temporal_modulation import Modulation, row_starts_s
from isethdr_core.plugins.registry import build
from isethdr_core.seeds import generator

PULSES = Modulation(90.0, duty=0.1, phase=0.3)
KEY = generator(seed=3, device="A", scene="s")
QUIET = {"noise": False, "bits": 0}


def two(make_light, modulation=PULSES, height=24):
    """Return the light of a constant scene and a modulated lamp as components, then the scene alone
    and the lamp alone, on tiles of 3.75 um.
    """
    scene, lamp = (make_light(scale * pattern((5, height, 8)), 3.75) for scale in (1e-5, 1e-4))
    return stacked(["constant", "lamp"], [Modulation(), modulation], [scene, lamp]), scene, lamp


def sampled(modulation, start, duration, samples=40_000):
    """Return the mean of the modulation over the exposure of each row by brute force, and a bound
    on its error.
    """
    t = start + (np.arange(samples) + 0.5) * (duration / samples)
    turns = modulation.frequency_hz * t + modulation.phase
    if modulation.depth:
        return (1 + modulation.depth * np.cos(2 * np.pi * turns)).mean(axis=1, keepdims=True), 1e-8
    # the error is half a sample for each edge of a pulse
    return (turns % 1 < modulation.duty).mean(
        axis=1, keepdims=True
    ) / modulation.duty, 6 / samples / modulation.duty


@pytest.mark.parametrize(
    "modulation",
    [PULSES, Modulation(1000.0, duty=0.5, phase=0.9), Modulation(100.0, depth=0.7, phase=0.1)],
)
@pytest.mark.parametrize("line_time_s", [0.0, 7.3e-4])
def test_every_row_of_every_capture_agrees_with_brute_force(make_light, modulation, line_time_s):
    light, scene, lamp = two(make_light, modulation)
    sensor = build(
        "sensor",
        "staggered",
        exposure_s=0.0137,
        exposure_ratios=[1.0, 0.3, 0.02],
        line_time_s=line_time_s,
    )
    dark = sensor.expected(scene.copy(data=0 * scene.values)).values
    found, of_scene, of_lamp = (sensor.expected(one).values - dark for one in (light, scene, lamp))
    before = 0.0
    for k, share in enumerate((1.0, 0.3, 0.02)):
        want, allowed = sampled(modulation, row_starts_s(24, line_time_s, before), 0.0137 * share)
        np.testing.assert_allclose(
            found[k] - of_scene[k], of_lamp[k] * want, atol=1.01 * allowed * of_lamp[k].max() + 1e-9
        )
        before += 0.0137 * share


def test_rolling_is_global_a_line_time_later_per_row(make_light):
    light, _, _ = two(make_light)
    rolling = build("sensor", "single", exposure_s=2e-3, line_time_s=1e-3).expected(light).values
    for row in (0, 3, 11, 23):
        later = light.assign_coords(
            phase=("component", [0.0, PULSES.phase + PULSES.frequency_hz * 1e-3 * row])
        )
        shot = build("sensor", "single", exposure_s=2e-3, line_time_s=0.0).expected(later).values
        # rounding of the phase by 1e-15 periods, for pulses of 0.1 periods in an exposure of 0.18
        np.testing.assert_allclose(rolling[:, row], shot[:, row], rtol=1e-12)
    assert np.ptp(rolling[0].sum(axis=1)) > 0.5 * rolling[0].sum(axis=1).max()  # the rows do differ


def test_a_line_time_changes_nothing_in_constant_light(make_light):
    light, scene, _ = two(make_light)
    shots = [build("sensor", "bayer", line_time_s=t)(scene, KEY) for t in (0.0, 1e-3)]
    assert shots[0].identical(shots[1])


@pytest.mark.parametrize(
    "name",
    ["ideal", "bayer", "staggered", "dual_gain", "split_pixel", "lofic", "lin_log", "interleaved"],
)
def test_a_component_that_is_always_on_is_constant_bit_for_bit(make_light, name):
    _, scene, _ = two(make_light)
    sensor = build("sensor", name)
    assert sensor(in_components(scene, frequency_hz=90.0), KEY).identical(sensor(scene, KEY))
    assert sensor.expected(in_components(scene, frequency_hz=90.0)).identical(
        sensor.expected(scene)
    )


@pytest.mark.parametrize("name", ["bayer", "split_pixel", "interleaved"])
def test_whole_periods_see_the_mean_over_time(make_light, name):
    light, _, _ = two(make_light)
    sensor = build("sensor", name, exposure_s=3 / 90)
    if name == "interleaved":
        sensor = replace(sensor, lower_case_percent=100 / 3)  # the shorter exposure is one period
    # 1e-6: `time_mean` adds the components in float32
    np.testing.assert_allclose(
        sensor.expected(light).values, sensor.expected(time_mean(light)).values, rtol=1e-6
    )


def test_the_mean_over_phases_is_the_mean_over_time(make_light):
    light, _, _ = two(make_light)
    sensor = build(
        "sensor", "staggered", exposure_s=0.4 / 90, exposure_ratios=[1.0, 0.5], line_time_s=0.0
    )
    each = [
        sensor.expected(light.assign_coords(phase=("component", [0.0, p]))).values
        for p in (np.arange(20) + 0.5) / 20
    ]
    # the electrons are piecewise linear in the phase between multiples of 0.1 periods, so the
    # midpoint rule is exact; 1e-6: `time_mean` adds the components in float32
    np.testing.assert_allclose(
        np.mean(each, axis=0), sensor.expected(time_mean(light)).values, rtol=1e-6
    )
    assert np.ptp([e.sum() for e in each]) > 0.5 * np.mean([e.sum() for e in each])


def test_both_photodiodes_expose_together_and_staggered_captures_do_not(make_light):
    _, scene, lamp = two(make_light)
    # on for the first millisecond of 20
    flash = in_components(lamp, frequency_hz=50.0, duty=0.05, phase=0.0)
    split = build("sensor", "split_pixel", exposure_s=0.016, line_time_s=0.0).expected(flash).values
    steady = build("sensor", "split_pixel", exposure_s=0.016).expected(lamp).values
    # 1 %: dark charge is less
    np.testing.assert_allclose(split.sum(axis=(1, 2)) / steady.sum(axis=(1, 2)), 20 / 16, rtol=0.01)
    sensor = build(
        "sensor",
        "staggered",
        exposure_s=0.008,
        exposure_ratios=[1.0, 0.25],
        line_time_s=0.0,
        dark_e_per_s=0.0,
    )
    first, second = sensor.expected(flash).values
    # the second exposure starts when the lamp is dark
    assert first.min() > 0 and np.all(second == 0)


def test_an_interleaved_shorter_exposure_ends_with_the_longer_one(make_light):
    _, _, lamp = two(make_light)
    early, late = (
        in_components(lamp, frequency_hz=50.0, duty=0.02, phase=phase)
        for phase in (0.0, 0.02 - 0.8)
    )
    sensor = build(
        "sensor",
        "interleaved",
        exposure_s=0.016,
        lower_case_percent=10.0,
        line_time_s=0.0,
        dark_e_per_s=0.0,
    )
    lower = np.isin(np.arange(24) % 4, (2, 3))  # rows of the pattern in lower case
    assert np.all(sensor.expected(early).values[0][lower] == 0) and np.all(
        sensor.expected(early).values[0][~lower] > 0
    )
    assert np.all(sensor.expected(late).values[0] > 0)
    other = replace(sensor, varies="sensitivity")
    np.testing.assert_allclose(
        10 * other.expected(early).values[0][lower],
        sensor.expected(late).values[0][lower],
        rtol=1e-9,
    )


def test_the_shot_is_that_of_its_means(make_light):
    light, _, _ = two(make_light)
    bright = light.copy(data=light.values * 100)
    sensor = build("sensor", "staggered", exposure_s=5e-3, line_time_s=1e-3, **QUIET)
    shot = sensor(bright, None)
    mean = sensor.expected(bright)
    free = ~shot.saturated.values
    assert 0.2 < free.mean() < 1
    # raw is float32
    np.testing.assert_allclose(shot.raw.values[free], mean.values[free], rtol=1e-6)


def test_automatic_exposure_meters_the_mean_over_time(make_light):
    light, _, _ = two(make_light)
    sensor = build(
        "sensor", "bayer", exposure_rule="centre", exposure_target=0.2, exposure_max_s=1.0
    )
    pulsed, steady = (float(sensor(one, KEY).exposure_s[0]) for one in (light, time_mean(light)))
    assert pulsed == steady and pulsed < 1.0


def test_line_times_that_cannot_be_are_refused():
    from isethdr_core.errors import ConfigError

    for value in (-1e-6, 2.0, float("nan")):
        with pytest.raises(ConfigError, match=r"sensor.line_time_s"):
            build("sensor", "bayer", line_time_s=value)

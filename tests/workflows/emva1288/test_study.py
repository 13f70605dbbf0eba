"""EMVA 1288: the standard's measurement of a simulated camera finds the parameters of the
camera.
"""

import numpy as np
import pytest
from isethdr_sensors.spectral.colour_filter_array import channels
from isethdr_workflows.emva1288 import estimates as find
from isethdr_workflows.emva1288.camera import BORDER, DARK, STACK, Bench, Pair, Stack, stack
from isethdr_workflows.emva1288.dark import SHARE, dark_series, pictures_needed
from isethdr_workflows.emva1288.general import general_figures
from isethdr_workflows.emva1288.study import (
    chosen,
    emva1288,
    linear_captures,
    measurable,
    measurable_sensors,
    nonlinear,
    row,
)

from isethdr_core.errors import ConfigError
from isethdr_core.physics.radiometry import photon_energy_j

FIGURES = {
    "system gain",
    "quantum efficiency",
    "dark noise",
    "full well",
    "saturation exposure",
    "PRNU",
    "linearity error",
}


def agrees(rows, captures, channels):
    """Assert that every figure of every capture and channel was found within its confidence."""
    assert {(r["capture"], r["channel"]) for r in rows} == {
        (a, b) for a in captures for b in channels
    }
    for capture in captures:
        for channel in channels:
            found = {
                r["figure"] for r in rows if (r["capture"], r["channel"]) == (capture, channel)
            }
            assert found >= FIGURES
    # 4 standard errors: one row in 16 000 lies beyond by chance
    assert not [r for r in rows if r["within"] == "NO"]
    # standard errors must not be so wide that anything passes: gain and full scale are known well
    assert all(r["standard_error"] < 0.01 * r["true"] for r in rows if r["figure"] == "system gain")
    assert all(
        r["standard_error"] < 0.001 * r["true"]
        for r in rows
        if r["figure"] == "saturation exposure"
    )


@pytest.mark.parametrize(
    ("asked", "match"),
    [
        ({"pictures": 1}, "pictures is 1; expected at least"),
        ({"size": 4}, "size is 4"),
        ({"sensor": "ideal"}, "'ideal' has no noise to measure"),
    ],
)
def test_what_cannot_be_measured_is_refused(asked, match):
    with pytest.raises(ConfigError, match=match):
        emva1288(**asked)


@pytest.mark.slow
def test_a_monochrome_camera_of_10_bits_is_found_again():
    rows = emva1288("single_mt9v024", size=128, pictures=16)
    agrees(rows, ["single"], ["W"])
    # 9.1 e are 0.36 DN: rounding hides them, and the standard gives a limit
    assert [r["within"] for r in rows if r["figure"] == "dark noise"] == ["limit"]


@pytest.mark.slow
def test_a_bayer_camera_is_found_again():
    rows = emva1288("bayer", size=96, pictures=16)
    agrees(rows, ["single"], ["R", "G", "B"])
    assert {r["figure"] for r in rows} == FIGURES | {"DSNU"}
    assert dsnu_is_known(rows) == 3


def dsnu_is_known(rows) -> int:
    """Return how many captures and channels have a DSNU. Assert that each one is known: two
    standard errors are less than the value.
    """
    known = [r for r in rows if r["figure"] == "DSNU" and r["true"] > 0]
    # the number of dark pictures is planned for a standard error of 1 / 6 of the value, which is
    # `SHARE` of its square; the error scatters, because it is computed at the value found
    assert all(2 * r["standard_error"] < r["true"] for r in known), [
        (r["capture"], r["channel"], r["standard_error"]) for r in known
    ]
    return len(known)


def test_the_dark_series_is_made_of_the_bench_s_own_pictures():
    """The fast way to many dark pictures contains every term of the sensor: fixed pattern, row
    noise, hot pixels, interleaved rows.
    """
    for name in ("split_pixel", "interleaved", "lofic"):
        sensor = chosen(name)
        bench = Bench(sensor, len(sensor.model().readings) - 1, 1, 540.0, 32, 7)
        ours = dark_series(bench, 3).stack(bench.capture, bench.channel)
        theirs = stack(bench, DARK, 3)
        np.testing.assert_allclose(ours.mean_dn, theirs.mean_dn, rtol=1e-12)
        assert ours.left_dn2 == pytest.approx(theirs.left_dn2, rel=1e-9) and (
            ours.pixels,
            ours.pictures,
        ) == (theirs.pixels, theirs.pictures)
        assert (
            not np.array_equal(bench.shot(DARK, STACK)[0], bench.shot(DARK, STACK + 1)[0])
            and ours.pixels < (32 - 2 * BORDER) ** 2
        )


def test_dark_pictures_asked_for_are_enough():
    """With normally distributed patterns, the variance found scatters over 400 series by the share
    asked for.
    """
    rng = np.random.default_rng(2)
    pixels = 900
    noise = 25.0
    pattern = 1.0
    count = pictures_needed(noise, pattern, pixels)
    found = []
    for _ in range(400):
        mean = rng.normal(0, np.sqrt(pattern), pixels) + rng.normal(
            0, np.sqrt(noise / count), pixels
        )
        found.append(find.spatial(Stack(mean, noise / count, pixels, count)).value)
    # the random pattern itself adds sqrt(2 / 900)
    expected = np.hypot(SHARE, np.sqrt(2 / pixels)) * pattern
    # 12 %: 400 values give a standard deviation to 3.5 %. Pattern and noise are not quite separate:
    # their cross term is 2 x 1 x noise / count
    cross = 2 * np.sqrt(pattern * noise / count / pixels)
    assert (
        np.std(found) == pytest.approx(np.hypot(expected, cross), rel=0.12)
        and pictures_needed(noise, 0.0, pixels) == 0
    )


@pytest.mark.slow
def test_a_wrong_camera_is_told_apart(monkeypatch):
    """A true gain that is 5 % off, a dark noise 20 % off and a PRNU 30 % off are not within the
    confidence, so the comparison can fail.
    """
    from isethdr_workflows.emva1288 import study as study

    true_figures = study.true_figures
    monkeypatch.setattr(
        study,
        "true_figures",
        lambda *a: (
            lambda t: {
                **t,
                "gain": 1.05 * t["gain"],
                "dark_noise_e": 1.2 * t["dark_noise_e"],
                "prnu_percent": 1.3 * t["prnu_percent"],
            }
        )(true_figures(*a)),
    )
    rows = {r["figure"]: r["within"] for r in study.measure(chosen("single"), 96, 8, 1)}
    assert [rows[name] for name in ("system gain", "dark noise", "PRNU")] == ["NO"] * 3
    assert rows["quantum efficiency"] == rows["linearity error"] == "yes"


@pytest.mark.slow
def test_a_bent_converter_is_found():
    from dataclasses import replace

    from isethdr_workflows.emva1288 import study as study

    rows = {r["figure"]: r for r in study.measure(replace(chosen("single"), inl_dn=40.0), 96, 8, 1)}
    # 40 DN of 4031 is 1 % of the scale
    assert rows["linearity error"]["found"] > 0.5 and rows["linearity error"]["within"] == "NO"


def test_light_carries_the_photons_it_says():
    sensor = chosen("ideal_photon_counter")
    for wavelength in (460.0, 600.0):
        bench = Bench(sensor, 0, 0, wavelength, 16, 1)
        np.testing.assert_allclose(sensor.expected(bench.light(1234.0)), 1234.0, rtol=1e-9)
    # irradiance in W m-2 nm-1 over 10 nm, 16 ms and (3 um)^2
    assert bench.light(1.0).max() * 10 * 0.016 * 9e-12 == pytest.approx(photon_energy_j(600.0))


def test_estimates_on_numbers_of_known_statistics():
    rng = np.random.default_rng(0)
    gain = 0.5
    noise = 6.0
    pairs = [
        Pair(
            e / 0.4,
            gain * e,
            gain**2 * (e + noise**2) * (1 + rng.normal() * np.sqrt(2 / 1e5)) + 1 / 12,
            0.0,
            100_000,
        )
        for e in np.linspace(100, 10000, 20)
    ]
    dark = Pair(0.0, 0.0, gain**2 * noise**2 + 1 / 12, 0.0, 100_000)
    found, responsivity = find.gain_and_responsivity(pairs, dark, True)
    assert abs(found.off(gain)) < 4 and found.error < 0.005 * gain
    assert find.quantum_efficiency(found, responsivity).off(0.4) < 4
    assert abs(find.dark_noise_e(dark, found, True).off(noise)) < 4
    assert find.linearity_error_percent(pairs, dark).value < 1e-9
    pattern = rng.normal(0, 3.0, 40_000) + rng.normal(0, 2.0, 40_000)
    assert abs(find.spatial(Stack(pattern, 4.0, 40_000, 16)).off(9.0)) < 4


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, captures, linear",
    [
        ("split_pixel_imx490", 4, 4),
        ("lofic", 2, 2),
        ("lofic_miyauchi2019", 2, 2),
        ("lin_log", 1, 0),
        ("bayer_all_effects", 1, 0),
    ],
)
def test_the_linear_model_is_used_where_numbers_are_linear(name, captures, linear):
    sensor = chosen(name)
    assert measurable(sensor) and linear_captures(sensor) == list(range(linear))
    assert (
        nonlinear(sensor) == (name != "split_pixel_imx490")
        and len(sensor.model().readings) == captures
    )
    assert not measurable(chosen("ideal"))


@pytest.mark.slow
@pytest.mark.parametrize("name, levels", [("bayer_all_effects", 5), ("lofic", 5), ("lin_log", 9)])
def test_bent_responses_are_found_again_by_the_general_model(name, levels):
    sensor = chosen(name)
    for capture in range(len(sensor.model().readings)):
        rows = [
            row("", "", *figure)
            for figure in general_figures(Bench(sensor, capture, 0, 600.0, 96, 1))
        ]
        assert len(rows) == 3 * levels - 1 and not [r for r in rows if r["within"] == "NO"]
        # noise and SNR are known to 2 %, or to 6 % if read noise has wide tails
        assert all(r["standard_error"] < 0.06 * r["true"] for r in rows)


@pytest.mark.slow
def test_a_bent_response_that_is_not_the_stated_one_is_told_apart(monkeypatch):
    """Noise 10 % off, or a knee 1 % off, is not within the confidence."""
    from dataclasses import replace

    from isethdr_workflows.emva1288 import general as study

    sensor = chosen("lin_log")
    expected = study.expected_dn
    monkeypatch.setattr(study, "SHARES", (0.1,))
    monkeypatch.setattr(study, "BEYOND", (10.0,))
    made = replace(sensor, knee_e=1.01 * sensor.knee_e)
    monkeypatch.setattr(
        study, "expected_dn", lambda bench, light_e: expected(replace(bench, sensor=made), light_e)
    )
    rows = {
        r["figure"]: r["within"]
        for r in (row("", "", *f) for f in general_figures(Bench(sensor, 0, 0, 600.0, 96, 1)))
    }
    assert rows["mean at 10 of full scale"] == "NO" and rows["mean at 0.1 of full scale"] == "yes"
    monkeypatch.setattr(study, "expected_dn", lambda *a: (expected(*a)[0], 1.21 * expected(*a)[1]))
    rows = {
        r["figure"]: r["within"]
        for r in (row("", "", *f) for f in general_figures(Bench(sensor, 0, 0, 600.0, 96, 1)))
    }
    assert (
        rows["temporal noise at 10 of full scale"]
        == rows["temporal noise at 0.1 of full scale"]
        == "NO"
    )


# Presets that differ only in numbers from another preset of the same class.
# docs/measured/emva1288.md has the figures of all presets.
SAME_CLASS = {
    "bayer_imx363",
    "bayer_isethdr",
    "rgbw_isethdr",
    "split_pixel_isethdr",
    "staggered",
    "typical_bayer",
    "typical_rgbw",
    "typical_split_pixel",
}


@pytest.mark.slow
def test_presets_of_every_class_are_found_again():
    off = []
    names = measurable_sensors()
    assert SAME_CLASS < set(names)
    names = [name for name in names if name not in SAME_CLASS]
    assert {
        "bayer",
        "rgbw",
        "split_pixel",
        "split_pixel_imx490",
        "staggered_four",
        "single_mt9v024",
        "interleaved",
        "lin_log",
        "lofic_miyauchi2019",
    } <= set(names)
    for name in names:
        rows = emva1288(name, size=128)
        assert not [r for r in rows if r["within"] == "NO"], name
        dsnu_is_known(rows)
        found = {(r["capture"], r["channel"], r["figure"]) for r in rows}
        shot = chosen(name).model()
        linear = linear_captures(chosen(name))
        assert all(
            (shot.readings[k].capture, c, figure) in found
            for k in linear
            for c in channels(shot.cfa)
            for figure in FIGURES
        )
        off += [
            r["off_in_errors"]
            for r in rows
            if r["figure"] in ("system gain", "PRNU", "saturation exposure")
        ]
    # the stated standard errors are right: 95 % of the deviations lie within 2 of them. Channels of
    # one photodiode share its noise, so fewer rows are independent
    assert len(off) > 150 and 0.85 < np.mean(np.abs(off) < 2) and np.std(off) > 0.7

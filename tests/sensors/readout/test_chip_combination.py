"""Combination on the chip: decoded codes give the light back, with the stated noise."""

import numpy as np
import pytest
from isethdr_isp import MergeIsp
from isethdr_isp.readout.electrons import readouts
from isethdr_sensors.readout import chip_combination, companding, converter

import isethdr_core as hdr
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build_from_config

KNEES = {20: "typical_split_pixel_20bit", 24: "typical_split_pixel_24bit"}
FIELDS = {"exposure_rule": "fixed", "auto_gain_max": 1.0, "cfa": "W"}
CLEAN = {"prnu": [0.0, 0.0], "dark_spread": [0.0, 0.0], "column_e": [0.0, 0.0, 0.0]}


def camera(bits, **fields):
    config = hdr.compose([f"sensor={KNEES[bits]}"]).sensor
    return build_from_config("sensor", {**config, **FIELDS, **CLEAN, **fields})


@pytest.mark.parametrize("bits", [20, 24])
def test_every_code_comes_back_as_itself(bits):
    knees = camera(bits).companding
    top = 2**bits - 1
    codes = np.arange(knees[-1][1] + 1)
    linear = companding.decompand(codes, knees, top)
    np.testing.assert_array_equal(companding.compand(linear, knees, top), codes)


@pytest.mark.parametrize("bits", [20, 24])
def test_every_linear_code_comes_back_within_half_a_step(bits):
    """Test every linear code of 20 bits, and every eleventh of 24 bits. Within a segment the error
    is uniform, so its standard deviation is step / sqrt(12).
    """
    sensor = camera(bits)
    knees = sensor.companding
    top = 2**bits - 1
    [code] = chip_combination.combined_model(sensor.model()).readings
    dn = np.arange(0, top + 1, 1 if bits == 20 else 11, dtype=float)
    apart = companding.decompand(companding.compand(dn, knees, top), knees, top) - dn
    step = converter.code_steps(code, dn)
    # a value near a knee may round into the next segment, where codes are wider
    beyond = converter.code_steps(code, np.minimum(dn + step, top))
    assert np.all(np.abs(apart) <= np.maximum(step, beyond) / 2 * (1 + 1e-9))
    for low, high in zip([0.0, *(k[0] for k in knees)], (k[0] for k in knees), strict=False):
        inside = (dn > low) & (dn < high)
        size = step[inside].max()
        if size > 20:  # finer steps are not sampled evenly by whole DN
            np.testing.assert_allclose(apart[inside].std(), size / np.sqrt(12), rtol=0.01)


@pytest.mark.parametrize("bits", [20, 24])
def test_without_noise_it_is_the_light_to_half_a_code(bits, make_light):
    sensor = camera(bits, noise=False, dark_e_per_s=[0.0, 0.0])
    levels = np.geomspace(1e-7, 3e-2, 64)
    light = make_light(np.broadcast_to(levels, (31, 4, 64)).copy(), pitch_um=3.0)
    shot = sensor(light, None)
    [read] = readouts(shot, np.ones(shot.sizes["wavelength"]))
    want = sensor.expected(light).values[0]
    use = ~read.saturated
    steps = shot["quantisation_e"].values[0] * converter.code_steps(
        chip_combination.combined_model(sensor.model()).readings[0],
        np.interp(want, shot["response_e"].values[0], shot["response_dn"].values[0]),
    )
    adc = [1.0 / r.gain_dn_per_e / s.ratio for r, s in _by_source(sensor)]
    # allowed: half a step of the output, plus half a step of the least sensitive converter that
    # contributes
    part = np.select([want < 4300, want < 17600], [adc[2], adc[1]], adc[0])
    assert np.all(np.abs(read.charge_e - want)[use] <= (0.51 * steps + 0.51 * part)[use])
    assert use[:, :-8].all() and not use[:, -1].any()


def _by_source(sensor):
    model = sensor.model()
    return [(model.readings[s.number], s) for s in chip_combination.sources(model)]


@pytest.mark.slow
@pytest.mark.parametrize("bits", [20, 24])
@pytest.mark.parametrize("mean_e", [1.0, 30.0, 1000.0, 4700.0, 12000.0, 19000.0, 1e5, 6e5])
def test_mean_and_stated_variance(bits, mean_e, flat):
    """In all three readings and in both blending ramps, the mean has no bias beyond that of the
    ramp, and the variance is the one stated for an average pixel, within 5 standard errors.
    """
    sensor = camera(bits)
    one = sensor.expected(flat(1e-6, 4, 4)).values[0].mean()
    dark = sensor.expected(flat(0.0, 4, 4)).values[0].mean()
    light = flat(1e-6 * (mean_e - dark) / (one - dark), 200, 200)
    shot = sensor(light, hdr.generator(seed=3))
    [read] = readouts(shot, np.ones(31))
    values = read.charge_e.ravel()
    n = read.charge_e.size
    assert not read.saturated.any()
    allowed = max(chip_combination.bias_e(s) for s in chip_combination.sources(sensor.model())[1:])
    in_ramp = 4300 < mean_e < 5200 or 17500 < mean_e < 21000
    error = 5 * values.std() / np.sqrt(n)
    assert abs(values.mean() - mean_e) < error + in_ramp * allowed
    stated = float(np.interp(mean_e, shot["response_e"][0], shot["response_variance_e2"][0]))
    # 7 % in the ramps, where the weight changes with the noisy reading; elsewhere 5 standard errors
    # sqrt(2 / n) of a variance
    assert values.var() == pytest.approx(stated, rel=0.07 if in_ramp else 5 * np.sqrt(2 / n))


def test_the_picture_is_that_of_the_captures_apart(make_light):
    """At 12 levels over four decades, the means of the 384 inner pixels of each level agree within
    their noise.
    """
    levels = np.repeat(np.geomspace(1e-6, 1e-2, 12), 8)
    light = make_light(np.broadcast_to(levels, (31, 96, 96)).copy(), pitch_um=3.0)
    apart, together = (
        MergeIsp()(camera(20, combine_bits=b, companding=k)(light, hdr.generator(seed=5)))
        for b, k in ((0, ()), (20, camera(20).companding))
    )
    for k in range(12):
        here = np.s_[:, 8 * k + 2 : 8 * k + 6, 1]
        a = apart["xyz"].values[here]
        b = together["xyz"].values[here]
        error = 5 * np.hypot(a.std(), b.std()) / np.sqrt(a.size)
        assert abs(a.mean() - b.mean()) < error + 6e-4 * a.mean()  # 6e-4: the bias of the ramps
    assert together["valid"].values.all()


def test_what_saturates_everything_is_not_valid(flat):
    sensor = camera(20)
    shot = sensor(flat(1.0, 8, 8), hdr.generator())
    assert shot["saturated"].values.all() and not MergeIsp()(shot)["valid"].values.any()
    assert shot["raw"].values.min() == 4095


def test_automatic_exposure_meters_the_readings(flat):
    light = flat(1e-5, 16, 16)
    auto = {"exposure_rule": "histogram", "auto_gain_max": 4.0}
    apart = camera(20, **auto, combine_bits=0, companding=())(light, hdr.generator())
    together = camera(20, **auto)(light, hdr.generator())
    assert float(together["exposure_s"][0]) == float(apart["exposure_s"][0])
    assert together.attrs["analog_gain_factor"] == apart.attrs["analog_gain_factor"]


@pytest.mark.parametrize(
    ("name", "fields", "said"),
    [
        ("bayer", {"combine_bits": 20}, "takes one capture"),
        ("lofic", {"combine_bits": 20}, "does not include it"),
        ("dual_gain", {"combine_bits": 20, "bits": 0}, "makes no codes"),
        ("dual_gain", {"combine_bits": 18}, "combine_bits is 18"),
        ("staggered", {"combine_bits": 20, "companding": [[1e5, 4095.0]]}, "expected its last"),
        ("staggered", {"combine_bits": 20, "companding": [[1.1e6, 4095.0]]}, "expected its last"),
        (
            "staggered",
            {"combine_bits": 20, "companding": [[4096.0, 2e3], [2e3, 3e3], [1048575.0, 4e3]]},
            "to increase",
        ),
        (
            "staggered",
            {"combine_bits": 20, "companding": [[4096.0, 2000.5], [1048575.0, 4e3]]},
            "whole companded codes",
        ),
    ],
)
def test_bad_combinations_are_refused_when_the_sensor_is_made(name, fields, said):
    with pytest.raises(ConfigError, match=said):
        hdr.build("sensor", name, **fields)


def test_a_black_level_of_0_has_a_table_that_rises():
    model = hdr.build("sensor", "dual_gain", combine_bits=20, black_dn=0.0).model()
    dn, electrons, variance = chip_combination.response(model)
    assert np.all(np.diff(dn) > 0) and np.all(np.diff(electrons) > 0) and np.all(variance >= 0)

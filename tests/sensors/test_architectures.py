"""Architectures of sensors: effects that several charges, gains and exposures share or do not
share; every preset; bad fields.
"""

import dataclasses
from importlib.resources import files

import numpy as np
import pytest
from isethdr_sensors import (
    BayerSensor,
    DualGainSensor,
    IdealSensor,
    InterleavedSensor,
    SingleSensor,
    SplitPixelSensor,
    StaggeredSensor,
)
from isethdr_sensors.imaging_sensor import ImagingSensor
from isethdr_sensors.readout.shot import readings
from numpy.testing import assert_allclose, assert_array_equal
from omegaconf import OmegaConf

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build
from isethdr_core.seeds import generator
from isethdr_core.testing import check

PRESETS = sorted(
    f.name.removesuffix(".yaml")
    for f in files("isethdr_sensors.conf").joinpath("sensor").iterdir()
    if f.name.endswith(".yaml")
)
SIZE = (100, 128)
N = SIZE[0] * SIZE[1]
FIXED = {name: {"exposure_rule": "fixed"} for name in PRESETS if name.startswith("typical_")}
CLEAN = dict(prnu=0.0, dark_spread=0.0, dark_e_per_s=0.0)


def preset(name):
    """Return the sensor that `sensor=name` chooses, read from its file."""
    fields = OmegaConf.to_container(
        OmegaConf.create(files("isethdr_sensors.conf").joinpath(f"sensor/{name}.yaml").read_text())
    )
    (base,) = fields.pop("defaults")
    if base in PRESETS:
        base, below = preset(base)
        return base, {**below, **fields}
    return base, fields


@pytest.mark.parametrize("name", PRESETS)
def test_every_preset_is_a_sensor_of_its_own(name):
    base, fields = preset(name)
    assert build("sensor", base, **fields) != build("sensor", base)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, fields",
    [
        ("single", {}),
        ("dual_gain", {}),
        ("staggered", {}),
        ("interleaved", {}),
        ("interleaved", {"varies": "sensitivity", "cfa": "RG/gb"}),
        ("single", {"cfa": "WGWR/GWRW/WBWG/BWGW"}),
        ("single", {"optical_crosstalk_percent": 5.0, "blooming_percent": 5.0}),
    ],
)
def test_keeps_the_promises_of_a_sensor(name, fields):
    check("sensor", name, **fields)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        n
        for n in PRESETS
        if n not in ("ideal_photon_counter", "split_pixel_isethdr", "bayer_imx363")
    ],
)
def test_presets_keep_the_promises_of_a_sensor(name):
    base, fields = preset(name)
    # the kit compares shots with `expected`, which holds for a linear converter and a fixed
    # exposure
    check("sensor", base, **{**fields, "inl_dn": 0.0, **FIXED.get(name, {})})


# fields after `auto_gain_max` that are no effects of their own: they say how another one behaves,
# divide the read noise, describe hot pixels, or combine captures, of which this sensor has one
NO_EFFECTS = {
    "optical_crosstalk_power",
    "hot_dark_e_per_s",
    "after_gain_noise_uv",
    "defect_e_per_s",
    "combine_bits",
}


def test_the_preset_of_all_effects_sets_every_effect():
    base, given = preset("bayer_all_effects")
    names = [f.name for f in dataclasses.fields(ImagingSensor)]
    effects = set(names[names.index("auto_gain_max") + 1 :]) - NO_EFFECTS
    assert not effects - set(given)
    plain = build("sensor", base)
    every = build("sensor", base, **given)
    assert not [name for name in effects if getattr(every, name) == getattr(plain, name)]


def electrons(sensor, mean_e, key=None):
    model = sensor.model()
    light = [
        np.full(SIZE, mean_e * d.fill_factor * d.exposure_share / model.photodiodes[0].fill_factor)
        for d in model.photodiodes
    ]
    raw, saturated = readings(model, light, key or generator(1))
    gain, black = (
        np.array([getattr(r, name) for r in model.readings])[:, None, None]
        for name in ("gain_dn_per_e", "black_dn")
    )
    return (raw - black) / gain, saturated


def test_two_gains_share_one_charge():
    found, saturated = electrons(DualGainSensor(**CLEAN), 4000.0)
    assert np.corrcoef(found.reshape(2, -1))[0, 1] > 0.998 and not saturated.any()
    found, saturated = electrons(DualGainSensor(**CLEAN), 10000.0)
    assert saturated[1].all() and not saturated[0].any()  # 1.078 V at 200 uV/e: 5390 e


def test_exposures_share_silicon_and_no_shot_noise():
    sensor = StaggeredSensor(**CLEAN, exposure_ratios=(1.0, 0.5, 0.25))
    found, _ = electrons(sensor, 8000.0)
    assert_allclose(found.mean((1, 2)), [8000, 4000, 2000], rtol=5 / np.sqrt(2000 * N))
    correlation = np.corrcoef(found.reshape(3, -1))
    assert np.abs(correlation[np.triu_indices(3, 1)]).max() < 5 / np.sqrt(N)
    # both exposures share the PRNU of their photodiode: 5 % of 4000 e against 63 e of shot noise
    found, _ = electrons(
        StaggeredSensor(**{**CLEAN, "prnu": 0.05}, exposure_ratios=(1.0, 0.5)), 8000.0
    )
    assert np.corrcoef(found.reshape(2, -1))[0, 1] > 0.9


def test_exposures_reach_captures(flat):
    sensor = StaggeredSensor(pitch_um=3.0)
    shot = sensor(flat(1e-3), generator(1))
    assert list(shot.capture.values) == ["T1", "T2", "T3"]
    assert_allclose(shot.exposure_s, [0.016, 0.001, 0.016 / 256])
    assert_allclose(shot.dark_e, 9.1 * shot.exposure_s)
    assert_array_equal(shot.charge, [0, 1, 2])
    expected = sensor.expected(flat(1e-3)) - shot.dark_e
    assert_allclose(expected[1], expected[0] / 16, rtol=1e-12)


def test_four_captures_of_two_photodiodes():
    base, fields = preset("split_pixel_imx490")
    sensor = build(
        "sensor",
        base,
        **{**fields, "prnu": (0.0, 0.0), "dark_spread": (0.0, 0.0), "dark_e_per_s": (0.0, 0.0)},
    )
    found, _ = electrons(sensor, 20000.0)
    assert [r.capture for r in sensor.model().readings] == ["LPLG", "LPHG", "SPLG", "SPHG"]
    # 5 standard errors, and a converter step of 29 e
    assert_allclose(found.mean((1, 2)), [20000, 20000, 20000 / 9, 20000 / 9], rtol=0.002)
    correlation = np.corrcoef(found.reshape(4, -1))
    assert (
        correlation[0, 1] > 0.98
        and correlation[2, 3] > 0.9
        and abs(correlation[0, 2]) < 5 / np.sqrt(N)
    )
    with pytest.raises(ConfigError, match=r"expected 3 each \(LPLG, LPHG, SPLG\) or 4"):
        SplitPixelSensor(read_noise_e=(1.0, 1.0, 1.0, 1.0))


@pytest.mark.parametrize("varies, dark", [("exposure", 0.0625), ("sensitivity", 1.0)])
def test_lower_case_pixels_collect_less(flat, varies, dark):
    fields = dict(
        cfa="RGRG/GBGB/rgrg/gbgb",
        varies=varies,
        dark_e_per_s=1e5,
        dark_spread=0.0,
        prnu=0.0,
        read_noise_e=0.0,
        column_e=0.0,
        pitch_um=3.0,
    )
    sensor = InterleavedSensor(**fields, bits=0)
    light = flat(1e-2, *SIZE)
    shot = sensor(light, generator(1))
    assert list(shot.channel.values) == ["R", "G", "B", "b", "g", "r"]
    qe = shot.quantum_efficiency.values[0]
    assert_allclose(qe[3:], 0.0625 * qe[2::-1], rtol=1e-12)
    mean = sensor.expected(light).values[0] - 1600
    filters = shot["filter"].values
    level = [mean[filters == k].mean() for k in range(6)]
    assert_allclose(level[3:], [0.0625 * v for v in level[2::-1]], rtol=1e-9)
    # all pixels have the same dark level; the dark noise follows the exposure
    night = sensor(flat(0.0, *SIZE), generator(1)).raw.values[0]
    short = filters >= 3
    assert_allclose([night[short].mean(), night[~short].mean()], 1600, atol=5 * 40 / np.sqrt(N / 2))
    assert_allclose(
        [night[short].var(), night[~short].var()], [1600 * dark, 1600], rtol=5 * np.sqrt(4 / N)
    )


def test_interleaved_needs_both_cases():
    with pytest.raises(ConfigError, match="one case only"):
        InterleavedSensor(cfa="RGGB")


@pytest.mark.parametrize(
    "ratios", [(), (0.5, 0.25), (1.0, 1.0), (1.0, 2.0), (1.0, 0.0), (1.0, float("nan"))]
)
def test_bad_exposure_ratios_are_refused(ratios):
    with pytest.raises(ConfigError, match="exposure_ratios"):
        StaggeredSensor(exposure_ratios=ratios)


@pytest.mark.parametrize("exposure_s", [0.0, -1.0, float("inf"), float("nan"), 365.25 * 86400])
def test_exposures_of_nothing_and_of_a_year_are_refused(exposure_s):
    for sensor in (
        SingleSensor,
        DualGainSensor,
        SplitPixelSensor,
        StaggeredSensor,
        InterleavedSensor,
        IdealSensor,
    ):
        with pytest.raises(ConfigError, match="exposure_s is"):
            sensor(exposure_s=exposure_s)


@pytest.mark.parametrize("cfa", ["X", "RGXB", "rgxb", "R1GB"])
def test_letters_without_a_curve_are_refused_at_once(cfa):
    with pytest.raises(ConfigError, match="no spectral curve for filter"):
        BayerSensor(cfa=cfa)


def test_a_curve_must_cover_the_light(tmp_path, flat):
    path = tmp_path / "qe.csv"
    path.write_text("wavelength_nm,W\n400,0.3\n600,0.5\n")
    with pytest.raises(ConfigError, match="still has 0.5 electrons per photon at 600 nm"):
        SingleSensor(qe_csv=str(path), infrared_cut=False, pitch_um=3.0).expected(flat(1e-3))


def test_a_single_pixel_is_a_picture(flat):
    for sensor in (SingleSensor, DualGainSensor, StaggeredSensor, SplitPixelSensor):
        shot = sensor(
            pitch_um=6.0,
            optical_crosstalk_percent=5.0,
            blooming_percent=5.0,
            row_noise_e=1.0,
            hot_percent=1.0,
        )(flat(1e-3, 2, 2), generator(1))
        assert shot.raw.shape[1:] == (1, 1) and np.isfinite(shot.raw.values).all()


@pytest.mark.parametrize(
    "name",
    [
        "single",
        "bayer",
        "rgbw",
        "interleaved",
        "staggered",
        "dual_gain",
        "split_pixel",
        "lofic",
        "lin_log",
    ],
)
@pytest.mark.parametrize("level, saturated", [(0.0, False), (1e12, True)])
def test_all_dark_and_all_saturated(name, level, saturated, flat):
    sensor = build("sensor", name)
    shot = sensor(flat(level, 40, 40, sensor.pitch_um), generator(1))
    assert (shot.saturated.values == saturated).all()
    codes = shot.raw.values.astype(float)
    black, top = (shot[name].values[:, None, None] for name in ("black_dn", "top_dn"))
    # 10 standard deviations of the read noise plus 1 e
    spread = (
        10
        * shot.gain_dn_per_e.values[:, None, None]
        * (shot.read_noise_e.values[:, None, None] + 1)
    )
    # lin_log still responds beyond its knee, where top_dn ends its linear range
    assert np.all(np.abs(codes - (top if saturated else black)) <= spread) or name == "lin_log"


def test_more_charge_than_can_be_counted_is_saturated():
    sensor = SingleSensor(bits=0, swing_v=1e20, full_well_e=np.inf, read_noise_e=0.0)
    for mean, marked in ((1e17, False), (2e18, True), (1e30, True)):
        assert (readings(sensor.model(), [np.full((8, 8), mean)], generator(1))[1] == marked).all()


@pytest.mark.parametrize("base, kind", [(DualGainSensor, "dual"), (StaggeredSensor, "staggered")])
def test_without_effects_they_are_the_ideal_sensor(base, kind, make_light):
    light = make_light(np.random.default_rng(0).lognormal(-7, 3, (31, 20, 20)), 4.0)
    fields = dict(noise=False, bits=0, dark_e_per_s=0.0, full_well_e=np.inf)
    sensor = (
        DualGainSensor(**fields, swing_v=(1e12, 1e12))
        if kind == "dual"
        else StaggeredSensor(**fields, swing_v=1e12)
    )
    ideal = IdealSensor(peak_qe=0.65, pitch_um=sensor.pitch_um, cfa=sensor.cfa)(light)
    assert_array_equal(sensor(light, None).raw.values[0], ideal.raw.values[0])

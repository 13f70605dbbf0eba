"""The stated variance of an unknown device: its temporal noise and its fixed pattern agree with
ensembles of shots and devices.
"""

import numpy as np
import pytest
from isethdr_isp import LinearIsp, MergeIsp
from isethdr_isp.demosaic.interpolation import bilinear, interpolated
from isethdr_isp.merge import charges
from isethdr_isp.readout.fixed_pattern import DeviceSpread, WeightedRead, fixed_pattern
from isethdr_isp.readout.merge_rules import RULES
from isethdr_isp.readout.noise_propagation import NoisePart, SampleNoise
from isethdr_isp.spectra import light

import isethdr_core as hdr
from isethdr_core.errors import UnitError
from isethdr_core.quantities import IRRADIANCE, centres, plane
from isethdr_core.truth import total_variance

BANDS = np.arange(400.0, 701.0, 20.0)
THROUGHPUT_SR = np.pi / 65
INNER = np.s_[4:-4, 4:-4]  # no mirrored sample
# values of the preset lofic_miyauchi2019
MIYAUCHI = {
    "pitch_um": 2.8,
    "full_well_e": 120000.0,
    "conversion_gain_uv_per_e": (8.33333333, 160.0),
    "swing_v": (1.0, 1.0),
    "read_noise_e": (58.7, 2.5),
    "knee_e": 8750.0,
    "knee_e_per_s": 546875.0,
    "thermal_e": 301.0,
}
SENSORS = {
    "split_pixel": ("split_pixel", {}),
    "lofic_miyauchi2019": ("lofic", MIYAUCHI),
    "bayer": ("bayer", {}),
}


def uniform(level_cd_m2, pixels, pitch_um):
    """Return the irradiance of a daylight grey, two pixels wider than the sensor."""
    x = centres(pixels + 2, (pixels + 2) * pitch_um * 1e-6)
    radiance = np.tile(
        level_cd_m2 * THROUGHPUT_SR * light("daylight", BANDS)[:, None, None],
        (1, pixels + 2, pixels + 2),
    )
    width = (pixels + 2) * pitch_um * 1e-6
    return plane(
        radiance,
        BANDS,
        x,
        x,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=THROUGHPUT_SR,
        falloff="none",
        field_width=width,
        field_height=width,
    )


def flat_of(sensor, electrons, pixels):
    """Return uniform light that gives `electrons` in the most sensitive pixels of the most
    sensitive capture.
    """
    one, none = (
        float(sensor.expected(uniform(level, 8, sensor.pitch_um)).max()) for level in (1.0, 1e-12)
    )
    return uniform(electrons / (one - none), pixels, sensor.pitch_um)


def mean_of_device(sensor, flat, shot, generator):
    """Return the captures of one device without temporal noise: mean electrons with the device's
    fixed pattern.
    """
    from isethdr_sensors.readout.shot import device_maps, light_electrons

    model = sensor.model()
    light_e = light_electrons(model, flat)[3]
    prnu, dark_e, offsets_e, _ = device_maps(model, generator, *light_e[0].shape)
    raw = [
        r.black_dn
        + r.gain_dn_per_e
        * (np.minimum(light_e[r.diode] * prnu[r.diode] + dark_e[r.diode], r.swing_e) + offset)
        for r, offset in zip(model.readings, offsets_e)
    ]
    return shot.assign(raw=(shot["raw"].dims, np.stack(raw)))


def ensemble(name, electrons, devices, pixels, **isp):
    """Return three ratios of stated to true variance, each for X, Y and Z.

    - total variance: one shot of each of many devices;
    - temporal variance: many shots of one device;
    - variance of the fixed pattern: the means of many devices.
    """
    kind, fields = SENSORS[name]
    sensor = hdr.build("sensor", kind, **fields)
    process = MergeIsp(**isp)
    flat = flat_of(sensor, electrons, pixels)
    shots = []
    means = []
    again = []
    total = []
    fixed = []
    temporal = []
    for number in range(devices):
        generator = hdr.generator(seed=number, device=f"D{number}")
        shot = sensor(flat, generator)
        picture = process(shot)
        assert picture["valid"].values.all()
        shots.append(picture["xyz"].values[INNER])
        total.append(total_variance(picture).values[INNER])
        fixed.append(picture["fixed_pattern_variance"].values[INNER])
        temporal.append(picture["variance"].values[INNER])
        means.append(process(mean_of_device(sensor, flat, shot, generator))["xyz"].values[INNER])
        again.append(
            process(sensor(flat, hdr.generator(seed=10000 + number, device="D0")))["xyz"].values[
                INNER
            ]
        )
    pairs = ((total, shots), (temporal, again), (fixed, means))
    return [
        np.mean(stated, (0, 1, 2)) / np.var(seen, 0, ddof=1).mean((0, 1)) for stated, seen in pairs
    ]


@pytest.mark.parametrize(
    "name, electrons",
    [
        ("split_pixel", 20000.0),
        pytest.param("lofic_miyauchi2019", 110000.0, marks=pytest.mark.slow),
    ],
)
def test_the_stated_variance_is_that_of_an_unknown_device(name, electrons):
    """The temporal variance alone is 0.67 (split pixel) and 0.27 (LOFIC) of the true variance."""
    found = ensemble(name, electrons, devices=10, pixels=48)
    # 8 %: 3 standard errors. 10 devices have 16 000 pixels; about 5 neighbours share their error,
    # which leaves 3200 independent values: sqrt(2 / 3200) = 2.5 %
    np.testing.assert_allclose(found, 1.0, atol=0.08)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name, levels",
    [
        ("split_pixel", (3, 300, 20000, 110000)),
        ("bayer", (3, 300, 20000)),
        ("lofic_miyauchi2019", (3, 300, 20000, 110000)),
    ],
)
def test_the_stated_variance_is_right_from_3_to_110000_electrons(name, levels):
    for electrons in levels:
        total, temporal, fixed = ensemble(name, electrons, devices=100, pixels=48)
        # 3 %: 4 standard errors of 0.8 %. 100 devices have 1600 pixels each; about 5 neighbours
        # share their error
        np.testing.assert_allclose([total, temporal], 1.0, atol=0.03)
        # In the dark, columns make most of the fixed pattern. 10 %: 3 standard errors of 3.2 %,
        # since 100 devices have 40 columns each, and two neighbours share their error
        np.testing.assert_allclose(fixed, 1.0, atol=0.1 if electrons < 100 else 0.03)


def test_photodiodes_that_share_silicon_add_in_amplitude():
    signal = np.full((4, 5), 1000.0)
    variance = np.full((4, 5), 1000.0)
    share = 0.3
    mean_square = 1000.0**2 - 1000.0  # an unbiased estimate of the square of the mean

    def prnu_part(other_silicon):
        reads = [
            WeightedRead(DeviceSpread(prnu=0.01), share),
            WeightedRead(DeviceSpread(prnu=0.01, silicon=other_silicon), 1 - share),
        ]
        return fixed_pattern(reads, signal, variance).total_e2()

    np.testing.assert_allclose(prnu_part(0), 0.01**2 * mean_square)
    np.testing.assert_allclose(prnu_part(1), 0.01**2 * mean_square * (share**2 + (1 - share) ** 2))


def test_exposures_of_one_photodiode_share_its_silicon_and_the_merge_follows():
    fields = {"prnu": 0.01, "dark_spread": 0.0, "column_e": 0.0}
    shot = hdr.build("sensor", "staggered", **fields)(uniform(3.0, 16, 3.75), hdr.generator())
    assert shot["silicon"].values.tolist() == [0, 0, 0] and shot["charge"].values.tolist() == [
        0,
        1,
        2,
    ]
    split = hdr.build("sensor", "split_pixel")(uniform(3.0, 16, 2.8), hdr.generator())
    assert split["silicon"].values.tolist() == [0, 0, 1]
    for rule in RULES.values():
        merged = rule(*charges(shot, "daylight"))
        # the weights of the three exposures add to 1, so their PRNU adds to that of one photodiode;
        # 1e-9: rounding of float64
        expected = 0.01**2 * (merged.signal_e**2 - merged.variance_e2)
        np.testing.assert_allclose(merged.fixed.total_e2(), expected, rtol=1e-9)


def test_absent_terms_count_as_none_and_bad_ones_are_named(bench):
    shot = bench.make(np.full((12, 16), 500.0))
    picture = LinearIsp()(shot)
    assert not picture["fixed_pattern_variance"].values.any()
    np.testing.assert_array_equal(total_variance(picture), picture["variance"])
    np.testing.assert_array_equal(
        total_variance(picture.drop_vars("fixed_pattern_variance")), picture["variance"]
    )
    spread = LinearIsp()(shot.assign(prnu=("capture", [0.01])))
    assert (spread["fixed_pattern_variance"].values > 0).all()
    np.testing.assert_array_equal(spread["variance"], picture["variance"])
    for bad in (-0.1, np.nan):
        with pytest.raises(UnitError, match="prnu = .*expected a share of the mean, 0 or above"):
            LinearIsp()(shot.assign(prnu=("capture", [bad])))
    with pytest.raises(UnitError, match=r"column_e with dims \(\); expected \('capture',\)"):
        LinearIsp()(shot.assign(column_e=0.1))


def test_in_the_dark_the_sum_stays_above_zero(bench):
    rng = np.random.default_rng(2)
    picture = LinearIsp()(bench.make(np.zeros((60, 60)), rng=rng).assign(prnu=("capture", [0.05])))
    fixed = picture["fixed_pattern_variance"].values
    # the estimate of PRNU^2 x signal^2 has no bias: its mean is 0 within 4 standard errors, and
    # about half of the estimates are negative
    assert abs(fixed.mean()) < 4 * 2 * fixed.std() / 60 and fixed.min() < 0
    assert total_variance(picture).values.min() > 0


def test_columns_deviate_alike_through_the_demosaic():
    """On a Bayer array, red at a blue pixel is the mean of four samples in two columns. It has half
    of the variance of a column, not a quarter.
    """
    filters = np.tile([[0, 1], [1, 2]], (6, 6))
    rule = bilinear(filters, 3)
    column = rule.variance(np.eye(3), SampleNoise((NoisePart(np.full((12, 12), 9.0), rows="any"),)))
    assert column[0, 5, 5] == pytest.approx(4.5) and column[2, 5, 5] == pytest.approx(9.0)
    rng = np.random.default_rng(0)
    matrix = rng.standard_normal((3, 3))
    deviation = rng.uniform(1, 3, (12, 12))
    # Each column deviates by a normal number of its own. The variance is therefore the sum over
    # columns of the squared response to that column.
    responses = [
        np.tensordot(matrix, interpolated(rule, deviation * column), 1) for column in np.eye(12)
    ]
    stated = rule.variance(matrix, SampleNoise((NoisePart(deviation**2, rows="any"),)))
    np.testing.assert_allclose(np.square(responses).sum(0), stated, rtol=1e-12)

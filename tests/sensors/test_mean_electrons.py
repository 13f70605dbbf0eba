"""Mean electrons: closed forms, conservation over area, linearity, geometry."""

import numpy as np
import pytest
from isethdr_sensors import BayerSensor, IdealSensor, RgbwSensor, SplitPixelSensor
from isethdr_sensors.spectral.quantum_efficiency import quantum_efficiency
from numpy.testing import assert_allclose
from scipy.constants import c, h

from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.plugins.registry import build

COUNTER = dict(cfa="W", curves="unit")


def test_28_photons_of_1_cd_m2(make_light):
    # 1 cd/m2 at 555 nm is 1/683 W m-2 sr-1; an f/4 lens turns it into an irradiance pi / (1 + 4 x
    # 16) times that; a pixel of 3 um collects for 16 ms
    irradiance = np.pi / 65 / 683
    light = make_light(
        np.array([0, irradiance / 10, 0])[:, None, None] * np.ones((1, 8, 8)),
        wavelength_nm=[545.0, 555.0, 565.0],
    )
    electrons = IdealSensor(exposure_s=0.016, pitch_um=3.0, **COUNTER).expected(light).values
    # rounding only
    assert_allclose(electrons, irradiance * 555e-9 / (h * c) * 9e-12 * 0.016, rtol=1e-12)
    assert 28 < electrons[0, 0, 0] < 29


def test_all_photons_are_counted_whatever_the_pixel_size(make_light):
    values = np.random.default_rng(0).lognormal(0, 3, (5, 24, 36))
    light = make_light(values, pitch_um=3.0, wavelength_nm=[450, 500, 550, 600, 650])
    total = (
        (values * 50 * (np.array([450, 500, 550, 600, 650]) * 1e-9 / (h * c))[:, None, None]).sum()
        * 9e-12
        * 0.016
    )
    for pitch in (1.0, 1.5, 3.0, 4.5, 12.0):  # each divides the field without rest
        found = IdealSensor(pitch_um=pitch, **COUNTER).expected(light).sum()
        assert_allclose(found, total, rtol=1e-12)  # rounding only


def test_the_photodiode_sees_only_its_own_area(make_light):
    # one bright tile of 1 um in the middle of a 3 um pixel, one at its edge
    values = np.zeros((3, 9, 9))
    values[:, 4, 4] = 1.0
    values[:, 4, 0] = 1.0
    light = make_light(values, pitch_um=1.0, wavelength_nm=[540, 550, 560])
    whole = IdealSensor(pitch_um=3.0, **COUNTER).expected(light).values[0]
    centre = IdealSensor(pitch_um=3.0, fill_factor=1 / 9, **COUNTER).expected(light).values[0]
    assert_allclose(centre[1, 1], whole[1, 1], rtol=1e-9)  # rounding of sqrt(1/9)
    assert whole[1, 0] > 0
    assert_allclose(centre[1, 0] / whole[1, 0], 0, atol=1e-9)


def test_electrons_by_independent_sum(make_light):
    rng = np.random.default_rng(1)
    wavelength = np.arange(400.0, 701, 20)
    light = make_light(rng.random((16, 4, 4)), pitch_um=3.75, wavelength_nm=wavelength)
    sensor = BayerSensor(dark_e_per_s=0.0)
    qe = quantum_efficiency(sensor.model(), wavelength)
    found = sensor.expected(light).values[0]
    for y, x, channel in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2), (3, 2, 1)):
        want = sum(
            light.values[k, y, x] * 20 * wavelength[k] * 1e-9 / (h * c) * qe[channel, k]
            for k in range(16)
        )
        assert_allclose(found[y, x], want * 3.75e-6**2 * 0.016, rtol=1e-12)  # rounding only


@pytest.mark.parametrize("sensor", [IdealSensor(), BayerSensor(), RgbwSensor(), SplitPixelSensor()])
def test_affine_in_the_light(sensor, make_light):
    a, b = (
        make_light(np.random.default_rng(k).random((5, 8, 8)) * 10.0 ** (9 * k), pitch_um=6.0)
        for k in (0, 1)
    )
    dark = sensor.expected(a * 0 + make_light(np.zeros((5, 8, 8)), 6.0)).values
    both = sensor.expected(a.copy(data=a.values + 2 * b.values)).values - dark
    # float64 sums
    assert_allclose(
        both, (sensor.expected(a).values - dark) + 2 * (sensor.expected(b).values - dark), rtol=1e-9
    )


def test_dark_charge_doubles_every_8_kelvin(flat):
    cold, warm = (BayerSensor(temperature_c=t).expected(flat(0)).values for t in (60.0, 68.0))
    assert_allclose(cold, 9.1 * 0.016, rtol=1e-12)
    assert_allclose(warm, 2 * cold, rtol=1e-12)


def test_small_photodiode_collects_its_share(flat):
    large, small = (
        SplitPixelSensor(dark_e_per_s=(0, 0))
        .expected(flat(1e-3))
        .sel(capture=["LPLG", "SPLG"])
        .values
    )
    assert_allclose(small, 0.01 * large, rtol=1e-9)


def test_default_grid_fills_the_nominal_field_and_ignores_the_margin(make_light):
    values = np.ones((3, 40, 60))
    # bright overscan
    values[:, :5] = 1e6
    values[:, :, :5] = 1e6
    light = make_light(values, pitch_um=3.0, field=(50 * 3e-6, 30 * 3e-6))
    electrons = IdealSensor(pitch_um=3.0, **COUNTER).expected(light)
    assert electrons.shape == (1, 30, 50)
    assert_allclose(electrons, electrons.values[0, 0, 0], rtol=1e-9)
    assert_allclose([electrons.x[0], electrons.x[-1]], [-24.5 * 3e-6, 24.5 * 3e-6], rtol=1e-12)


def test_crop_is_the_middle_of_the_whole(make_light):
    light = make_light(np.random.default_rng(0).random((3, 40, 60)))
    whole = IdealSensor(**COUNTER).expected(light)
    crop = IdealSensor(rows=20, columns=30, **COUNTER).expected(light)
    assert_allclose(crop.values[0], whole.values[0, 10:30, 15:45], rtol=1e-9)


def test_sensor_larger_than_the_field_is_refused(flat):
    with pytest.raises(ConfigError, match="type sensor.columns=64"):
        IdealSensor(columns=65).expected(flat(1))
    with pytest.raises(ConfigError, match="larger than the field"):
        IdealSensor(pitch_um=500.0).expected(flat(1))


def test_light_that_does_not_cover_the_field_is_refused(make_light):
    light = make_light(np.ones((3, 10, 10)), field=(33e-6, 30e-6))
    with pytest.raises(UnitError, match="expected tiles over all of field_width"):
        IdealSensor().expected(light)


@pytest.mark.parametrize(
    "damage, message",
    [
        (lambda e: e.assign_attrs(units="W m-2"), "units"),
        (lambda e: e.copy(data=np.where(np.arange(64) == 3, -1.0, e.values)), "negative"),
        (lambda e: e.copy(data=np.where(np.arange(64) == 3, np.nan, e.values)), "NaN"),
        (lambda e: e.isel(x=[0], y=[0]), "expected at least 2 x 2"),
        (lambda e: e.drop_attrs(deep=False).assign_attrs(units=e.attrs["units"]), "f_number"),
    ],
)
@pytest.mark.parametrize("sensor", [IdealSensor(), SplitPixelSensor()])
def test_bad_light_is_refused(sensor, flat, damage, message):
    with pytest.raises(UnitError, match=message):
        sensor.expected(damage(flat(1e-3)))


@pytest.mark.parametrize(
    "field, value",
    [
        ("exposure_s", 0.0),
        ("exposure_s", float("nan")),
        ("pitch_um", -1.0),
        ("fill_factor", 1.5),
        ("rows", -1),
        ("prnu", -0.1),
        ("read_noise_e", float("nan")),
        ("bits", 99),
        ("black_dn", 5000.0),
        ("swing_v", 0.0),
        ("temperature_c", 1e4),
        ("prnu", 5.0),
        ("prnu", 1e30),
        ("dark_spread", 1e30),
        ("inl_dn", -1.0),
    ],
)
def test_impossible_fields_are_refused_with_the_field_and_a_hint(field, value):
    with pytest.raises(ConfigError, match=f"{field} is"):
        BayerSensor(**{field: value})


def test_photodiodes_larger_than_their_pixel_are_refused():
    with pytest.raises(ConfigError, match="together 1.4; expected at most 1.01"):
        SplitPixelSensor(fill_factor=(0.9, 0.5))


@pytest.mark.parametrize("fields", [{"full_well_e": 1.0}, {"swing_v": 1e9}])
def test_a_full_well_of_less_than_one_code_is_refused(fields):
    with pytest.raises(ConfigError, match="expected more than one code below the full well"):
        BayerSensor(**fields)


@pytest.mark.parametrize("name", ["bayer", "lofic"])  # one of each kind of shot
def test_noise_without_a_generator_is_refused(name, flat):
    with pytest.raises(ConfigError, match="no generator; expected hdr.generator"):
        build("sensor", name, pitch_um=3.0)(flat(1e-3), None)

"""Microlenses: no loss where lens and design agree, the table's loss elsewhere, and refusals."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from isethdr_isp.readout.shading import measured_shading
from isethdr_optics import IdealLens, PrescribedLens
from isethdr_sensors import BayerSensor, SingleSensor
from isethdr_sensors.charge import crosstalk
from isethdr_sensors.sampling.microlens import CHIEF_RAYS, CONE_KEY
from isethdr_sensors.spectral import response
from isethdr_sensors.spectral.quantum_efficiency import quantum_efficiency
from scipy.interpolate import PchipInterpolator

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.runs.seeds import Generator
from isethdr_core.uncertainty import ledger

RESPONSE = ((0.0, 1.0), (10.0, 0.95), (20.0, 0.8), (40.0, 0.4))
PITCH_UM = 3.0
COUNT = 33
CORNER_MM = 1e-3 * PITCH_UM * np.hypot(COUNT - 1, COUNT - 1) / 2
CENTRE = COUNT // 2


def straight(corner_deg: float) -> tuple[tuple[float, float], ...]:
    """Return a design angle proportional to the image height, with a last point at the corner."""
    return ((0.0, 0.0), (CORNER_MM, corner_deg))


@pytest.fixture
def through_lens(flat):
    """Return a function that makes uniform light with a chief ray angle proportional to the image
    height.
    """

    def make(corner_deg: float) -> xr.DataArray:
        light = flat(1e-3, COUNT, COUNT, PITCH_UM)
        corner = CORNER_MM / light.attrs["focal_length_mm"]
        table = {"radius_per_focal_length": [0.0, corner], "angle_deg": [0.0, corner_deg]}
        return light.assign_attrs({CHIEF_RAYS: table})

    return make


def sensor(cls=SingleSensor, **fields):
    return cls(**{"pitch_um": PITCH_UM, "exposure_s": 0.01, **fields})


def electrons(light, **fields) -> np.ndarray:
    """Return the mean photoelectrons (y, x), without dark charge."""
    return sensor(dark_e_per_s=0.0, **fields).expected(light).values[0]


@pytest.mark.parametrize(("lens_deg", "design_deg"), [(20.0, 0.0), (0.0, 20.0), (5.0, 25.0)])
def test_the_corner_loses_what_the_table_says_and_the_axis_nothing(
    through_lens, lens_deg, design_deg
):
    light = through_lens(lens_deg)
    tables = {"microlens_cra_deg": straight(design_deg), "microlens_response": RESPONSE}
    share = electrons(light, **tables) / electrons(light)
    assert share[CENTRE, CENTRE] == 1.0
    # in the corner the chief ray is 20 degrees off the design, a point of the table; 1e-12 allows
    # for rounding of the angles
    assert share[[0, 0, -1, -1], [0, -1, 0, -1]] == pytest.approx(0.8, rel=1e-12)
    # half way to the corner the chief ray is 10 degrees off, another point of the table
    assert share[CENTRE // 2, CENTRE // 2] == pytest.approx(0.95, rel=1e-12)
    assert share.max() <= 1.0 and np.all(np.diff(share[CENTRE, CENTRE:]) < 0)


@pytest.mark.parametrize("cls", [SingleSensor, BayerSensor])
def test_a_design_for_this_lens_keeps_every_bit_of_the_captures(through_lens, cls):
    light = through_lens(25.0)
    generator = Generator(seed=3, device="A", scene="s")
    tables = {"microlens_cra_deg": straight(25.0), "microlens_response": RESPONSE}
    xr.testing.assert_identical(
        sensor(cls, **tables)(light, generator), sensor(cls)(light, generator)
    )


def test_light_without_chief_rays_keeps_every_bit_and_the_ledger_says_so(flat):
    light = flat(1e-3, COUNT, COUNT, PITCH_UM)
    generator = Generator(seed=3, device="A", scene="s")
    tables = {"microlens_cra_deg": straight(25.0), "microlens_response": RESPONSE}
    book = ledger.Ledger()
    with ledger.stage(book, "sensor"):
        found = sensor(**tables)(light, generator)
    xr.testing.assert_identical(found, sensor()(light, generator))
    [note] = [note for note in book[0].left_out if note.key == CHIEF_RAYS]
    assert note.bound == pytest.approx(0.6, rel=1e-12)  # the largest loss in the table


def test_photocurrent_loses_as_irradiance_does(through_lens):
    light = through_lens(20.0)
    tables = {"microlens_cra_deg": straight(0.0), "microlens_response": RESPONSE}
    bayer = sensor(BayerSensor, **tables)
    model = bayer.model()
    wave = light.wavelength.values
    qe = quantum_efficiency(model, wave)
    parts = crosstalk.parts(qe, model, wave)
    planes = np.concatenate(response.channel_planes(model, light, qe))
    of_lens = {k: v for k, v in light.attrs.items() if k != "units"}
    names = [str(k) for k in range(len(planes))]
    current = quantities.photocurrent(
        planes, names, light.x, light.y, wave, np.concatenate(parts), **of_lens
    )
    assert current.attrs["units"] == quantities.PHOTOCURRENT
    found, wanted = (bayer.expected(one).values for one in (current, light))
    assert found == pytest.approx(wanted, rel=1e-12)  # rounding only
    assert wanted[0, 0, 0] < 0.9 * wanted[0, CENTRE, CENTRE]


def radiance() -> xr.DataArray:
    """Return a uniform field of 48 x 32 degrees in three bands."""
    tiles = [quantities.centres(n, n * 0.0222) for n in (40, 26)]
    return quantities.plane(
        np.full((3, 26, 40), 0.02), (450.0, 550.0, 650.0), *tiles, quantities.RADIANCE
    )


LENSES = [
    IdealLens(),
    IdealLens(distortion={"model": "brown_conrady", "k1": -0.1}, focal_length_mm=3.0),
    pytest.param(PrescribedLens(wavefront="none", f_number=8.0), marks=pytest.mark.slow),
]


@pytest.mark.parametrize("lens", LENSES, ids=["thin", "distorting", "traced"])
def test_a_design_for_a_lens_takes_all_of_its_light_and_another_does_not(lens):
    light = lens(radiance())
    table = light.attrs[CHIEF_RAYS]
    heights_mm = np.array(table["radius_per_focal_length"]) * lens.focal_length_mm
    design = tuple(zip(heights_mm.tolist(), table["angle_deg"]))
    generator = Generator(seed=3, device="A", scene="s")
    plain = sensor(pitch_um=60.0)
    fitted = sensor(pitch_um=60.0, microlens_cra_deg=design, microlens_response=RESPONSE)
    xr.testing.assert_identical(fitted(light, generator), plain(light, generator))
    centred = tuple((height, 0.0) for height, _ in design)
    other = sensor(pitch_um=60.0, microlens_cra_deg=centred, microlens_response=RESPONSE)
    share = other.expected(light).values / plain.expected(light).values
    assert 0.999 < share.max() <= 1.0 and share[0, 0, 0] < 0.9  # near the axis, and in a corner


def test_through_a_thin_lens_light_comes_from_its_centre():
    lens = IdealLens()
    light = lens(radiance())
    tables = {"microlens_cra_deg": ((0, 0), (9, 0)), "microlens_response": RESPONSE}
    share = electrons(light, pitch_um=60.0, **tables) / electrons(light, pitch_um=60.0)
    shot = sensor(pitch_um=60.0).expected(light)
    radius_mm = 1e3 * np.hypot(shot.x.values[None, :], shot.y.values[:, None])
    angle_deg = np.degrees(np.arctan(radius_mm / lens.focal_length_mm))
    wanted = PchipInterpolator(*zip(*RESPONSE))(angle_deg)
    # 2e-5: the lens states angles to 1e-3 degrees, and the response falls by 0.02 per degree
    assert share == pytest.approx(wanted, abs=2e-5)


def test_a_measured_shading_is_the_loss(through_lens):
    light = through_lens(15.0)
    tables = {"microlens_cra_deg": straight(0.0), "microlens_response": RESPONSE}
    flat_field = sensor(noise=False, bits=0, exposure_s=4e-4, **tables)(light, None)
    radius_mm, relative, _ = measured_shading(flat_field)
    share = electrons(light, **tables) / electrons(light)
    wanted = np.interp(radius_mm, PITCH_UM * 1e-3 * np.sqrt(2) * np.arange(17), np.diag(share)[16:])
    # 2e-3: four even powers of the radius follow the cubic curve to a fraction of a percent
    assert relative == pytest.approx(wanted, abs=2e-3)


def test_the_ledger_states_what_the_cone_of_rays_changes(through_lens):
    light = through_lens(25.0).assign_attrs(f_number=1.4)

    def stated(points) -> float:
        book = ledger.Ledger()
        fields = {"microlens_cra_deg": straight(0.0), "microlens_response": points}
        with ledger.stage(book, "sensor"):
            sensor(noise=False, **fields)(light, None)
        [note] = [note for note in book[0].left_out if note.key == CONE_KEY]
        return note.bound

    assert stated(((0.0, 1.0), (60.0, 1.0))) == 0.0
    # independent computation: random rays, uniform over the cone, instead of rings of rays
    radius, turn = np.random.default_rng(1).random((2, 20_000))
    radius = np.degrees(np.arctan(0.5 / 1.4)) * np.sqrt(radius)
    rays = [radius * f(2 * np.pi * turn) for f in (np.cos, np.sin)]
    chief = np.linspace(0, 25, 33)
    mean = np.array([1 - 0.01 * np.hypot(rays[0] + off, rays[1]).mean() for off in chief])
    wanted = np.abs(mean / mean[0] - (1 - 0.01 * chief)).max()
    # 3e-3: three standard errors of the random rays, 0.05 / sqrt(20 000) each, and the error of the
    # sensor's 8 rings
    assert stated(((0.0, 1.0), (100.0, 0.0))) == pytest.approx(wanted, abs=3e-3)
    assert wanted > 0.08


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"microlens_cra_deg": ((0, 0), (9, 20))}, "sensor.microlens_response is [];"),
        ({"microlens_response": RESPONSE}, "sensor.microlens_cra_deg is [];"),
        (
            {"microlens_cra_deg": ((0, 3), (9, 20)), "microlens_response": RESPONSE},
            "sensor.microlens_cra_deg is [[0, 3], [9, 20]]; expected two or more points that",
        ),
        (
            {"microlens_cra_deg": ((0, 0), (9, 20)), "microlens_response": ((0, 1), (0, 0.5))},
            "that rise from [0, 1]",
        ),
    ],
)
def test_a_wrong_table_is_one_line(fields, message):
    with pytest.raises(ConfigError) as raised:
        SingleSensor(**fields)
    assert message in str(raised.value) and "\n" not in str(raised.value)


def test_tables_that_end_too_early_say_where(through_lens):
    light = through_lens(50.0)
    fields = {"microlens_cra_deg": straight(0.0), "microlens_response": RESPONSE}
    with pytest.raises(ConfigError, match="ends at 40 degrees, and a chief ray is 50 degrees off"):
        sensor(**fields).expected(light)
    short = sensor(microlens_cra_deg=((0, 0), (0.05, 9)), microlens_response=RESPONSE)
    for call in (lambda: short.expected(light), lambda: short.check_field(1e-4, 1e-4)):
        with pytest.raises(
            ConfigError, match=r"microlens_cra_deg ends at 0\.05 mm, and the corner"
        ):
            call()
    light.attrs[CHIEF_RAYS]["radius_per_focal_length"][-1] /= 2
    with pytest.raises(ConfigError, match="the lens states its chief rays up to 0.03394 mm from"):
        sensor(**fields).expected(light)

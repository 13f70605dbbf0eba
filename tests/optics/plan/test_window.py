"""A window of the image plane: light from outside the window is left out where its effect is below
the sensor's noise, and restored by a lamp.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import DiffractionLimitedLens, GhostFlare, WavefrontLens
from isethdr_optics.imaging import wing_truncation
from isethdr_optics.imaging.sensor_plane import without_geometry
from isethdr_optics.plan import window
from isethdr_optics.plan.region import region
from isethdr_optics.psf import kernels
from isethdr_optics.psf.kernels import KernelRequest

from isethdr_core.data import quantities
from isethdr_core.demand import Demand
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.pipeline.imaging_plan import LightBudget
from isethdr_core.plugins.registry import build
from isethdr_core.uncertainty import ledger

BANDS = np.array([460.0, 540.0, 620.0])
SHAPE = (30, 66)
TILE = 0.55 / 66
LENS = DiffractionLimitedLens(focal_length_mm=4.0)
# half of the field's height and width, in pixels
SENSOR = build("sensor", "bayer", pitch_um=3.75, rows=133, columns=293)
ASKED = SENSOR.narrow(Demand()).response
EVERYWHERE = replace(ASKED, window_m=None)
MIDDLE = slice(7, 23), slice(16, 50)  # the tiles (y, x) in the sensor's window


def scene(inside=1e-3, outside=1e-3, lamp=None, shape=SHAPE, bands=BANDS):
    """Return mixed radiance of one level inside the window and one outside, in blocks that are up
    to 30 % darker.

    `lamp` is a tile (y, x) made 1e5 times as bright.
    """
    level = np.full(shape, outside)
    level[MIDDLE] = inside
    level *= (
        np.random.default_rng(1).uniform(0.7, 1, [n // 6 for n in shape]).repeat(6, 0).repeat(6, 1)
    )
    if lamp:
        level[lamp] *= 1e5
    y, x = (quantities.centres(n, n * TILE) for n in shape)
    return quantities.plane(
        (level * (1.3 - bands / 700)[:, None, None]).astype(np.float32),
        bands,
        x,
        y,
        quantities.RADIANCE,
    )


def asked(mixed, response=ASKED, lens=LENS, flares=()):
    """Return the photocurrent of a lens for a response, the ledger's omissions by reason, and the
    sum
    of the errors stated in units of the sensor's noise.
    """
    book = ledger.Ledger()
    with ledger.stage(book, "lens"):
        light = lens.photocurrent(mixed, flares, response)
    return (
        light,
        {o.why: o for o in book[0].left_out},
        sum(e.value for e in book[0].errors if e.unit == wing_truncation.UNIT),
    )


def off(light, exact):
    """Return the largest error of the mean electrons, in standard deviations of the noise."""
    few, every = (SENSOR.expected(one).values for one in (light, exact))
    return float((np.abs(few - every) / np.sqrt(every + max(ASKED.read_noise_e, 1.0) ** 2)).max())


@pytest.mark.slow
def test_even_light_takes_the_reach_of_kernels_that_end_and_loses_nothing_by_it():
    """Leave out the tiles beyond the reach of truncated kernels, which no kernel uses anyway.

    The bound is that of the truncated kernels. The light is the same up to the rounding of
    transforms of another size.
    """
    light, left, error = asked(scene(2e-3, 2e-3))
    every, before, as_much = asked(scene(2e-3, 2e-3), EVERYWHERE)
    row = left[window.WHY]
    assert (
        row.what == "540 of 1980 tiles of the field, beyond the middle 48 x 30"
        and "7 x 7 tiles" in str(left)
    )
    assert row.bound == error == as_much and window.WHY not in before
    assert every.shape[1:] == SHAPE and light.shape[1:] == (16, 34) and light.attrs == every.attrs
    np.testing.assert_array_equal(light.x, every.x[MIDDLE[1]])
    np.testing.assert_allclose(light.values, every.values[:, *MIDDLE], rtol=3e-7)  # float32, twice
    assert 0 < off(light, LENS(scene(2e-3, 2e-3))) <= row.bound


def test_along_an_axis_that_the_sensor_fills_nothing_is_left_out():
    light, left, _ = asked(scene(2e-3, 2e-3), replace(ASKED, window_m=(ASKED.window_m[0], np.inf)))
    every, *_ = asked(scene(2e-3, 2e-3), EVERYWHERE)
    assert left[window.WHY].what.endswith("48 x 30") and light.shape[1:] == (30, 34)
    np.testing.assert_allclose(light.values, every.values[:, :, MIDDLE[1]], rtol=3e-7)


def test_a_lamp_in_the_window_leaves_dim_surroundings_out():
    mixed = scene(1e-4, 1e-4, lamp=(15, 33))
    light, left, error = asked(mixed)
    row = left[window.WHY]
    assert (
        row.what.endswith("42 x 24")
        and row.bound == error <= window.SHARE * ASKED.noise_fraction_allowed
    )
    assert light.shape[1:] == (16, 34) and 0 < off(light, LENS(mixed)) <= row.bound


@pytest.mark.slow
def test_the_bound_is_that_of_the_worst_light_there_is(monkeypatch):
    """Compare the bound with the light missing in a dark window in a uniform field.

    In its corners, three quarters of the light beyond the reach are missing, less the part beyond
    the frame.
    """
    monkeypatch.setattr(wing_truncation, "truncated_kernels", lambda *given: None)
    mixed = scene(1e-4, 1e-4)
    mixed.values[:] = mixed.values.max(axis=(1, 2), keepdims=True)
    mixed.values[:, 11:19, 29:37] = 0.0
    sensor = build("sensor", "bayer", pitch_um=3.75, rows=60, columns=60)
    light, left, error = asked(mixed, sensor.narrow(Demand()).response)
    assert left[window.WHY].what.endswith("18 x 18")
    few, every = (sensor.expected(one).values for one in (light, LENS(mixed)))
    missing = (every - few) / np.sqrt(every + max(ASKED.read_noise_e, 1.0) ** 2)
    assert (
        0.3 * error < missing.min() + missing.max() and 0 <= missing.min() <= missing.max() <= error
    ), "light is only ever missing"


@pytest.mark.slow
@pytest.mark.parametrize("lamp", [(15, 12), (2, 33), (29, 65)])
def test_a_lamp_beside_the_window_brings_all_back(lamp):
    assert window.WHY in asked(scene())[1], "without the lamp, tiles are left out"
    mixed = scene(lamp=lamp)
    light, left, error = asked(mixed)
    assert window.WHY not in left and error == 0
    every = asked(mixed, EVERYWHERE)[0].values
    np.testing.assert_array_equal(light.values, every[:, *MIDDLE])


@pytest.mark.slow
def test_a_lamp_beyond_the_largest_reach_is_found_without_any_kernel(monkeypatch):
    """The light that any stop spreads over this distance is already too much.

    Only lamps that are closer to the window need a kernel.
    """
    mixed = scene(lamp=(29, 65))
    monkeypatch.setattr(window, "_beyond", lambda *kernel: pytest.fail("a kernel was looked at"))
    assert window.WHY not in asked(mixed)[1]


def test_a_bound_that_does_not_hold_for_all_bands_brings_all_back(monkeypatch):
    # make the first estimate, from the kernel of one band, too small
    monkeypatch.setattr(window, "GUESS_FACTOR", 0.1)
    mixed = scene(1e-4, 1e-3, lamp=(15, 33))
    light, left, error = asked(mixed)
    assert window.WHY not in left and error == 0
    np.testing.assert_array_equal(light.values, asked(mixed, EVERYWHERE)[0].values[:, *MIDDLE])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lens", "flares"),
    [
        (replace(LENS, distortion={"model": "brown_conrady", "k1": -0.05}), ()),
        (replace(LENS, lateral_colour_percent={400.0: 0.1, 700.0: 0.0}), ()),
        (WavefrontLens(focal_length_mm=4.0, field_zernike_um={0.0: {}, 30.0: {4: 0.05}}), ()),
        (LENS, (GhostFlare(),)),
    ],
)
def test_where_light_is_moved_all_of_the_field_is_taken_and_the_window_is_handed_on(lens, flares):
    mixed = scene(bands=BANDS[:1] if flares or lens.field_varies else BANDS)
    light, left, _ = asked(mixed, lens=lens, flares=flares)
    every, *_ = asked(mixed, EVERYWHERE, lens, flares)
    assert window.WHY not in left and light.size < every.size
    np.testing.assert_array_equal(light.values, every.sel(x=light.x, y=light.y).values)
    # 1e-12: the rounding of pixel borders within tiles depends on the number of tiles
    np.testing.assert_allclose(SENSOR.expected(light), SENSOR.expected(every), rtol=1e-12)


def test_a_sensor_that_fills_the_field_changes_nothing():
    whole = replace(ASKED, window_m=(SHAPE[1] * TILE * 4e-3, np.inf))
    light, left, _ = asked(scene(), whole)
    every, before, _ = asked(scene(), EVERYWHERE)
    assert left == before
    np.testing.assert_array_equal(light.values, every.values)


def test_errors_of_kernels_are_of_the_tiles_that_light_has_and_hold():
    mixed = scene(1e-4, 1e-4, lamp=(15, 33))
    weights = photons_per_energy(BANDS)[None]
    found = []
    for response in (ASKED, EVERYWHERE):
        light, left, _ = asked(mixed, response)
        deviation, bound, *_ = LENS.light_errors(mixed, (), weights, response)
        assert deviation.shape[1:] == bound.shape[1:] == light.shape[1:]
        inside = (slice(None), *(MIDDLE if response is EVERYWHERE else ()))
        found.append(
            [
                a[inside].astype(float)
                for a in (np.tensordot(weights, light.values, 1), deviation, bound)
            ]
        )
    (few, deviation, bound), (every, *others) = found
    # 5 standard deviations of both errors, plus 1e-2 of the darkest tile for the light left out
    assert (
        np.abs(few - every)
        <= 5 * np.hypot(deviation, others[0]) + bound + others[1] + 1e-2 * every.min()
    ).all()


@pytest.mark.parametrize(
    ("lit", "sensed", "kept"),
    [
        ((1, 1, 0, 0, 0), (1, 1, 1, 1, 1), (1, 1, 1, 0, 0)),  # 410 nm is 25 nm wide up to 450 nm
        ((1, 1, 1, 1, 1), (1, 1, 0, 1, 1), (1, 1, 1, 1, 1)),  # two sensors, with a gap between them
        ((0, 0, 0, 1, 1), (1, 1, 1, 1, 1), (0, 0, 1, 1, 1)),
    ],
)
def test_bands_that_stay_have_the_widths_of_the_whole_field(lit, sensed, kept):
    bands = np.array([400.0, 410.0, 450.0, 460.0, 500.0])
    centres = quantities.centres(4, 4e-3)
    light = np.ones((5, 4, 4)) * np.array(lit)[:, None, None]
    mixed = quantities.plane(light, bands, centres, centres, quantities.RADIANCE)
    budget = LightBudget(sensed_nm=tuple(bands[np.array(sensed, bool)]))
    assert tuple(region(LENS, (), mixed, budget).region.kept.astype(int)) == kept


def test_light_from_beyond_the_rendered_field_has_farther_to_go():
    """Compare the bound of the light from beyond the scene with one side of a kernel.

    Such light reaches a window only through the part of a kernel that is farther away than the
    border of the scene, on one of its four sides.
    """
    made = kernels.kernels(
        KernelRequest(
            without_geometry(LENS), (), BANDS, (1e3 * 4 * TILE,) * 2, tuple(n - 1 for n in SHAPE)
        )
    )
    # 7 rows lie above the window, 16 columns to the left of it
    side = max(b[: SHAPE[0] - 1 - 7].sum() for b in made.bands)
    # `spare`: the bound also counts all of the energy beyond the kernels
    for lamp, spare in (
        ((15, 33), 1e-3),
        (None, 2.1e-3),
    ):
        row = asked(scene(1e-4, 1e-4, lamp=lamp))[1]["not in the scene radiance"]
        assert 0.9 * side < row.bound < side + spare

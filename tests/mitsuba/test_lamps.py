"""Lamps: candela, beam pattern, flux, and their exact footprint on the tiles."""

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.lamps.placed_lamps import SPECTRUM_NM, placed_lamps
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import LM_PER_W, luminance, v_lambda
from isethdr_core.uncertainty import ledger

RENDER = {"first_nm": 360.0, "last_nm": 830.0, "margin": 0.0, "samples": 1, "max_depth": 1}


def one_lamp(make, mesh, camera, pose=None, **fields):
    values = {
        "intensity_cd": 800.0,
        "axis": (-1.0, 0, 0),
        "inner_deg": 90.0,
        "outer_deg": 90.0,
        "lambertian_share": 0.0,
        **fields,
    }
    lamp = make.lamp(
        "drl",
        "headlights",
        values["intensity_cd"],
        make.flat(1.0),
        values["axis"],
        values["inner_deg"],
        values["outer_deg"],
        values["lambertian_share"],
    )
    return make.describe(
        [("lamp", "car", (make.part(mesh, "black", lamp),), make.pose() if pose is None else pose)],
        camera=camera,
    )


def facing(make, half_y, half_z, x=0.0):
    """Return a rectangle that faces -x, towards the camera at the origin."""
    v, f = make.quad(half_y, half_z, x)
    return v, f[:, ::-1]


def flux(ds):
    """Return the sum of luminance x tile area in tangents, cd/m2."""
    return (
        luminance(ds.radiance.values[0], ds.wavelength.values).sum()
        * ds.attrs["pitch_x"]
        * ds.attrs["pitch_y"]
    )


@pytest.mark.slow
@pytest.mark.parametrize("half_m", [1e-4, 0.01, 0.1, 0.7])
def test_a_lamp_of_any_size_keeps_its_flux(make, half_m):
    """Compare with the closed form: a facing square at depth d covers (2 h / d)^2 in tangents.

    Its size is between a millionth of a tile and many tiles.
    """
    scene = one_lamp(
        make,
        facing(make, half_m, half_m, 20.0),
        make.camera((0, 0, 0), (1, 0.013, -0.007), 20.0, 1.0),
    )
    ds = MitsubaRenderer(width=32, height=32, **RENDER)(scene)
    # the camera looks 0.8 degrees past the lamp, so the area in tangents is that of the square
    # projected on the tilted plane
    corner = np.array(
        [
            [20.0, y, z]
            for y, z in ((-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m))
        ]
    )
    forward = np.array([1, 0.013, -0.007]) / np.linalg.norm([1, 0.013, -0.007])
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    px = corner @ right / (corner @ forward)
    py = corner @ np.cross(forward, right) / (corner @ forward)
    area = abs(np.dot(px, np.roll(py, 1)) - np.dot(py, np.roll(px, 1))) / 2
    # 3e-4: the cube is stored in float32; V(lambda) has steps of 10 nm in the bands, but 1 nm for
    # the lamp: 1e-4
    assert flux(ds) == pytest.approx(800 / (2 * half_m) ** 2 * area, rel=3e-4)


def test_the_footprint_on_tiles_is_the_polygon_itself(make):
    """The luminance of a tile is that of the lamp times the part of the tile that it covers."""
    scene = one_lamp(
        make, facing(make, 0.3, 0.2, 10.0), make.camera((0, 0, 0), (1, 0, 0), 20.0, 1.0)
    )
    ds = MitsubaRenderer(width=31, height=31, **RENDER)(scene)
    got = (
        luminance(ds.radiance.values[0], ds.wavelength.values)
        / ds.attrs["lamps"][0]["luminance_cd_m2"]
    )
    part = lambda c, pitch, half: np.clip(
        (np.minimum(c + pitch / 2, half) - np.maximum(c - pitch / 2, -half)) / pitch, 0, 1
    )
    truth = np.outer(
        part(ds.y.values, ds.attrs["pitch_y"], 0.02), part(ds.x.values, ds.attrs["pitch_x"], 0.03)
    )
    np.testing.assert_allclose(got, truth, atol=3e-4)


@pytest.mark.slow
def test_a_half_hidden_lamp_sends_half_and_says_how_well_that_is_known(make):
    camera = make.camera((0, 0, 0), (1, 0, 0), 20.0, 1.0)
    whole = one_lamp(make, facing(make, 0.01, 0.01, 20.0), camera)
    # the wall covers y > 0
    wall = make.describe(
        [("wall", "post", (make.part(facing(make, 1.0, 1.0)),), make.pose(10.0, 1.0))]
    )
    from dataclasses import replace

    half = replace(
        whole, models={**whole.models, **wall.models}, objects=whole.objects + wall.objects
    )
    rows = ledger.Ledger()
    with ledger.stage(rows, "renderer") as row:
        ds = MitsubaRenderer(width=9, height=9, **RENDER)(half)
    bound = [e for e in row.errors if e.how == "bound"]
    assert len(bound) == 1 and bound[0].value == pytest.approx(1 / 64)
    assert flux(ds) / flux(MitsubaRenderer(width=9, height=9, **RENDER)(whole)) == pytest.approx(
        0.5, abs=bound[0].value
    )


def test_a_lamp_that_faces_away_or_stands_behind_is_not_seen(make):
    camera = make.camera((0, 0, 0), (1, 0, 0), 60.0, 1.0)
    for scene in (
        one_lamp(make, make.quad(0.3, 0.3, 10.0), camera, axis=(1.0, 0, 0)),
        one_lamp(make, make.quad(0.3, 0.3, -5.0), camera, axis=(1.0, 0, 0)),
    ):
        assert not MitsubaRenderer(width=8, height=8, **RENDER)(scene).radiance.values.any()


@pytest.mark.parametrize("angle_deg", [0.0, 5.0, 12.0, 20.0, 28.0, 31.0, 60.0])
def test_beam_pattern_against_its_formula(make, angle_deg):
    """Compare with the formula: smoothstep of the cosine of the angle from the axis, plus a
    Lambertian floor.
    """
    fields = {"inner_deg": 10.0, "outer_deg": 30.0, "lambertian_share": 0.02}
    scene = one_lamp(
        make,
        facing(make, 0.05, 0.05),
        make.camera((0, 0, 0), (1, 0, 0), 4.0, 1.0),
        make.pose(20.0, turn_deg=angle_deg),
        **fields,
    )
    ds = MitsubaRenderer(width=9, height=9, **RENDER)(scene)
    c, ci, co = np.cos(np.radians([angle_deg, 10.0, 30.0]))
    t = np.clip((c - co) / (ci - co), 0, 1)
    d = ci - co
    floor = 0.02 / 0.98 * 2 * ((1 - ci**2) / 2 + d * (co / 2 + 0.35 * d))
    # candela x foreshortening / d^2
    wanted = 800.0 * c / 20.0**2 * (t * t * (3 - 2 * t) + floor) / (1 + floor)
    # 1e-3 of the value on the axis: a lamp of 10 cm at 20 m spans 0.3 degrees, over which the
    # pattern is curved
    assert flux(ds) == pytest.approx(
        wanted, rel=1e-3, abs=1e-3 * 800 / 20**2 * (28 < angle_deg < 32)
    )


@pytest.mark.parametrize("normalise", ["intensity", "flux"])
def test_flux_against_numerical_integration(make, normalise):
    camera = make.camera((0, 0, 0), (1, 0, 0), 4.0, 1.0)
    (placed,) = placed_lamps(
        one_lamp(
            make,
            facing(make, 0.05, 0.05),
            camera,
            inner_deg=10.0,
            outer_deg=30.0,
            lambertian_share=0.02,
        ),
        normalise,
    )
    c = (np.arange(200_000) + 0.5) / 200_000
    beam = 2 * np.pi * np.mean(placed.pattern(c) * c) * placed.peak_cd_m2 * placed.area_m2
    floor = np.pi * placed.floor / (1 + placed.floor) * placed.peak_cd_m2 * placed.area_m2
    assert floor / beam == pytest.approx(0.02, rel=1e-5)  # the midpoint rule errs by 1e-9
    if normalise == "flux":
        assert beam == pytest.approx(np.pi * 800.0, rel=1e-5)
    else:
        assert placed.peak_cd_m2 * placed.area_m2 == pytest.approx(800.0, rel=1e-12)


def test_flux_of_a_curved_lamp_needs_no_flat_face(make):
    """Compare the flux of two rectangles tilted by +-20 degrees with a dense sum over
    directions."""
    v = np.array(
        [
            [0, 0, 0],
            [0.1 * np.sin(0.35), 0.1 * np.cos(0.35), 0],
            [0.1 * np.sin(0.35), 0.1 * np.cos(0.35), 0.1],
            [0, 0, 0.1],
            [0.1 * np.sin(0.35), -0.1 * np.cos(0.35), 0],
            [0.1 * np.sin(0.35), -0.1 * np.cos(0.35), 0.1],
        ]
    )
    f = np.array([[0, 2, 1], [0, 3, 2], [0, 4, 5], [0, 5, 3]])
    (placed,) = placed_lamps(
        one_lamp(
            make,
            (v, f),
            make.camera((-5, 0, 0), (0, 0, 0)),
            inner_deg=15.0,
            outer_deg=45.0,
            lambertian_share=0.1,
        ),
        "flux",
    )
    k = np.arange(400_000) + 0.5
    # Fibonacci sphere
    z = 1 - 2 * k / len(k)
    phi = k * np.pi * (3 - 5**0.5)
    direction = np.stack([z, np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi)], 1)
    area = (
        np.cross(
            placed.triangles[:, 1] - placed.triangles[:, 0],
            placed.triangles[:, 2] - placed.triangles[:, 0],
        )
        / 2
    )
    seen = np.maximum(direction @ area.T, 0).sum(1)
    total = 4 * np.pi * np.mean(placed.pattern(direction @ placed.axis) * seen) * placed.peak_cd_m2
    projected = np.maximum(area @ placed.axis, 0).sum()
    # the flux is that of a Lambertian lamp of 800 cd; 5e-4: the sum over 400,000 directions errs by
    # 1e-4
    assert total == pytest.approx(np.pi * placed.area_m2 * 800.0 / projected, rel=5e-4)


def test_lamp_spectra_are_scaled_to_candela(make):
    from isethdr_mitsuba.lamps.placed_lamps import emission_table

    rows = emission_table([make.flat(3.0), make.spectrum((580.0, 589.0, 598.0), (0.0, 1.0, 0.0))])
    np.testing.assert_allclose(LM_PER_W * rows @ v_lambda(SPECTRUM_NM), 1, rtol=1e-12)


def test_a_lamp_turned_inside_out_is_refused(make):
    with pytest.raises(ConfigError, match="no face towards its axis"):
        MitsubaRenderer(width=4, height=4)(
            one_lamp(
                make, facing(make, 0.1, 0.1), make.camera((0, 0, 0), (1, 0, 0)), axis=(1.0, 0, 0)
            )
        )


@pytest.mark.parametrize(
    "fields,message",
    [
        ({"axis": (0.0, 0.0, 0.0)}, r"has the axis \(0.0, 0.0, 0.0\); expected a direction"),
        ({"axis": (np.nan, 0.0, 0.0)}, "expected a direction"),
        ({"inner_deg": np.nan}, "expected inner <= outer"),
    ],
)
def test_a_lamp_without_a_direction_or_a_cone_is_refused(make, fields, message):
    """Without an axis or an angle the luminance of a lamp would be NaN."""
    camera = make.camera((0, 0, 0), (1, 0, 0))
    with pytest.raises(ConfigError, match=message):
        placed_lamps(one_lamp(make, facing(make, 0.1, 0.1), camera, **fields))


@pytest.mark.parametrize("count", [1, 2, 7, 1000])
def test_a_triangle_is_drawn_as_often_as_its_chance_says(count):
    """The alias table adds up to the chances of triangles, which span twelve decades."""
    import mitsuba as mi
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("auto"))
    from isethdr_mitsuba.lamps.lamp_tables import alias_table

    chance = 10.0 ** np.random.default_rng(count).uniform(-12, 0, count)
    threshold, other = alias_table(chance)
    assert (threshold >= 0).all() and (threshold <= 1).all()
    drawn = (threshold + np.bincount(other, 1 - threshold, count)) / count
    # 1e-12: sums of up to a thousand float64 numbers of order 1
    np.testing.assert_allclose(drawn, chance / chance.sum(), rtol=1e-12, atol=1e-15)

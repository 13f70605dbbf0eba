"""Ghosts: flux by hand and by an independent Monte Carlo trace, position, colour, omission of faint
pairs, energy of the drawing, bad input.
"""

from dataclasses import replace

import numpy as np
import pytest
from isethdr_optics import GhostFlare, IdealLens
from isethdr_optics.flare.ghosts import ghost_flare as ghosts_module
from isethdr_optics.flare.ghosts.draw import Canvas, Source, points, sources
from isethdr_optics.flare.ghosts.trace import _front_half_mm, beams, boxes, rank, split
from isethdr_optics.prescription.coatings import Powers
from isethdr_optics.prescription.prescription import load, parse

from isethdr_core.data import quantities
from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.ray_trace import collimated, follow, ghost_path
from isethdr_core.uncertainty import ledger

from ...lamp_ghosts import SINGLET, flux, lamp


def monte_carlo(lens, tangent, count, seed=1):
    """Trace single photons, each reflected or refracted at random, until they reach the sensor.

    The trace shares no code with the product: it intersects spheres by their centres and uses
    Fresnel's equations in sines and tangents of angles. Return (x, y) on the sensor, mm, of the
    photons that were reflected exactly twice, and the area from which photons start, mm2.
    """
    rng = np.random.default_rng(seed)
    stop, first, second, sensor = lens.surfaces
    r = stop.semi_diameter_mm
    polar = r * np.sqrt(rng.random(count))
    turn = 2 * np.pi * rng.random(count)
    pos = np.stack([polar * np.cos(turn), polar * np.sin(turn), np.full(count, stop.z_mm)], axis=1)
    way = np.tile(np.array([tangent, 0.0, 1.0]) / np.hypot(1, tangent), (count, 1))
    inside = np.zeros(count, bool)
    bounced = np.zeros(count, int)
    landed = []
    target = np.zeros(count, int)  # the next surface: 0 first, 1 second
    for _ in range(12):
        out = np.full((len(pos), 3), np.nan)
        for number, s in enumerate((first, second)):
            here = target == number
            centre = np.array([0, 0, s.z_mm + 1 / s.curvature_per_mm])
            to = pos[here] - centre
            b = (to * way[here]).sum(1)
            root = np.sqrt(b**2 - (to**2).sum(1) + s.curvature_per_mm**-2)
            both = (
                pos[here][:, None]
                + np.stack([-b - root, -b + root], 1)[..., None] * way[here][:, None]
            )
            out[here] = both[np.arange(here.sum()), np.abs(both[..., 2] - s.z_mm).argmin(1)]
        pos = out
        alive = (
            np.hypot(out[:, 0], out[:, 1])
            < 14.0 * lens.focal_length_mm() / parse(SINGLET).focal_length_mm()
        )
        pos, way, inside, bounced, target = (v[alive] for v in (pos, way, inside, bounced, target))
        centre_z = np.where(
            target == 0,
            first.z_mm + 1 / first.curvature_per_mm,
            second.z_mm + 1 / second.curvature_per_mm,
        )
        normal = pos - np.stack([0 * centre_z, 0 * centre_z, centre_z], 1)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        cosine = (way * normal).sum(1)
        normal = normal * np.sign(cosine)[:, None]
        cosine = np.abs(cosine)
        n1 = np.where(inside, 1.9, 1.0)
        n2 = np.where(inside, 1.0, 1.9)
        a1 = np.arccos(np.minimum(cosine, 1 - 1e-14))
        a2 = np.arcsin(np.minimum(n1 / n2 * np.sin(a1), 1))
        reflectance = (
            np.sin(a1 - a2) ** 2 / np.sin(a1 + a2) ** 2
            + np.tan(a1 - a2) ** 2 / np.tan(a1 + a2) ** 2
        ) / 2
        back = rng.random(len(pos)) < reflectance
        tangential = way - cosine[:, None] * normal
        through = tangential * (n1 / n2)[:, None] + np.cos(a2)[:, None] * normal
        way = np.where(back[:, None], way - 2 * cosine[:, None] * normal, through)
        bounced = bounced + back
        inside = np.where(back, inside, ~inside)
        target = np.where(way[:, 2] > 0, 1, 0)
        free = ~inside
        done = free & (way[:, 2] > 0) & (bounced == 2)
        step = ((sensor.z_mm - pos[:, 2]) / way[:, 2])[done, None]
        landed.append((pos[done] + step * way[done])[:, :2])
        stay = ~free
        if len(landed) == 1:
            stay = stay | (free & (target == 1) & (bounced == 0))
        pos, way, inside, bounced, target = (v[stay] for v in (pos, way, inside, bounced, target))
        if not len(pos):
            break
    return np.concatenate(landed), np.pi * r**2


@pytest.mark.slow
@pytest.mark.parametrize("column", [100, 130])
def test_flux_and_shape_against_an_independent_monte_carlo_trace(bare, column):
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(bare, error_allowed=0.0, sensor_reflectance_percent=0.0)
    scene = lamp(201, 0.008, 100, column)  # wide enough for all of the ghost
    light = flare.irradiance(lens, scene)
    tangent = float(scene.x[column])
    spots, area_mm2 = monte_carlo(flare.of_lens(lens), tangent, 800_000)
    power = 1e3 * 0.008**2 * (1 + tangent**2) ** -2 * area_mm2 * 1e-6
    error = 1 / np.sqrt(len(spots))  # about 1.3 %
    # the 0.004 is for the borders of the pupil grid
    assert flux(light)[0] == pytest.approx(power * len(spots) / 800_000, rel=3 * error + 0.004)
    weight = light.values[0] / light.values[0].sum()
    x_mm = light.x.values * 1e3
    y_mm = light.y.values * 1e3
    mean = weight.sum(0) @ x_mm
    wide = np.sqrt(weight.sum(0) @ (x_mm - mean) ** 2), np.sqrt(weight.sum(1) @ y_mm**2)
    size = spots.std(axis=0)
    assert mean == pytest.approx(spots[:, 0].mean(), abs=4 * size[0] * error + 0.005 * size[0])
    # the tiles of 0.8 mm widen the ghost: source and drawing each add 1/12 of the squared tile
    # width to the variance
    np.testing.assert_allclose(wide, np.hypot(size, 0.8 / np.sqrt(6)), rtol=0.02)


def test_flux_of_a_slow_singlet_by_hand(bare):
    """Compare with a closed form: on the axis of a slow lens the ghost has the flux T1 R2 R1 T2
    of the light through the stop.
    """
    lens = IdealLens(f_number=40.0, focal_length_mm=100.0)
    flare = GhostFlare(bare, error_allowed=0.0, sensor_reflectance_percent=0.0)
    light = flare.irradiance(lens, lamp(31, 0.005, 15, 15))
    r = (0.9 / 2.9) ** 2
    want = 1e3 * 0.005**2 * np.pi * (100 / 80) ** 2 * 1e-6 * r**2 * (1 - r) ** 2
    # 5e-3: the border of the stop on a grid of 48 points
    assert flux(light)[0] / want == pytest.approx(1.0, abs=5e-3)


def test_the_matrices_tell_size_place_and_light(bare):
    real = load(bare).stopped(20.0)
    [pair] = rank(Powers(real, [550.0]), 0.05)
    assert (pair.front, pair.back) == (1, 2)
    assert pair.share == pytest.approx((0.9 / 2.9) ** 4, rel=0.02)  # the stop as an ellipse
    path = ghost_path(4, 2, 1)
    edge = real.surfaces[0].semi_diameter_mm
    rays = follow(
        real.surfaces,
        real.indices(550.0),
        path,
        collimated(np.array([edge, 0.0]), np.zeros(2), 0.0, np.array([0.0, 0.01]), 0.0),
    )
    # 2 %: third-order aberration at f/20
    assert abs(rays.position_mm[0, 0]) == pytest.approx(pair.radius_mm, rel=0.02)
    image = follow(
        real.surfaces,
        real.indices(550.0),
        [(0, False), (1, False), (2, False), (3, False)],
        collimated(np.zeros(1), np.zeros(1), 0.0, 0.01, 0.0),
    ).position_mm[0, 0]
    assert rays.position_mm[0, 1] / image == pytest.approx(pair.magnification, rel=1e-3)


@pytest.mark.slow
def test_ghosts_of_a_night_lamp_lie_where_the_matrices_say_and_have_the_coatings_colour():
    lens = IdealLens(f_number=4.0, focal_length_mm=4.0)
    wave = np.array([430.0, 600.0, 680.0])
    flare = GhostFlare("double_gauss", error_allowed=1e-7, sensor_reflectance_percent=0.0)
    # the lamp is 3.6 degrees to the right; coarse cells divide 96 tiles without remainder
    scene = lamp(96, 0.005, slice(47, 49), 60, wave)
    light = flare.irradiance(lens, scene)
    share = flux(light) / (flux(lens(scene)))
    assert np.all(share < 1e-4 * len(flare.pairs(lens, wave, 0.3)[0])) and np.all(share > 0)
    # the coating reflects least at 600 nm: ghosts are purple
    assert share[1] < 0.5 * share[0] and share[1] < 0.5 * share[2]
    left = light.values[:, :, :48].sum()
    assert left > 0.1 * light.values.sum()
    # the ghosts are symmetric about the horizontal; 1e-5 since beams are stored in float32
    np.testing.assert_allclose(light.values, light.values[:, ::-1], rtol=1e-5)


def test_turning_the_lamp_turns_the_ghosts(bare):
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(bare, error_allowed=0.0)
    right, down = (flare.irradiance(lens, lamp(61, 0.016, *at)) for at in ((30, 45), (45, 30)))
    # the sample points are not the same after a turn by 90 degrees
    np.testing.assert_allclose(flux(right), flux(down), rtol=1e-3)
    where = [
        [
            float((g.values[0].sum(axis=a) @ c.values) / g.values.sum())
            for a, c in ((0, g.x), (1, g.y))
        ]
        for g in (right, down)
    ]
    assert where[0][0] == pytest.approx(where[1][1], rel=1e-2)
    assert abs(where[0][1]) < 0.01 * abs(where[0][0])


def test_light_is_linear_and_zero_stays_zero(bare):
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(bare)
    one = lamp(31, 0.02, 10, 20)
    two = lamp(31, 0.02, 25, 4)
    both = one.copy(data=one.values + two.values)
    np.testing.assert_allclose(
        flare.irradiance(lens, both),
        flare.irradiance(lens, one) + flare.irradiance(lens, two),
        rtol=1e-6,
        atol=1e-20,
    )
    assert float(flare.irradiance(lens, one.copy(data=0 * one.values)).max()) == 0.0


@pytest.mark.slow
def test_what_is_left_out_is_listed_and_within_the_error():
    lens = IdealLens()
    wave = [500.0, 600.0]
    scene = lamp(41, 0.01, 12, 30, wave)
    coarse = GhostFlare("double_gauss", error_allowed=3e-4)
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        light = coarse.irradiance(lens, scene)
    assert rows[0].left_out and 0 < sum(o.bound for o in rows[0].left_out) <= 3e-4
    exact = GhostFlare("double_gauss", error_allowed=0.0).irradiance(lens, scene)
    missing = (flux(exact) - flux(light)) / flux(lens(scene))
    # the stated shares refer to all light that could reach the sensor plane, which is more than the
    # light that falls on the sensor
    assert np.all(missing > -1e-9) and np.all(missing < 3e-4)
    pairs = rank(Powers(load("singlet"), wave, 0.02), 0.1)
    kept, left = split(pairs, 0.0)
    assert kept == pairs and left == []


def test_narrow_ghosts_of_slow_stops_are_found_and_kept_between_field_angles():
    lens = load("double_gauss").stopped(180.0)
    powers = Powers(lens, np.array([550.0]), 0.02)
    pair = next(p for p in rank(powers, 0.3) if (p.front, p.back) == (8, len(lens.surfaces) - 1))
    step = 0.3 / ghosts_module._radial_bins(lens, pair, 550.0, 0.3)
    [box] = boxes(lens, pair, [(0.0, step)], 550.0)
    low, high = beams(lens, powers, pair, [0.0, step], [box, box])

    def through(x):
        source = Source(x, 0.0, 1e-6, 1e-6, np.ones(1))
        return float(points(source, low, high, (0.0, step), box)[2].sum())

    pupil_m2 = np.pi * (1e-3 * 100.0 / 180.0 / 2) ** 2
    assert through(0.0) == pytest.approx(pair.share * pupil_m2, rel=0.05)
    # the share for which the beams of both field angles overlap, and the vignetting between them
    assert through(step / 2) > 0.9 * through(0.0)


def test_rays_reach_the_rim_of_a_strongly_curved_front():
    rows = [
        {"radius_mm": 40.0, "thickness_mm": 12.0, "glass": "1.5", "semi_diameter_mm": 26.0},
        {"radius_mm": -400.0, "thickness_mm": 5.0, "semi_diameter_mm": 26.0},
        {"stop": True, "thickness_mm": 1.0, "semi_diameter_mm": 5.0},
        {"thickness_mm": 1.0, "glass": "1.5"},
        {},
    ]
    lens = parse({"name": "curved", "f_number": 4.0, "surfaces": rows})
    sag_mm = 40 - (40**2 - 26**2) ** 0.5
    # light at 45 degrees that meets the rim crosses the plane of the vertex farther out by the sag
    assert _front_half_mm(lens, lens.indices(550.0), 1.0) == pytest.approx(26 + sag_mm)


def test_rays_between_wavelengths_are_those_of_their_own_wavelength():
    lens = load("double_gauss").stopped(4.0)
    wave = np.linspace(400, 700, 13)
    pair = rank(Powers(lens, wave), 0.2)[0]
    interval = (0.1, 0.11)
    limits = boxes(lens, pair, [interval], 550.0)
    many = beams(lens, Powers(lens, wave), pair, [0.1], limits)[0]
    one = beams(lens, Powers(lens, wave[5:6]), pair, [0.1], limits)[0]
    lit = (one.margin[0] > 0) & (many.margin[5] > 0)
    spread = np.ptp(one.x_mm[0][lit])
    assert np.abs(many.x_mm[5] - one.x_mm[0])[lit].max() < 3e-3 * spread
    # 5 %: the weights use the angles of the nearest traced wavelength
    np.testing.assert_allclose(many.weight[5][lit], one.weight[0][lit], rtol=0.05)


def test_the_canvas_keeps_energy_at_every_level():
    axis = quantities.centres(100, 10.0)
    rng = np.random.default_rng(3)
    for width in (0.05, 1.0, 4.0):
        canvas = Canvas(2, axis, axis, (0.1, 0.1))
        x, y = rng.uniform(-width, width, (2, 2, 4000))
        canvas.draw(x, y, np.full((2, 4000), 1 / 4000))
        light = canvas.irradiance()
        np.testing.assert_allclose(light.sum(axis=(1, 2)) * 0.01 + canvas.outside, 1.0, rtol=1e-6)
        assert light.min() >= 0
        # linear splatting keeps the centroid
        np.testing.assert_allclose(light[0].sum(axis=0) @ axis * 0.01, x[0].mean(), atol=1e-6)


@pytest.mark.parametrize("tiles", [64, 75])
def test_even_light_is_even_up_to_the_border(tiles):
    """Draw a regular grid of points that extends far beyond the sensor: its light is uniform.

    Neither the border of the sensor nor an odd number of tiles may be visible, also on a coarse
    level of the canvas.
    """
    axis = quantities.centres(tiles, tiles * 0.1)
    canvas = Canvas(1, axis, axis, (0.1, 0.1))
    fine = (np.arange(480) + 0.5) / 480 * 24 - 12
    x, y = (v.reshape(1, -1) for v in np.meshgrid(fine, fine))
    canvas.draw(x, y, np.full(x.shape, 0.05**2))
    # each cell holds a whole number of points, so only rounding remains
    np.testing.assert_allclose(canvas.irradiance(), 1.0, rtol=1e-9)


def test_sources_hold_all_light_and_find_lamps():
    axis = quantities.centres(60, 0.6)
    power = np.full((2, 60, 60), 1e-6)
    power[:, 10:12, 50] = 1.0
    found, in_blocks = sources(power, axis, axis, (0.01, 0.01))
    np.testing.assert_allclose(sum(s.power for s in found), power.sum(axis=(1, 2)), rtol=1e-12)
    assert in_blocks < 1e-2
    lamps = [s for s in found if s.power[0] > 0.5]
    assert {round(s.x, 6) for s in lamps} == {round(float(axis[50]), 6)} and len(lamps) <= 2
    assert sources(0 * power, axis, axis, (0.01, 0.01)) == ([], 0.0)


def test_the_smallest_scenes_work(bare):
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(bare)
    for height, width in ((1, 1), (1, 9), (7, 1)):
        x = quantities.centres(width, 0.01 * width)
        y = quantities.centres(height, 0.01 * height)
        scene = quantities.plane(
            np.ones((1, height, width)),
            [550.0],
            x,
            y,
            quantities.RADIANCE,
            pitch_x=0.01,
            pitch_y=0.01,
        )
        light = lens(scene, [flare])
        assert np.isfinite(light.values).all() and float(light.sum()) > float(lens(scene).sum())


def test_bad_input(bare):
    with pytest.raises(ConfigError, match="did you mean 'double_gauss'"):
        GhostFlare("double_gaus").irradiance(IdealLens(), lamp(9, 0.01, 4, 4))
    with pytest.raises(ConfigError, match="opens to f/3"):
        GhostFlare("double_gauss").irradiance(IdealLens(f_number=2.0), lamp(9, 0.01, 4, 4))
    with pytest.raises(ConfigError, match="undefined"):
        GhostFlare("double_gauss").irradiance(IdealLens(), lamp(9, 0.01, 4, 4, [250.0]))
    with pytest.raises(ConfigError, match="coating"):
        GhostFlare(bare, coating="gold").irradiance(IdealLens(f_number=5.0), lamp(9, 0.01, 4, 4))
    with pytest.raises(ConfigError, match="error_allowed"):
        GhostFlare(error_allowed=-1.0)
    with pytest.raises(ConfigError, match="percent"):
        GhostFlare(sensor_reflectance_percent=120.0)


def test_beams_are_kept(bare):
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(bare)
    scene = lamp(31, 0.02, 10, 20)
    first = flare.irradiance(lens, scene)
    known = len(ghosts_module._beams)
    np.testing.assert_array_equal(flare.irradiance(lens, scene), first)
    assert len(ghosts_module._beams) == known


def test_blades_take_their_share_of_the_stop_and_shape_the_ghost(bare):
    """On the axis a ghost is an image of the stop: a polygon with the area of its closed form and
    corners where the blades meet.
    """
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    scene = lamp(121, 0.013, 60, 60)
    flare = GhostFlare(bare, error_allowed=0.0, sensor_reflectance_percent=0.0)
    whole = flare.irradiance(lens, scene)
    for blades in (5, 6):
        cut = replace(flare, blades=blades, rotation_deg=20.0).irradiance(lens, scene)
        # area of the polygon over that of the circle through its corners
        share = blades / (2 * np.pi) * np.sin(2 * np.pi / blades)
        # 1.5 %: 48 points across the stop, each either inside or outside of the polygon
        assert flux(cut)[0] / flux(whole)[0] == pytest.approx(share, rel=0.015)
        assert np.all(cut.values <= whole.values * (1 + 1e-6) + 1e-12 * whole.values.max())
    # near the border only the directions of the six corners hold light; a mirrored iris would have
    # its corners at 40 degrees
    x, y = np.meshgrid(cut.x.values, cut.y.values)
    radius = np.hypot(x, y)[whole.values[0] > 0.2 * whole.values.max()].max()
    turn = np.degrees(np.arctan2(y, x)) % 60
    near = np.abs(np.hypot(x, y) / radius - 0.93) < 0.04
    corners, middles = (
        cut.values[0][near & (np.abs((turn - at + 30) % 60 - 30) < 6)].mean() for at in (20, 50)
    )
    assert corners > 5 * middles


def test_blades_stand_still_while_the_lamp_turns(bare):
    lens = IdealLens(f_number=5.0, focal_length_mm=100.0)
    flare = GhostFlare(
        bare, error_allowed=0.0, sensor_reflectance_percent=0.0, blades=4, rotation_deg=0.0
    )
    right, down = (
        flare.irradiance(lens, lamp(61, 0.016, *at)).values[0] for at in ((30, 45), (45, 30))
    )
    # a square turned by a quarter is the same square
    np.testing.assert_allclose(right.sum(), down.sum(), rtol=1e-2)
    diagonal = replace(flare, rotation_deg=45.0).irradiance(lens, lamp(61, 0.016, 30, 45)).values[0]
    assert np.abs(diagonal - right).sum() > 0.05 * right.sum()


def test_an_equidistant_field_is_refused(bare):
    scene = lamp(9, 0.01, 4, 4)
    scene.attrs["projection"] = "equidistant"
    with pytest.raises(ConfigError, match="projection"):
        GhostFlare(bare).irradiance(IdealLens(f_number=5.0), scene)


def test_ghosts_weaker_than_the_error_allowed_are_not_traced_at_all(monkeypatch):
    lens = IdealLens()
    scene = lamp(41, 0.01, 12, 30, [500.0, 600.0])
    forced = GhostFlare("double_gauss", error_allowed=0.0).irradiance(lens, scene)
    # calling it would fail
    monkeypatch.setattr("isethdr_optics.flare.ghosts.ghost_flare.beams", None)
    rows = ledger.Ledger()
    with ledger.stage(rows, "lens"):
        none = GhostFlare("double_gauss", error_allowed=0.5).irradiance(lens, scene)
    assert float(none.max()) == 0.0
    [left] = rows[0].left_out
    assert np.all(flux(forced) <= left.bound * flux(lens(scene))) and left.bound < 0.25

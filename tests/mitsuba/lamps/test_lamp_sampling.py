"""Sampled points of lamps have the stated density: chi-square tests of all random choices."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

pytest.importorskip("mitsuba")

import drjit as dr
import mitsuba as mi
from isethdr_mitsuba.lamps.lamp_tables import LampTables
from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
from isethdr_mitsuba.lamps.spatial_sampling import (
    LEAST_CLEAR,
    SLOTS,
    Chances,
    PlaceLight,
    places_of,
)
from isethdr_scenes.lamps import lamp

DRAWN = 200_000
HERE = np.array([-12.0, 3.0, -1.5])  # point that the lamps illuminate
LEAST_P = 1e-4  # smallest accepted p value; the seeds are fixed
CELL = 64 * 36 + 5  # a cell of space without near lamps


@pytest.fixture(autouse=True)
def llvm():
    from isethdr_mitsuba.doctor import choose_variant

    mi.set_variant(choose_variant("llvm"))


def p_value(found, share):
    expected = share * found.sum()
    assert expected.min() > 20
    return float(chi2.sf(((found - expected) ** 2 / expected).sum(), len(found) - 1))


def two_lamps(make):
    """Return a bent tail lamp with triangles of 1 to 50 cm2, and a flat brake lamp."""
    y = np.array([0.0, 0.02, 0.07, 0.2, 0.26])
    x = np.array([-0.02, -0.01, 0.0, 0.0, 0.05])
    v = np.array([[a, b, h] for a, b in zip(x, y) for h in (0.0, 0.1)])
    f = np.array([t for k in range(0, 8, 2) for t in ([k, k + 1, k + 3], [k, k + 3, k + 2])])
    back = (-1.0, 0.0, 0.0)
    tail = make.part((v, f), "black", lamp("tail", back))
    brake = make.part((make.quad(0.1, 0.05)[0], make.quad(0.1, 0.05)[1][:, ::-1]), "black")
    brake = make.part((brake.vertices, brake.faces), "black", lamp("brake", back))
    objects = [("tail", "car", (tail,), make.pose()), ("brake", "car", (brake,), make.pose(0, -1))]
    return placed_lamps(make.describe(objects))


def surface_at(point):
    """Return surface interactions at a point of a surface that faces the lamps."""
    si = dr.zeros(mi.SurfaceInteraction3f, DRAWN)
    si.p = mi.Point3f(*map(float, point))
    si.n = mi.Normal3f(1, 0, 0)
    si.sh_frame = mi.Frame3f(si.n)
    si.wi = mi.Vector3f(0, 0, 1)
    return si


@pytest.mark.parametrize(("count", "first", "further"), [(1, 3, 3), (2, 6, 6), (10, 8, 12)])
def test_a_group_of_few_lamps_has_few_candidates(make, count, first, further):
    """Paths that hit a lamp are weighted against the same number of candidates."""
    world = SimpleNamespace(table=lambda value_of, default=0: np.zeros(1, np.uint32))
    tables = LampTables(world, two_lamps(make)[:1] * count, ["other"])
    tables.chances = chances_of([1.0] * count, [1.0] * count)
    drawn = [int(tables.candidates(0, mi.Bool(at))[0]) for at in (True, False)]
    assert drawn == [first, further]
    one = mi.UInt32(0)
    place = mi.UInt32(CELL)
    rivals = [tables.rival(one, place, mi.Bool(at), 1.0, 1.0)[0] for at in (True, False)]
    per_candidate = tables.per_area[0] / count
    # 1e-6: a few roundings in float32
    np.testing.assert_allclose(rivals, np.array(drawn) * per_candidate, rtol=1e-6)


def test_points_are_spread_evenly_over_a_lamp_and_their_density_is_that(make):
    lamps = two_lamps(make)
    world = SimpleNamespace(table=lambda value_of, default=0: np.zeros(1, np.uint32))
    tables = LampTables(world, lamps, ["other"])
    si = surface_at(HERE)
    for number, placed in enumerate(lamps):
        rng = mi.PCG32(size=DRAWN, initstate=3 + number)
        one = mi.UInt32(np.full(DRAWN, number).tolist())
        every = mi.Bool(True)
        chosen = tables.targets[0].pick(rng, one, every)
        p, d, sent, cosine, density = tables._candidate(0, one, chosen, rng, si, every)
        first = int(tables.targets[0].first[number])
        k = np.array(chosen) - first
        at = np.array(p).T.astype(float)
        corner, a, b = (placed.triangles[k, n] for n in range(3))
        # the four parts of a triangle between the middles of its sides: find the part of each point
        share = np.stack([_along(at, corner, a, b), _along(at, corner, b, a)], 1)
        assert share.min() > -1e-3 and share.sum(1).max() < 1 + 1e-3
        quarter = np.select([share[:, 0] > 0.5, share[:, 1] > 0.5, share.sum(1) < 0.5], [1, 2, 3])
        found = np.bincount(4 * k + quarter, minlength=4 * len(placed.triangles))
        vectors = np.cross(*np.moveaxis(np.diff(placed.triangles, axis=1), 1, 0)) / 2
        area = np.linalg.norm(vectors, axis=1)
        assert p_value(found, np.repeat(area / area.sum() / 4, 4)) > LEAST_P
        # density per solid angle, computed from the points
        way = at - HERE
        far = np.linalg.norm(way, axis=1)
        tilt = -np.einsum("nk,nk->n", way / far[:, None], (vectors / area[:, None])[k])
        seen = np.array(sent) > 0
        expected = far**2 / np.maximum(tilt, 1e-12) / area.sum()
        # 2e-3: positions and normals in float32; faces seen at a grazing angle lose digits
        sure = seen & (tilt > 0.05)
        np.testing.assert_allclose(np.array(density)[sure], expected[sure], rtol=2e-3)
        assert (tilt[seen] > 0).all() and seen.mean() > 0.5
        # the sent luminance is the candela of the table over the projected area of the lamp
        shown = np.maximum(-(way / far[:, None]) @ vectors.T, 0).sum(1)
        candela = np.array(sent) * shown
        out = -way / far[:, None]
        left = np.degrees(np.arctan2(-out[:, 1], -out[:, 0]))
        table = placed.lamp.table.at(left, np.degrees(np.arcsin(out[:, 2])))
        # 3 %: Lambertian light of the lens, and the grid of the pattern
        np.testing.assert_allclose(candela[seen], placed.lamp.intensity_cd * table[seen], rtol=0.03)


def chances_of(light, clear_share):
    """Return sampling chances of the lamps of one group, with known light in one cell only."""
    count = np.size(clear_share)
    view = SimpleNamespace(whole=(36, 64))
    camera = SimpleNamespace(origin=mi.Point3f(0))
    votes = np.zeros((places_of(view), count))
    votes[CELL] = light
    known = PlaceLight(votes, np.ones(votes.shape) * clear_share)
    return Chances(camera, view, [list(range(count))], np.ones(count), known)


@pytest.mark.parametrize("clear_share", [(1.0, 1.0), (0.0, 1.0), (0.7, 0.2)])
def test_what_is_expected_to_be_hidden_moves_rays_but_not_light(make, clear_share):
    """The expected visibility of lamps changes how often they are chosen, but not their light.

    Two equal lamps are at the same distance.
    """
    brake = lamp("brake", (-1.0, 0.0, 0.0))
    plate = make.part((make.quad(0.1, 0.05)[0], make.quad(0.1, 0.05)[1][:, ::-1]), "black")
    plate = make.part((plate.vertices, plate.faces), "black", brake)
    objects = [(f"b{y}", "car", (plate,), make.pose(0, y)) for y in (-1.0, 1.0)]
    lamps = placed_lamps(make.describe(objects))
    world = SimpleNamespace(table=lambda value_of, default=0: np.zeros(1, np.uint32))
    tables = LampTables(world, lamps, ["other"])
    tables.chances = chances_of([1.0, 1.0], clear_share)
    si = surface_at((-12.0, 0.0, 0.0))  # at the same distance from both lamps
    rng = mi.PCG32(size=DRAWN, initstate=5)
    turn = mi.Point2u(rng.next_uint32(), rng.next_uint32())
    place = mi.UInt32([CELL] * DRAWN)
    tries = mi.UInt32(8)
    _, point, _, level, _ = tables.choose(0, rng, si, place, tries, turn, mi.Bool(True))
    level = np.array(level).astype(float)
    right = np.array(point)[1] > 0
    # inverse square law: candela over squared distance, times the cosine at the surface
    far2 = 12.0**2 + 1
    towards = placed_candela(lamps, np.array([-12.0, 0.0, 0.0]))
    irradiance = towards * 12 / far2**1.5
    for side in (0, 1):
        found = level * (right == side) * 12 / np.sqrt(far2)
        # 5 standard errors, and 0.1 % for a lamp 0.1 m wide
        within = 5 * found.std() / np.sqrt(DRAWN) + 1e-3 * irradiance[side]
        assert found.mean() == pytest.approx(irradiance[side], abs=within)
    expected = np.maximum(clear_share, LEAST_CLEAR)
    # four of eight candidates lie on each lamp; 0.01: they send the same light to 1 %; plus 5
    # standard errors
    share = expected[1] / expected.sum()
    assert right.mean() == pytest.approx(share, abs=0.01 + 5 * np.sqrt(0.25 / DRAWN))


def placed_candela(lamps, towards):
    """Return the intensities of lamps towards a point, cd, from their luminance and area."""
    out = []
    for placed in lamps:
        way = towards - placed.triangles.reshape(-1, 3).mean(0)
        way /= np.linalg.norm(way)
        shown = -way[0] * placed.area_m2
        out.append(float(placed.relative(way[None])[0]) * placed.peak_cd_m2 * shown)
    return np.array(out)


def _along(at, corner, to, other):
    """Return the coordinate along one side of a triangle, for points in its plane."""
    e = to - corner
    f = other - corner
    w = at - corner
    dot = lambda p, q: np.einsum("nk,nk->n", p, q)
    return (dot(w, e) * dot(f, f) - dot(w, f) * dot(e, f)) / (
        dot(e, e) * dot(f, f) - dot(e, f) ** 2
    )


def test_lamps_are_drawn_by_their_chances():
    """Choose among nine lamps with unequal light, in a cell of space without near lamps."""
    count = 9
    place = CELL
    light = np.random.default_rng(2).lognormal(0, 2, (1, count))
    chances = chances_of(light, np.ones(count))
    rng = mi.PCG32(size=DRAWN, initstate=11)
    places = mi.UInt32(np.full(DRAWN, place).tolist())
    drawn = np.array(chances.pick(0, rng.next_float32(), places, mi.Bool(True)))
    each = mi.UInt32(list(range(count)))
    share = np.array(chances.of(each, mi.UInt32([place] * count), mi.Bool(True)))
    assert share.sum() == pytest.approx(1.0, rel=1e-6) and share.min() > 0.9 / count / SLOTS
    assert p_value(np.bincount(drawn, minlength=count), share.astype(float)) > LEAST_P
    # proportional to light, to one slot
    by_light = 1 / SLOTS / count + (1 - 1 / SLOTS) * light[0] / light.sum()
    np.testing.assert_allclose(share, by_light, atol=1.01 / count / SLOTS)

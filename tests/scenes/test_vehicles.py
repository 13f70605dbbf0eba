"""Vehicles drawn from ranges: sizes known without a mesh, valid meshes, lamps that shine outwards,
levels of detail.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely
from isethdr_scenes import things
from isethdr_scenes.geometry.mesh.piece import Assembly, Piece, face_areas, lit, shift
from isethdr_scenes.geometry.mesh.primitives import box
from isethdr_scenes.materials import MATERIALS
from isethdr_scenes.things.detail import centred, clean, coarser, extent_m, finished
from isethdr_scenes.things.fleets import ALIKE, PIXELS, fleet, likeness, silhouettes
from PIL import Image, ImageDraw

from isethdr_core.data.categories import CATEGORIES

GROUPS = ("car", "truck", "bus", "motorcycle", "bicycle")
FAMILIES = [(group, family) for group in GROUPS for family in things.names(group)]
SIZE_M = 0.03  # largest error of `Thing.size_m` that is promised
GROUND_M = 0.01
# largest number of triangles of a thing, by level of detail
TRIANGLES = {
    "car": {"near": 125_000, "middle": 50_000, "far": 20_000},
    "truck": {"near": 76_000, "middle": 40_000, "far": 16_000},
    "bus": {"near": 125_000, "middle": 66_000, "far": 30_000},
    "motorcycle": {"near": 25_000, "middle": 18_000, "far": 10_000},
    "bicycle": {"near": 8_000, "middle": 6_000, "far": 3_000},
}
DRIVEN = {"low_beam", "position", "tail", "brake", "indicator_front", "indicator_rear"}
DAYTIME = DRIVEN | {"daytime", "reverse"}
LAMPS = {
    "car": DAYTIME,
    "truck": DAYTIME | {"marker"},
    "bus": DAYTIME,
    "motorcycle": DRIVEN,
    "bicycle": {"bike_front", "bike_tail"},
}


def one(group, family, seed=0):
    return things.draw(group, np.random.default_rng([seed]), family)


@cache
def near(thing):
    return things.build(thing, "near")


def triangles(model):
    return sum(len(part.faces) for part in model.parts)


def check_mesh(model, thing):
    low, high = extent_m(model)
    assert high - low == pytest.approx(thing.size_m, abs=SIZE_M)
    assert (low + high)[:2] == pytest.approx([0, 0], abs=SIZE_M)
    assert low[2] == pytest.approx(0, abs=GROUND_M)
    for part in model.parts:
        assert np.isfinite(part.vertices).all()
        assert part.faces.min() >= 0 and part.faces.max() < len(part.vertices)
        assert np.linalg.norm(face_areas(part), axis=1).min() > 0, part.name
        assert part.material in MATERIALS
        if part.normals is not None:
            length = np.linalg.norm(part.normals, axis=1)
            assert length == pytest.approx(1, abs=1e-6), part.name  # rounding of a square root


def check_lamps(model, kinds):
    low, high = extent_m(model)
    parts = {}
    for part in model.parts:
        if part.lamp is None:
            continue
        parts.setdefault(part.lamp.kind, []).append(part)
        area = face_areas(part).sum(0)
        axis = np.array(part.lamp.axis)
        assert area @ axis > 0.5 * np.linalg.norm(area), part.name
        # a lamp in the front half shines forwards, a lamp in the rear half backwards
        if abs(axis[0]) > 0.5 and part.lamp.kind != "brake_high":
            assert axis[0] * part.vertices[:, 0].mean() > 0, part.name
    assert kinds <= set(parts)
    return parts


# each group has one builder, so some families are enough for the quick tests; the slow tests run
# all
QUICK = {"city_car", "tipper", "midi_bus", "motorcycle", "scooter", "city_bicycle"}
SOME = [
    (group, family) if family in QUICK else pytest.param(group, family, marks=pytest.mark.slow)
    for group, family in FAMILIES
]


@pytest.mark.parametrize(("group", "family"), SOME)
def test_a_vehicle_has_its_size_a_sound_mesh_and_all_lamps(group, family):
    thing = one(group, family)
    assert thing.category in CATEGORIES
    check_mesh(near(thing), thing)
    check_lamps(near(thing), LAMPS[group])
    assert triangles(near(thing)) < TRIANGLES[group]["near"]


@pytest.mark.slow
@pytest.mark.parametrize(("group", "family"), FAMILIES)
@pytest.mark.parametrize("detail", ["near", "middle", "far"])
def test_every_level_of_several_members_of_each_family(group, family, detail):
    for seed in range(1, 5):
        thing = one(group, family, seed)
        model = things.build(thing, detail)
        check_mesh(model, thing)
        check_lamps(model, LAMPS[group])
        assert triangles(model) < TRIANGLES[group][detail]


def test_a_far_car_is_coarser_and_has_the_extent_and_the_lamps_of_a_near_one():
    thing = one("car", "city_car")
    far = things.build(thing, "far")
    check_mesh(far, thing)
    check_lamps(far, LAMPS["car"])
    assert triangles(far) < TRIANGLES["car"]["far"]
    lamps = {part.name: part for part in near(thing).parts if part.lamp}
    assert {part.name for part in far.parts if part.lamp} == set(lamps)
    for part in far.parts:
        if part.lamp:
            expected = lamps[part.name].vertices
            # 2 mm: both are centred by their own extents
            assert part.vertices == pytest.approx(expected, abs=2e-3), part.name
            assert np.array_equal(part.faces, lamps[part.name].faces)


@pytest.mark.parametrize("cell_m", [None, 0.05])
def test_finishing_equals_its_three_steps(cell_m):
    sliver = Piece("sliver", np.eye(3) * [1, 0, 0], np.array([[0, 1, 2]]), normals=np.eye(3))
    made = Assembly("made").add(
        sliver,
        *lit(box((0.5, 0.1, 0.3), (0.1, 0.2, 0.1), "lamp", r=0.02), "low_beam", (1, 0, 0)),
        box((0.2, 0.3, 0.4), (0.9, 0.7, 0.5), "body", r=0.1),
        box((0.2, 0.3, 0.4), (0.3, 0.2, 0.2), "seat").moved(shift(0.1, 0.0, 0.2)),
    )
    expected = centred(clean(made))
    if cell_m is not None:
        expected = coarser(expected, cell_m)
    found = finished(made, cell_m)
    assert [part.name for part in found.parts] == [part.name for part in expected.parts]
    assert "sliver" not in {part.name for part in found.parts}
    for one, other in zip(found.parts, expected.parts, strict=True):
        assert np.array_equal(one.vertices, other.vertices)
        assert np.array_equal(one.faces, other.faces)
        assert np.array_equal(one.normals, other.normals)


@pytest.mark.slow
@pytest.mark.parametrize("family", things.names("car"))
def test_far_cars_of_all_families_have_the_lamps_of_near_ones(family):
    for seed in range(2):
        thing = one("car", family, seed)
        lamps = [
            {part.name: part for part in things.build(thing, detail).parts if part.lamp}
            for detail in ("near", "far")
        ]
        assert set(lamps[0]) == set(lamps[1])
        for name, part in lamps[1].items():
            assert part.vertices == pytest.approx(lamps[0][name].vertices, abs=2e-3), name


@pytest.mark.slow
def test_a_far_car_has_the_silhouettes_of_a_near_one():
    thing = one("car", "estate")
    for axis in (0, 1):  # from the side and from the front
        seen = [filled(things.build(thing, detail), axis) for detail in ("near", "far")]
        # 4 %: the far mesh has cells of 10 cm, which move the outline of a car of 1.8 m by some
        # centimetres
        assert np.logical_and(*seen).sum() > 0.96 * np.logical_or(*seen).sum()


def filled(model, axis):
    """Return a mask of 1 cm pixels that a model of at most 6 m covers, seen along an axis."""
    picture = Image.new("1", (600, 300))
    draw = ImageDraw.Draw(picture)
    for part in model.parts:
        points = 100 * part.vertices[part.faces][..., [axis, 2]] + [300, 0]
        for triangle in points.tolist():
            draw.polygon([tuple(point) for point in triangle], fill=1)
    return np.asarray(picture)


def test_the_same_variant_is_the_same_car_and_another_one_differs():
    thing = one("car", "sedan")
    again = one("car", "sedan")
    other = one("car", "sedan", 1)
    assert thing == again and hash(thing) == hash(again)
    assert thing.size_m != other.size_m


@pytest.mark.parametrize("group", ["motorcycle", "bicycle"])
def test_a_rider_sits_behind_the_grips_and_above_the_feet(group):
    for family in things.names(group):
        for seed in range(3):
            thing = one(group, family, seed)
            at = things.riding_position(thing)
            points = np.array([at.saddle, *at.grips, *at.feet])
            half = np.array(thing.size_m) * [0.5, 0.5, 1] + 1e-9  # rounding of a sum
            assert (np.abs(points) <= half).all() and (points[:, 2] > 0.1).all()
            assert at.saddle[1] == 0
            for left, right in (at.grips, at.feet):
                assert left[1] == -right[1] > 0
            assert at.saddle[0] < at.grips[0][0] < at.saddle[0] + 0.95
            assert 0.3 < at.saddle[2] - min(foot[2] for foot in at.feet) < 0.95


def test_lamps_of_both_sides_are_alike():
    thing = one("truck", "tipper")
    sides = {}
    for part in near(thing).parts:
        if part.lamp:
            sides.setdefault(part.lamp.kind, []).append(float(part.vertices[:, 1].mean()))
    for kind, places in sides.items():
        left = sorted(y for y in places if y > 0)
        right = sorted(-y for y in places if y < 0)
        # 2 cm: the sheet of the body is cut along its triangles, which are a few mm wide there
        assert left == pytest.approx(right, abs=0.02), kind


def triangle(height):
    """Return two silhouettes: a right triangle from the side, a full square from the front."""
    x, z = np.meshgrid(np.arange(200) + 0.5, 199.5 - np.arange(200))
    return np.stack([z < height * (200 - x), np.ones_like(x, bool)])


def test_likeness_is_the_intersection_over_the_union_of_the_worse_view():
    # triangles with the same base: the lower one lies inside the higher one
    assert likeness(triangle(1.0), triangle(0.5)) == pytest.approx(0.5, abs=0.01)  # whole pixels
    assert likeness(triangle(0.8), triangle(0.8)) == 1


@pytest.mark.slow
def test_silhouettes_have_the_areas_of_a_vehicles_views():
    """Compare the area of silhouettes with that of the union of the projected triangles."""
    thing = one("truck", "tipper")
    corners = np.concatenate([p.vertices[p.faces] for p in things.build(thing, "far").parts])
    length, _, height = thing.size_m
    shown = silhouettes(thing)
    for k, axis in enumerate((0, 1)):
        flat = shapely.polygons(corners[:, :, [axis, 2]])
        area = shapely.union_all(flat[shapely.area(flat) > 1e-9]).area
        # 4 %: pixels on the outline count as whole pixels
        seen = shown[k].sum() / shown.shape[2] ** 2 * length**2
        assert area < seen < 1.04 * area
        rows = np.flatnonzero(shown[k].any(1))
        tall = (rows[-1] - rows[0] + 1) / shown.shape[2] * length
        assert tall == pytest.approx(height, abs=0.02)  # pixels of 5 mm


def test_a_fleet_is_the_same_for_a_seed_and_holds_no_two_that_are_alike():
    first = fleet(2, 1, ("bicycle",))
    assert first == fleet(2, 1, ("bicycle",))
    assert first != fleet(1, 2, ("bicycle",))
    assert [thing.family for thing in first] == list(things.names("bicycle")[:2])
    assert likeness(*map(silhouettes, first)) <= ALIKE
    with pytest.raises(ValueError, match="hold only 0 vehicles"):
        fleet(1, 0, ())


@pytest.mark.slow
def test_no_two_of_80_vehicles_are_alike():
    """Compare all 3160 pairs by silhouettes with twice the pixels of those used for the choice."""
    shown = np.array([silhouettes(thing, 2 * PIXELS) for thing in fleet(80)])
    alike = []
    for view in shown.swapaxes(0, 1):
        # products of zeros and ones count common pixels; below 2 ** 24 float32 is exact
        flat = view.reshape(len(view), -1).astype(np.float32)
        both = flat @ flat.T
        area = np.diag(both)
        alike.append(both / (area[:, None] + area - both))
    pairs = np.min(alike, 0)[np.triu_indices(80, 1)]
    assert len(pairs) == 3160 and pairs.max() <= ALIKE
    # 1e-6: the ratio is rounded to float32
    assert pairs[0] == pytest.approx(likeness(shown[0], shown[1]), rel=1e-6)


def test_families_are_drawn_by_their_shares():
    rng = np.random.default_rng(3)
    drawn = [things.draw("car", rng).family for _ in range(200)]
    assert set(drawn) == set(things.names("car"))


def test_unknown_names_are_told():
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match="no group of things 'ship'; expected .*car"):
        things.draw("ship", rng)
    with pytest.raises(ValueError, match="no family 'tram' in group 'car'; expected sedan"):
        things.draw("car", rng, "tram")

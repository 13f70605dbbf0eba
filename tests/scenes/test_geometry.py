"""Meshes: volumes and areas against closed forms, cuts that conserve area, faces that look
outwards.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from isethdr_scenes.geometry.mesh.cutting import (
    REACH_M,
    Within,
    cut,
    halves,
    inside_of,
    outside_of,
    polygon,
    subdivide,
)
from isethdr_scenes.geometry.mesh.implicit import Field, blend, cone, skin_of
from isethdr_scenes.geometry.mesh.piece import (
    Assembly,
    compact,
    cross,
    extent_of,
    face_areas,
    greatest,
    join,
    mirrored,
    pose,
    shift,
    unit,
)
from isethdr_scenes.geometry.mesh.primitives import (
    SIDEWAYS,
    Stem,
    ball,
    box,
    closed_tubes,
    flat_grids,
    grid,
    lathe,
    sharp_boxes,
    tube,
    tubes,
)
from isethdr_scenes.geometry.vehicles.headlamp import own_headlamps
from isethdr_scenes.geometry.vehicles.shell import Shell, loft

ROUNDING = 1e-9  # relative rounding of sums over some thousand float64 terms


def volume(piece):
    """Return the enclosed volume by the divergence theorem; positive if faces look outwards."""
    return float((face_areas(piece) * piece.vertices[piece.faces].mean(1)).sum() / 3)


def area(piece):
    return float(np.linalg.norm(face_areas(piece), axis=1).sum())


def open_edge(piece):
    """Return the length of the sum of all vector areas, which is 0 for a closed surface."""
    return float(np.linalg.norm(face_areas(piece).sum(0)))


def test_cross_products_are_those_of_numpy_to_the_bit():
    random = np.random.default_rng(3)
    a = random.normal(size=(50, 3))
    b = random.normal(size=(50, 3))
    np.testing.assert_array_equal(cross(a, b), np.cross(a, b))
    np.testing.assert_array_equal(cross(a, b[0]), np.cross(a, b[0]))


def test_compact_drops_what_no_face_uses_and_keeps_the_rest():
    piece = ball()
    assert compact(piece) is piece
    half = replace(piece, faces=piece.faces[:10])
    small = compact(half)
    assert len(small.vertices) < len(piece.vertices)
    np.testing.assert_array_equal(small.vertices[small.faces], half.vertices[half.faces])


def test_each_edge_has_one_middle():
    piece = box((0, 0, 0), (1, 2, 3))
    shared = grid(np.stack(np.meshgrid([0, 1, 2], [0, 1], [0.0], indexing="ij"), -1)[:, :, 0])
    fine = subdivide(shared)
    # two quads: 6 vertices, 4 faces, and 9 edges by Euler's V - E + F = 1
    assert len(fine.vertices) == len(shared.vertices) + 9
    assert len(fine.faces) == 4 * len(shared.faces)
    assert area(subdivide(piece)) == pytest.approx(area(piece), rel=ROUNDING)


def test_box_has_its_volume_and_rounding_takes_away_the_corners():
    size = (1.0, 2.0, 3.0)
    assert volume(box((5, 1, 2), size)) == pytest.approx(6.0, rel=ROUNDING)
    r = 0.2
    inner = np.array(size) - 2 * r  # Steiner's formula for a box grown by r
    faces = 2 * (inner[0] * inner[1] + inner[1] * inner[2] + inner[2] * inner[0]) * r
    exact = inner.prod() + faces + np.pi * r**2 * inner.sum() + 4 / 3 * np.pi * r**3
    # 5e-3: rounded edges are polygons of few chords, which lie inside of the arc by a share of r^2
    assert volume(box((0, 0, 0), size, r=r, n=4)) == pytest.approx(exact, rel=5e-3)


def test_ball_and_implicit_ball_converge_to_a_sphere():
    exact = 4 / 3 * np.pi * 0.5**3
    # the inscribed polyhedron of n steps misses about (pi/n)^2 / 4 of each of two angles
    assert volume(ball(radii=(0.5,) * 3, n=40)) == pytest.approx(exact, rel=5e-3)
    sphere = skin_of(cone((0, 0, 0), (0, 0, 0), 0.5, 0.5), 0.025, "sphere", "skin")
    # 5e-3: step / radius is 1/20, so the sagitta is of the order of (1/20)^2
    assert volume(sphere) == pytest.approx(exact, rel=5e-3)
    # normals are central differences of the field over e = 0.7 steps; they err by (e / r)^2 / 6 =
    # 2e-4
    assert np.abs(sphere.normals - unit(sphere.vertices)).max() < 5e-4
    assert open_edge(sphere) < ROUNDING


def test_tube_and_lathe_are_closed_cylinders():
    t = tube([(0, 0, 0), (0, 0, 2.0)], 0.1, sides=64)
    # 0.2 %: the section is a polygon of 64 sides
    assert volume(t) == pytest.approx(np.pi * 0.1**2 * 2, rel=2e-3)
    turned = lathe([(1e-6, -1), (0.3, -1), (0.3, 1), (1e-6, 1)], n=128, axis="z")
    assert volume(turned) == pytest.approx(np.pi * 0.3**2 * 2, rel=1e-3)


def test_smooth_union_is_larger_than_its_parts_and_smaller_than_their_sum():
    a = cone((0, 0, 0), (0.3, 0, 0), 0.1, 0.1)
    b = cone((0.2, 0, 0), (0.5, 0, 0), 0.1, 0.1)
    both = volume(skin_of(blend([a, b], 0.03), 0.01, "union", "skin"))
    one = np.pi * 0.1**2 * 0.3 + 4 / 3 * np.pi * 0.1**3
    assert one < both < 2 * one


def test_cut_conserves_area_and_finds_the_circle():
    x, y = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(-1, 1, 81), indexing="ij")
    sheet = grid(np.stack([x, y, 0 * x], -1))
    inside, outside, seam = cut(sheet, np.hypot(*sheet.vertices[:, :2].T) - 0.6)
    assert area(inside) + area(outside) == pytest.approx(4.0, rel=ROUNDING)
    # 1e-3: on a grid of pitch 1/40 the circle is a polygon whose sagitta is pitch^2 / (8 r)
    assert area(inside) == pytest.approx(np.pi * 0.36, rel=1e-3)
    length = np.linalg.norm(seam[:, 0, 0] - seam[:, 1, 0], axis=1).sum()
    assert length == pytest.approx(2 * np.pi * 0.6, rel=2e-3)


def test_both_sides_of_a_cut_hold_what_their_faces_use():
    sphere = ball(n=12)
    value = sphere.vertices @ [0.6, 0.3, 0.2] - 0.1
    for k, side in enumerate(cut(sphere, value)[:2]):
        assert np.array_equal(np.unique(side.faces), np.arange(len(side.vertices)))
        rest = value[(value > 0) == k]
        # the vertices of that side come first, then both ends of the cutting line in each face
        assert np.array_equal(side.vertices[: len(rest)], sphere.vertices[(value > 0) == k])
        assert side.vertices[len(rest) :] @ [0.6, 0.3, 0.2] == pytest.approx(0.1, abs=1e-12)
    whole, nothing, seam = cut(sphere, np.full(len(sphere.vertices), -1.0))
    assert np.array_equal(whole.vertices[whole.faces], sphere.vertices[sphere.faces])
    assert not len(nothing.faces) and not len(seam)


def test_cut_along_a_linear_field_is_exact():
    whole = box((0, 0, 0), (1, 1, 1))
    below, above, _ = cut(whole, whole.vertices[:, 2] - 0.2)
    assert below.vertices[:, 2].max() == pytest.approx(0.2, abs=1e-12)
    assert area(below) == pytest.approx(1 + 4 * 0.7, rel=ROUNDING)
    assert area(above) == pytest.approx(1 + 4 * 0.3, rel=ROUNDING)


def same_mesh(one, other):
    pairs = (
        (one.vertices, other.vertices),
        (one.faces, other.faces),
        (one.normals, other.normals),
    )
    return all(np.array_equal(a, b) for a, b in pairs)


def test_a_single_side_of_a_cut_equals_that_of_the_whole_cut():
    sphere = ball(n=12)
    value = sphere.vertices @ [0.6, 0.3, 0.2] - 0.1
    inside, outside, _ = cut(sphere, value)
    assert all(map(same_mesh, halves(sphere, value), (inside, outside)))
    assert same_mesh(inside_of(sphere, value), inside)
    assert same_mesh(outside_of(sphere, value), outside)
    assert not same_mesh(inside, outside)


def test_distances_are_left_out_only_where_they_change_no_cut():
    """The faces of the sheet are 0.3 m wide, which is longer than the ends of the region."""
    x, y = np.meshgrid(np.linspace(-3, 3, 21), np.linspace(-3, 3, 21), indexing="ij")
    sheet = grid(np.stack([x, y, 0 * x], -1))
    x, y, _ = sheet.vertices.T
    outline = polygon([(-0.5, -0.4), (0.7, -0.3), (0.1, 0.6)], 0.05)
    for grow_m in (0.0, 0.1):
        beside = 0.2 - x
        everywhere = outline(x, y)
        near = outline(x, y, Within(sheet.faces, beside, grow_m))
        whole = cut(sheet, np.maximum(everywhere, beside) - grow_m)
        fast = cut(sheet, np.maximum(near, beside) - grow_m)
        assert all(map(same_mesh, fast[:2], whole[:2])) and np.array_equal(fast[2], whole[2])
        assert len(fast[0].faces) > 4
        # many distances that are smaller than the reach were not computed
        assert ((near == REACH_M) & (everywhere < REACH_M)).sum() > 50


def test_extents_and_maxima_are_those_of_numpy():
    v = np.random.default_rng(4).normal(size=(50, 3))
    assert np.array_equal(extent_of(v), [v.min(0), v.max(0)])
    assert np.array_equal(greatest(*v.T), v.max(1))


def test_a_tube_follows_the_central_differences_of_its_path():
    path = np.random.default_rng(5).normal(size=(6, 3))
    rings = tube(path, 0.1, sides=5, caps=False).vertices.reshape(6, 5, 3)
    slopes = np.gradient(path, axis=0)
    # each ring lies in the plane through its point that is perpendicular to the slope
    off_plane = ((rings - path[:, None]) * unit(slopes)[:, None]).sum(-1)
    assert np.abs(off_plane).max() < ROUNDING


def test_polygon_is_a_signed_distance():
    square = polygon([(-1, -1), (1, -1), (1, 1), (-1, 1)], 0.25)
    p = np.array([0.0, 2.0, 2.0, 0.0])
    q = np.array([0.0, 0.0, 2.0, 0.75])
    assert square(p, q) == pytest.approx([-1.25, 0.75, np.sqrt(2) - 0.25, -0.5], abs=1e-12)
    # beyond the reach the distance is the reach: positive, and not larger than the true distance
    assert square(np.array([7.0]), np.array([0.0])) == REACH_M


def test_far_edges_of_a_polygon_are_passed_over_without_a_change():
    """Compare with shapely for a star of 60 edges, which are too many to try one by one."""
    turn = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    radius = 0.5 + 0.2 * np.cos(9 * turn)
    star = np.stack([radius * np.cos(turn), 0.4 * radius * np.sin(turn)], 1)
    x, y = np.random.default_rng(3).uniform(-1, 1, (2, 400))
    expected = shapely.distance(shapely.LinearRing(star), shapely.points(x, y))
    expected *= np.where(shapely.contains_xy(shapely.Polygon(star), x, y), -1, 1)
    assert polygon(star)(x, y) == pytest.approx(expected, abs=ROUNDING)


def test_folds_are_left_out_only_where_they_change_no_surface():
    limbs = [
        cone((0, 0, 0), (0.3, 0.1, 0), 0.08, 0.05),
        cone((0.3, 0, 0), (0.3, 0, 0.2), 0.06, 0.05),
    ]
    folded = blend([blend(limbs[:1], 0.03, 0.008, 1), limbs[1]], 0.02)
    everywhere = Field(folded.values, folded.lo, folded.hi)
    cheap, whole = (skin_of(field, 0.012, "cloth", "cloth_red") for field in (folded, everywhere))
    assert np.array_equal(cheap.vertices, whole.vertices)
    assert np.array_equal(cheap.faces, whole.faces)
    smooth = skin_of(blend(limbs, 0.02), 0.012, "cloth", "cloth_red")
    assert cheap.vertices.shape != smooth.vertices.shape  # folds change the mesh


def test_a_union_leaves_out_only_parts_that_are_too_far_to_change_it():
    rng = np.random.default_rng(2)
    ends = rng.uniform(-0.4, 0.4, (6, 2, 3))
    limbs = [cone(a, b, 0.07, 0.04) for a, b in ends]
    points = rng.uniform(-0.6, 0.6, (500, 3))
    each = np.array([limb(points) for limb in limbs])
    expected = each[0]
    for other in each[1:]:
        melt = np.maximum(0.03 - np.abs(expected - other), 0) ** 2 / (4 * 0.03)
        expected = np.minimum(expected, other) - melt
    assert blend(limbs, 0.03)(points) == pytest.approx(expected, abs=ROUNDING)


def test_tubes_are_the_joined_tubes_bit_by_bit():
    """Compare tubes made together with tubes made one by one and joined.

    One of them is parallel to `SIDEWAYS`, the direction from which the sides of a tube are built.
    """
    rng = np.random.default_rng(4)
    paths = [np.cumsum(rng.uniform(0, 1, (k, 3)), 0) for k in (3, 5, 3, 2)]
    paths.append(np.linspace(0, 1, 5)[:, None] * SIDEWAYS)
    radii = [0.1, rng.uniform(0.01, 0.1, 5), rng.uniform(0.01, 0.1, 3), 0.05, 0.02]
    stems = [Stem(*stem) for stem in zip(paths, radii, (6, 4, 6, 3, 4), strict=True)]
    joined = join([tube(*stem[:2], sides=stem.sides, caps=False) for stem in stems], "tubes")
    made = tubes(stems)
    for one, other in ((made.vertices, joined.vertices), (made.normals, joined.normals)):
        assert np.array_equal(one, other)
    assert np.array_equal(made.faces, joined.faces)


def test_closed_tubes_and_boxes_are_the_joined_ones_bit_by_bit():
    rng = np.random.default_rng(5)
    paths = rng.normal(size=(5, 4, 3))
    radii = rng.uniform(0.01, 0.1, (5, 4))
    centres = rng.normal(size=(3, 3))
    sizes = rng.uniform(0.1, 1, (3, 3))
    grids = rng.normal(size=(2, 4, 3, 3))
    pairs = [
        (closed_tubes(paths, radii, 6), [tube(*one, sides=6) for one in zip(paths, radii)]),
        (sharp_boxes(centres, sizes, "", ""), [box(*one) for one in zip(centres, sizes)]),
        (
            flat_grids(grids, "", "", close_v=True),
            [grid(one, close_v=True, smooth=False) for one in grids],
        ),
    ]
    for at_once, apart in pairs:
        joined = join(apart, "joined")
        for field in ("vertices", "faces", "normals"):
            assert np.array_equal(getattr(at_once, field), getattr(joined, field)), field


def test_subdivision_keeps_the_surface():
    piece = ball()
    fine = subdivide(piece)
    assert len(fine.faces) == 4 * len(piece.faces)
    assert area(fine) == pytest.approx(area(piece), rel=ROUNDING)
    assert volume(fine) == pytest.approx(volume(piece), rel=ROUNDING)


def test_moving_scales_volume_and_mirroring_keeps_faces_outward():
    piece = box((0.5, 0.2, 0.1), (0.4, 0.3, 0.2), r=0.02)
    assert volume(piece.moved(pose(3, 1, 0, 30, (2, 1, 1)))) == pytest.approx(
        2 * volume(piece), rel=ROUNDING
    )
    other = mirrored(piece)
    assert volume(other) == pytest.approx(volume(piece), rel=ROUNDING)
    centre = other.vertices.mean(0)
    assert ((other.vertices - centre) * other.normals).sum(1).min() > 0


def test_stretched_normals_stay_across_the_surface():
    long = ball(n=40).moved(pose(scale=(3, 1, 1)))
    v = long.vertices
    exact = unit(v / np.array([9.0, 1, 1]))  # gradient of x^2/9 + y^2 + z^2
    assert np.median(np.abs(long.normals - exact).max(1)) < 0.01  # error of a mesh of 40 rings


def test_shell_is_closed_outward_and_symmetric():
    skin = loft(
        Shell(
            4.6,
            1.8,
            ((0, 0.7), (1.3, 0.95), (2.1, 1.4), (3.3, 1.4), (4.6, 1.0)),
            ((0, 0.6), (4.6, 0.95)),
        ),
        (0.9, 3.6),
    )
    assert open_edge(skin) < 1e-6  # the two poles of the end caps are collapsed rings
    assert 4.0 < volume(skin) < 4.6 * 1.8 * 1.4  # smaller than its box
    assert skin.vertices[:, 1].min() == pytest.approx(-skin.vertices[:, 1].max(), abs=1e-12)


def test_a_model_joins_parts_by_material_but_keeps_lamps_apart():
    model = own_headlamps(2.0, 0.65, 0.65).model()
    assert len(model.parts) == 2 and all(p.lamp for p in model.parts)
    many = (
        Assembly("many")
        .add(*(box((k, 0, 0), (1, 1, 1), f"b{k}", "steel") for k in range(5)))
        .model()
    )
    assert [p.name for p in many.parts] == ["steel"]
    assert len(many.parts[0].faces) == 60


def test_own_headlamps_stand_where_they_are_asked_to_and_look_ahead():
    for part in own_headlamps(2.0, 0.65, 0.66).model().parts:
        side = 1 if part.name.endswith("left") else -1
        # 0.05 m: radius of the lens
        assert np.allclose(part.vertices.mean(0), (2.0, side * 0.65, 0.66), atol=0.05)
        assert (unit(face_areas(part))[:, 0] > 0.99).all()


def test_shift_is_a_pose():
    assert np.array_equal(shift(1, 2, 3), pose(1, 2, 3))

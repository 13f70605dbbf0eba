"""Labels on scenes whose geometry is known."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mitsuba")

from isethdr_mitsuba.doctor import choose_variant
from isethdr_mitsuba.renderer import MitsubaRenderer

from isethdr_core.data.categories import CATEGORIES
from isethdr_core.demand import Demand
from isethdr_core.errors import ConfigError
from isethdr_core.quantities import LABELS
from isethdr_core.scene import NextFrame

ALL = Demand(labels=frozenset(LABELS))


@pytest.fixture(scope="module")
def boxes(make):
    """Return a rendering of two boxes, 2 m wide, with faces 10 m and 20 m ahead.

    The nearer box is left of the axis and hides half of the farther one.
    """
    parts = (make.part(make.cube),)
    scene = make.describe(
        [("near", "car", parts, make.pose(11, 1)), ("far", "person", parts, make.pose(21, 0))],
        sky=make.flat(1e-3),
        camera=make.camera((0, 0, 0), (1, 0, 0), 40.0, 2.0),
    )
    return MitsubaRenderer(width=200, height=100, samples=1, margin=0.1)(scene, ALL)


def test_an_unknown_category_is_refused_before_rendering(make, monkeypatch):
    from isethdr_mitsuba import frame

    monkeypatch.setattr(frame, "followed_light", None)
    box = ("box", "kar", (make.part(make.cube),), make.pose(11))
    scene = make.describe([box], sky=make.flat(1e-3))
    with pytest.raises(ConfigError, match="unknown category 'kar'; did you mean 'car'"):
        MitsubaRenderer(width=4, height=4, samples=1)(scene, ALL)


def test_an_unknown_label_is_refused_before_rendering(make, monkeypatch):
    from isethdr_mitsuba import frame

    monkeypatch.setattr(frame, "followed_light", None)
    scene = make.describe([], sky=make.flat(1e-3))
    with pytest.raises(ConfigError, match="label 'dept'.*did you mean 'depth'"):
        MitsubaRenderer(width=4, height=4, samples=1)(scene, Demand(labels=frozenset({"dept"})))


def test_motion_may_be_demanded_where_the_scene_states_its_next_frame(make):
    scene = make.describe([], sky=make.flat(1e-3))
    renderer = MitsubaRenderer(width=4, height=4, samples=1)
    demand = Demand().with_labels("motion")
    with pytest.raises(ConfigError, match="does not state its next frame.*frames_per_s=30"):
        renderer(scene, demand)
    moving = replace(scene, next_frame=NextFrame(0.1, scene.camera, ()))
    made = renderer(moving, demand)
    assert made["motion"].dims == ("y", "x", "uv") and "instance" not in made
    # float64: 1e-16 of a coordinate below 1
    assert np.abs(made["motion"].values).max() < 1e-15


def test_an_unknown_model_is_refused(make):
    scene = make.describe([("box", "car", (), make.pose(11))], sky=make.flat(1e-3))
    scene = replace(scene, objects=(replace(scene.objects[0], model="bax"),))
    with pytest.raises(ConfigError, match="unknown model 'bax'; did you mean 'box'"):
        MitsubaRenderer(width=4, height=4, samples=1)(scene)


def test_the_grid_is_the_camera_field_with_its_margin(boxes):
    full = 2 * np.tan(np.radians(20))
    assert boxes.sizes["x"] == 240 and boxes.sizes["y"] == 120
    assert boxes.attrs["field_width"] == pytest.approx(full) and boxes.attrs[
        "field_height"
    ] == pytest.approx(full / 2)
    np.testing.assert_allclose(boxes.x, (np.arange(240) - 119.5) * full / 200, rtol=1e-12)
    np.testing.assert_allclose(boxes.y, (np.arange(120) - 59.5) * full / 200, rtol=1e-12)


def test_instances_match_projected_boxes_tile_for_tile(boxes):
    """World y is left, so the near box, y from 0 to 2 m at x = 10 m, covers tangents -0.2 to 0."""
    x, y = np.meshgrid(boxes.x, boxes.y)
    near = (x > -0.2) & (x < 0) & (np.abs(y) < 0.1)
    far = (np.abs(x) < 0.05) & (np.abs(y) < 0.05) & ~near
    instance = boxes.instance.values
    assert np.array_equal(instance == 1, near) and np.array_equal(instance == 2, far)
    assert np.array_equal(instance == 0, ~(near | far))
    assert set(np.unique(boxes.category.values[near])) == {CATEGORIES["car"]}
    assert set(np.unique(boxes.category.values[far])) == {CATEGORIES["person"]}


def test_depth_is_along_the_axis_and_distance_along_the_ray(boxes):
    instance, depth, distance = (boxes[n].values for n in ("instance", "depth", "distance"))
    x, y = np.meshgrid(boxes.x, boxes.y)
    # float32: relative error of 1e-6
    np.testing.assert_allclose(depth[instance == 1], 10, rtol=2e-6)
    np.testing.assert_allclose(depth[instance == 2], 20, rtol=2e-6)
    np.testing.assert_allclose(
        distance[instance > 0], (depth * np.sqrt(1 + x**2 + y**2))[instance > 0], rtol=2e-6
    )
    assert np.isinf(depth[instance == 0]).all() and np.isinf(distance[instance == 0]).all()
    # the camera sees the -x faces of the boxes
    np.testing.assert_allclose(
        boxes.normal.values[instance > 0],
        np.broadcast_to([-1, 0, 0], ((instance > 0).sum(), 3)),
        atol=1e-6,
    )


def test_object_table(boxes):
    near, far = boxes.attrs["objects"]
    assert (near["name"], near["instance"], near["category"], near["visible_fraction"]) == (
        "near",
        1,
        "car",
        1.0,
    )
    rows, columns = np.nonzero(boxes.instance.values == 2)
    assert far["box"] == [columns.min(), rows.min(), np.ptp(columns) + 1, np.ptp(rows) + 1]
    # the near box hides the left half of the far one
    assert far["visible_fraction"] == pytest.approx(0.5, abs=1e-12)
    assert far["distance_m"] == pytest.approx(20, rel=1e-3) and far["position_m"] == [
        21.0,
        0.0,
        0.0,
    ]


def test_the_whole_box_of_a_hidden_object_and_the_part_beyond_the_field(boxes):
    """Compare whole boxes of objects, in tiles, with closed forms.

    Tiles are 2 tan(20 degrees) / 200 wide; the overscan is 20 tiles on the left and 10 at the top.
    """
    near, far = boxes.attrs["objects"]
    pitch = 2 * np.tan(np.radians(20)) / 200
    half = 0.05 / pitch
    np.testing.assert_allclose(far["box_full"], [120 - half, 60 - half, 2 * half, 2 * half])
    # the near box extends to a tangent of 0.2 on the left, which is within the field of 0.364
    np.testing.assert_allclose(near["box_full"], [120 - 4 * half, 60 - 2 * half] + [4 * half] * 2)
    assert (near["truncation"], far["truncation"]) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_truncation_is_the_share_beyond_the_field(make):
    """A panel 10 m ahead, from 1.5 m left of the edge of the field to 0.5 m right of it."""
    from isethdr_mitsuba.labels import truncation, whole_object
    from isethdr_mitsuba.world.view import view_of

    from isethdr_core.scene import Model

    view = view_of(make.camera((0, 0, 0), (1, 0, 0), 40.0, 1.0), 100, 100, 0.1)
    edge_m = 10 * np.tan(np.radians(20))
    panel = Model("panel", (make.part(make.quad(1.0, 0.5)),))
    whole = whole_object(panel, make.pose(10.0, edge_m + 0.5), view)
    assert truncation(whole.box, view) == pytest.approx(0.75)
    beside = whole_object(panel, make.pose(0.5, 1.0, turn_deg=90.0), view)
    reach = np.tan(np.radians(75.0)) / view.pitch_x  # the panel continues behind the camera
    assert beside.box[0] == pytest.approx(60 - reach) and truncation(beside.box, view) > 0.9


def test_a_model_placed_twice_is_labelled_apart(make):
    from isethdr_core.scene import Model, Placed, SceneDescription

    one = Model(
        "one",
        (
            make.part(make.cube),
            make.part(
                make.quad(0.1, 0.1, 1.01), lamp=make.lamp("tail", "other", 1.0, make.flat(1))
            ),
        ),
    )
    scene = SceneDescription(
        "twice",
        {"one": one},
        tuple(
            Placed(f"o{i}", "one", "car", make.pose(12, y, turn_deg=180 * i))
            for i, y in enumerate((2, -2))
        ),
        {"grey": make.material("grey")},
        make.camera((0, 0, 0), (1, 0, 0), 40.0, 2.0),
        make.flat(1e-3),
    )
    ds = MitsubaRenderer(width=100, height=50, samples=1, margin=0.0)(scene, ALL)
    left, right = (set(np.unique(h)) for h in np.array_split(ds.instance.values, 2, 1))
    assert (left, right) == ({0, 1}, {0, 2})
    assert [lamp["instance"] for lamp in ds.attrs["lamps"]] == [1, 2]


def test_the_name_of_a_model_placed_twice_may_contain_a_dot(make):
    import mitsuba as mi

    mi.set_variant(choose_variant("scalar"))
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces

    scene = make.describe([("car.v2", "car", (make.part(make.cube),), make.pose(9))])
    scene = replace(scene, objects=scene.objects * 2)
    world = build_world(scene, ramp_surfaces(scene))
    assert [s.label for s in world.shapes if s.pose is not None] == [1, 2]


def test_labels_not_asked_for_are_absent(make):
    ds = MitsubaRenderer(width=4, height=4, samples=1)(
        make.describe([], sky=make.flat(1)), Demand(labels=frozenset({"depth"}))
    )
    assert "depth" in ds and "instance" not in ds and "objects" not in ds.attrs
    ds = MitsubaRenderer(width=4, height=4, samples=1)(make.describe([], sky=make.flat(1)))
    assert not set(LABELS) & set(ds.data_vars)

"""Exported labels give the same masks and the same numbers in the programs that read them."""

from __future__ import annotations

import contextlib
import io
import json
import struct

import numpy as np
import pytest
from isethdr_catalog.selection import select
from isethdr_workflows.export.exporting import exported
from isethdr_workflows.export.job import Item
from isethdr_workflows.export.labels import geometry, masks
from isethdr_workflows.export.labels.run_length import lengths, text
from PIL import Image

from isethdr_core.data.categories import CATEGORIES
from isethdr_core.data.reference_picture import make_picture
from isethdr_core.data.scene_description import Camera, Model, Part, Placed, SceneDescription
from isethdr_core.errors import CatalogError
from isethdr_core.results.stored import open_run

from .stored_runs import COLUMNS, LABELLED, ROWS

WHY = "one of the programs that read the files; pip install 'isethdr[test]'"
SIZES = ((4.0, 0.06, 0.05), (0.3, 0.02, 0.1), (9.0, 0.4, 0.01))  # of car, person and road, m
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4], [2, 3, 7], [2, 7, 6]]
)


def corners(size) -> np.ndarray:
    """Return the corners (8, 3) of a box around the origin."""
    return np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)]) * size / 2


def scene(turn_deg: float = 0.0, moved_m: float = 0.0) -> SceneDescription:
    """Return the scene of the labelled run: a camera at the origin that looks along x, and three
    boxes at 10, 20 and 30 m, turned about z and moved along x.
    """
    a = np.radians(turn_deg)
    models = {}
    objects = []
    for number, (name, size) in enumerate(zip(("car", "person", "road"), SIZES), 1):
        models[name] = Model(name, (Part("all", corners(np.array(size)), FACES, "grey"),))
        pose = np.eye(4)
        pose[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
        pose[0, 3] = 10.0 * number + moved_m
        objects.append(Placed(f"{name} {number}", name, name, pose))
    camera = Camera((0, 0, 0), (1, 0, 0), 45.0)
    return SceneDescription("three_boxes", models, tuple(objects), {}, camera)


@pytest.fixture
def three_boxes(monkeypatch):
    """Return a function that sets the scene description of the labelled run."""

    def offer(made) -> None:
        monkeypatch.setattr(geometry, "_built", lambda settings: made)
        geometry.full_boxes.cache_clear()

    yield offer
    geometry.full_boxes.cache_clear()


@pytest.mark.parametrize("seed", range(6))
def test_a_mask_is_the_text_that_pycocotools_makes(seed):
    codec = pytest.importorskip("pycocotools.mask", reason=WHY)
    rng = np.random.default_rng(seed)
    mask = rng.random((37, 70)) < (0.02, 0.98, 0.5, 0.0, 1.0, 0.3)[seed]
    mask[:, 20:40] |= seed == 5  # runs longer than 5 bits
    expected = codec.encode(np.asfortranarray(mask.astype(np.uint8)))["counts"].decode()
    assert text(lengths(mask, 0, 0, mask.shape)) == expected
    part = np.zeros_like(mask)
    part[5:30, 7:60] = mask[5:30, 7:60]
    expected = codec.encode(np.asfortranarray(part.astype(np.uint8)))["counts"].decode()
    assert text(lengths(mask[5:30, 7:60], 7, 5, mask.shape)) == expected


def coco_file(tmp_path, what=(LABELLED,)) -> str:
    """Export COCO labels and return the path of the file."""
    exported(what, tmp_path / "out", ["coco"], licence="https://example.org/licence")
    return str(tmp_path / "out" / "coco.json")


def test_coco_holds_visible_boxes_and_masks_of_things(home, tmp_path):
    coco = pytest.importorskip("pycocotools.coco", reason=WHY)
    with contextlib.redirect_stdout(io.StringIO()):
        data = coco.COCO(coco_file(tmp_path))
    [image] = data.loadImgs(data.getImgIds())
    assert (image["width"], image["height"]) == (COLUMNS, ROWS)
    assert image["file_name"] == f"png/{LABELLED}_bayer.png"
    assert data.dataset["licenses"][0]["url"] == "https://example.org/licence"
    instance = open_run(LABELLED).open("truth/bayer")["instance"].values
    found = {row["instance"]: row for row in data.loadAnns(data.getAnnIds())}
    assert found.keys() == {1, 2}, "the road is no thing"
    assert found[1]["bbox"] == [4, 3, 8, 6] and found[2]["bbox"] == [6, 4, 2, 6]
    for number, row in found.items():
        np.testing.assert_array_equal(data.annToMask(row), instance == number)
        assert row["area"] == (instance == number).sum() == data.annToMask(row).sum()
        assert row["distance_m"] == 10.0 * number and "bbox_full" not in row
        assert row["truncation"] == 0.25
        weights = open_run(LABELLED).attributes["weights"]
        lit = {"sky": 100.0 * number, "headlights": 4.0, "tunnel": 1.0}
        assert row["illuminance_lx"] == {g: lx * weights.get(g, 0.0) for g, lx in lit.items()}
    assert [data.cats[found[k]["category_id"]]["name"] for k in (1, 2)] == ["car", "person"]
    assert set(data.cats) <= set(CATEGORIES.values())


@pytest.mark.parametrize("kind", ["bbox", "segm"])
def test_pycocotools_and_hotcoco_find_the_same_numbers(home, tmp_path, kind):
    """The detections are partly wrong: one box is off by a pixel, others have another category."""
    pycoco = pytest.importorskip("pycocotools.coco", reason=WHY)
    pyeval = pytest.importorskip("pycocotools.cocoeval", reason=WHY)
    hotcoco = pytest.importorskip("hotcoco", reason=WHY)
    path = coco_file(tmp_path)
    truth = json.loads((tmp_path / "out" / "coco.json").read_text())["annotations"]
    detections = []
    for k, row in enumerate(truth):
        found = {name: row[name] for name in ("image_id", "category_id", "segmentation")}
        x, y, w, h = row["bbox"]
        detections.append(found | {"bbox": [x + k, y, w, h], "score": 0.9 - 0.1 * k})
        detections.append(found | {"category_id": 3, "bbox": [0, 0, 3, 3], "score": 0.5})
    with contextlib.redirect_stdout(io.StringIO()):
        stats = []
        for load, evaluate in (
            (pycoco.COCO, pyeval.COCOeval),
            (hotcoco.COCO, hotcoco.COCOeval),
        ):
            data = load(path)
            answer = data.loadRes([dict(row) for row in detections])
            found = evaluate(data, answer, kind)
            found.evaluate()
            found.accumulate()
            found.summarize()
            stats.append(np.array(found.stats, float))
    np.testing.assert_allclose(stats[1], stats[0], rtol=0, atol=1e-12)  # sums of float64
    assert 0 < stats[0][0] <= 1, "some of them are right"


def test_panoptic_pictures_hold_the_number_of_each_segment(home, tmp_path):
    exported([LABELLED], tmp_path / "out", ["panoptic"])
    data = json.loads((tmp_path / "out" / "panoptic.json").read_text())
    [row] = data["annotations"]
    rgb = np.asarray(Image.open(tmp_path / "out" / "panoptic" / row["file_name"]), int)
    number = rgb @ [1, 256, 65536]
    instance = open_run(LABELLED).open("truth/bayer")["instance"].values
    np.testing.assert_array_equal(number, instance)
    kinds = {category["id"]: category["isthing"] for category in data["categories"]}
    for segment in row["segments_info"]:
        assert segment["area"] == (number == segment["id"]).sum()
    found = [(s["id"], kinds[s["category_id"]]) for s in row["segments_info"]]
    assert found == [(1, 1), (2, 1), (3, 0)]
    road = row["segments_info"][2]
    assert road["bbox"] == [0, 8, 16, 4]


def test_stuff_of_one_category_is_one_segment(home, tmp_path, monkeypatch):
    monkeypatch.setattr("isethdr_catalog.dataset.STUFF", ("car", "road", "person"))
    exported([LABELLED], tmp_path / "all", ["panoptic"])
    truth = open_run(LABELLED).open("truth/bayer").load()
    for row in truth.attrs["objects"]:
        row["category"] = "road"
    monkeypatch.setattr(Item, "truth", lambda self: truth)
    exported([LABELLED], tmp_path / "one", ["panoptic"])
    [row] = json.loads((tmp_path / "one" / "panoptic.json").read_text())["annotations"]
    [segment] = row["segments_info"]
    seen = truth["instance"].values > 0
    assert segment["area"] == seen.sum() and segment["bbox"] == [0, 3, 16, 9]
    rgb = np.asarray(Image.open(tmp_path / "one" / "panoptic" / row["file_name"]))
    np.testing.assert_array_equal(rgb[..., 0], np.where(seen, segment["id"], 0))


def test_panoptic_quality_of_the_truth_is_one(home, tmp_path):
    panoptic = pytest.importorskip("hotcoco.panoptic", reason=WHY)
    exported([LABELLED], tmp_path / "out", ["panoptic"])
    path = str(tmp_path / "out" / "panoptic.json")
    with contextlib.redirect_stdout(io.StringIO()):
        found = panoptic.PanopticEval(path, path)
        found.run()
    assert found.results()["All"]["pq"] == 1.0


def test_a_run_without_labels_is_refused(home, tmp_path):
    for name in ("coco", "panoptic", "boxes3d"):
        with pytest.raises(CatalogError, match=f"run {home.plain} has no map of objects .*{name}"):
            exported([home.plain], tmp_path / "out", [name])


def test_a_picture_that_shows_nothing_has_no_labels_and_is_written(
    home, tmp_path, three_boxes, monkeypatch
):
    """A camera that looks into the sky sees no object. A map with objects needs their table."""
    three_boxes(scene())
    truth = open_run(LABELLED).open("truth/bayer").load()
    truth.attrs["objects"] = []
    monkeypatch.setattr(Item, "truth", lambda self: truth)
    masks._missing.cache_clear()
    for name in ("coco", "panoptic", "boxes3d"):
        with pytest.raises(CatalogError, match="has no table of objects for camera bayer"):
            exported([LABELLED], tmp_path / "out", [name])
    truth["instance"][:] = 0
    masks._missing.cache_clear()
    exported([LABELLED], tmp_path / "out", ["coco", "panoptic", "boxes3d"])
    masks._missing.cache_clear()
    read = lambda name: json.loads((tmp_path / "out" / f"{name}.json").read_text())
    assert read("coco")["annotations"] == [] and len(read("coco")["images"]) == 1
    assert read("panoptic")["annotations"][0]["segments_info"] == []
    assert read("boxes3d")["images"][0]["boxes"] == []


def test_the_frames_of_a_sequence_are_in_their_order_and_state_their_time(
    home, tmp_path, three_boxes, monkeypatch
):
    """Names of runs are digests, so their order is not that of the frames."""
    three_boxes(scene())
    times = {home.plain: 0.1, LABELLED: 0.05}
    monkeypatch.setattr(
        Item, "moment", property(lambda self: {"time_s": times[self.key], "frames_per_s": 20.0})
    )
    truth = open_run(LABELLED).open("truth/bayer").load()
    monkeypatch.setattr(Item, "truth", lambda self: truth)
    masks._missing.cache_clear()
    for order in (sorted(times), sorted(times, reverse=True)):
        times.update(zip(order, (0.05, 0.1)))
        out = tmp_path / order[0]
        exported(["two"], out, ["png", "coco", "panoptic"])
        for name in ("coco", "panoptic"):
            images = json.loads((out / f"{name}.json").read_text())["images"]
            assert [(row["id"], row["run"], row["time_s"]) for row in images] == [
                (1, order[0], 0.05),
                (2, order[1], 0.1),
            ]
            assert images[0]["frames_per_s"] == 20.0
        files = json.loads((out / "manifest.json").read_text())["files"]
        stated = {row["run"]: row["time_s"] for row in files if row["run"]}
        assert stated == times
    masks._missing.cache_clear()


def test_a_picture_without_a_time_states_none(home, tmp_path):
    [still] = select([home.plain]).shots
    [moving] = select([LABELLED]).shots
    assert [Item(1, shot, open_run(shot.path), 3).frame for shot in (still, moving)] == [
        {},
        {"sequence": 3, "time_s": 0.25},
    ]
    exported([home.plain], tmp_path / "out", ["png"])
    files = json.loads((tmp_path / "out" / "manifest.json").read_text())["files"]
    assert all("time_s" not in row and "sequence" not in row for row in files)


def test_boxes_in_metres_with_their_image(home, tmp_path, three_boxes):
    """In closed form, the nearest edges of a box straight ahead bound its image."""
    three_boxes(scene())
    exported([LABELLED], tmp_path / "out", ["boxes3d", "coco"])
    data = json.loads((tmp_path / "out" / "boxes3d.json").read_text())
    [image] = data["images"]
    camera = image["camera_model"]
    # the camera looks along x, so to its right is -y of the world, and down is -z
    assert camera["rotation"] == pytest.approx([0.5, -0.5, 0.5, -0.5])
    assert (camera["cx"], camera["cy"]) == pytest.approx((COLUMNS / 2, ROWS / 2))
    assert [box["name"] for box in image["boxes"]] == ["car 1", "person 2"]
    for box, (length, width, height), x in zip(image["boxes"], SIZES, (10.0, 20.0)):
        assert box["size_m"] == pytest.approx((length, width, height))
        assert box["center_m"] == pytest.approx((x, 0, 0))
        assert box["center_camera_m"] == pytest.approx((0, 0, x))
        assert box["rotation"] == pytest.approx([1, 0, 0, 0])
        near = x - length / 2
        wide, high = (camera["fx"] * side / near for side in (width, height))
        full = [COLUMNS / 2 - wide / 2, ROWS / 2 - high / 2, wide, high]
        assert box["bbox_full"] == pytest.approx(full, rel=1e-9)
        assert box["truncation"] == 0.25 and "sky" in box["illuminance_lx"]
    rows = json.loads((tmp_path / "out" / "coco.json").read_text())["annotations"]
    assert [row["bbox_full"] for row in rows] == [box["bbox_full"] for box in image["boxes"]]


def test_geometry_that_is_not_that_of_the_run_is_refused(home, tmp_path, three_boxes):
    with pytest.raises(CatalogError, match="cannot be made again.*'three_boxes' is not installed"):
        exported([LABELLED], tmp_path / "out", ["boxes3d"])
    three_boxes(scene(moved_m=1e-3))
    with pytest.raises(
        CatalogError, match="'car 1' has another position in the scene of this version"
    ):
        exported([LABELLED], tmp_path / "out", ["boxes3d"])
    [shot] = select([LABELLED]).shots
    assert geometry.full_boxes(Item(1, shot, open_run(shot.path))) == {}


def test_a_box_follows_its_object_through_turns_scales_and_mirrors():
    model = scene().models["car"]
    for factors in ((1, 1, 1), (2, 3, 4), (1, -1, 1)):
        turned = scene(turn_deg=30).objects[0].pose @ np.diag([*factors, 1])
        box = geometry.box_of(model, turned)
        np.testing.assert_allclose(box.size_m, np.multiply(SIZES[0], np.abs(factors)), rtol=1e-12)
        assert np.linalg.det(box.rotation) == pytest.approx(1)
        moved = corners(np.array(SIZES[0])) @ turned[:3, :3].T + turned[:3, 3]
        order = lambda points: sorted(np.round(points, 9).tolist())
        assert order(moved) == order(box.corners_m())


def picture(**attrs):
    """Return a picture of 40 x 30 pixels with a pitch of 1/10 of the focal length."""
    x = 4e-4 * (np.arange(40) - 19.5)
    y = 4e-4 * (np.arange(30) - 14.5)
    values = np.ones((30, 40, 3))
    valid = np.ones((30, 40), bool)
    return make_picture(values, values, valid, x, y, focal_length_mm=4.0, pitch_um=400.0, **attrs)


def test_an_object_beside_the_camera_reaches_the_frame():
    """A wall to the right reaches from 5 m behind to 5 m in front of the camera. Its image begins
    at the tangent of its far end and goes on to the right edge. The part behind the camera adds
    nothing on the left.
    """
    wall = corners(np.array([10.0, 0.0, 2.0])) - [0, 4, 0]
    model = Model("wall", (Part("all", wall, FACES, "grey"),))
    points = geometry.points_in_front(model, np.eye(4), scene().camera)
    left, top, width, height = geometry.box_in_picture(points, picture())
    assert left == pytest.approx(20 + 10 * 4 / 5) and left + width == 40
    assert top == 0 and height == 30, "beside the camera it is as high as the frame"
    behind = geometry.points_in_front(model, np.eye(4), Camera((6, 0, 0), (7, 0, 0)))
    assert len(behind) == 0


def test_a_distorted_picture_has_the_distorted_box():
    from isethdr_core.data.camera_geometry import map_of

    points = np.array([[-1.0, -0.5, 2.0], [0.6, 0.4, 2.0]])
    bent = picture(distortion={"model": "brown_conrady", "k1": -0.02})
    left, top, width, height = geometry.box_in_picture(points, bent)
    u, v = map_of(bent).forward(points[:, 0] / 2, points[:, 1] / 2)
    expected = (20 + 10 * u[0], 15 + 10 * v[0], 10 * np.ptp(u), 10 * np.ptp(v))
    assert (left, top, width, height) == pytest.approx(expected)
    plain = geometry.box_in_picture(points, picture())
    assert width < plain[2] == pytest.approx(8)
    angles = geometry.box_in_picture(points, picture(projection="equidistant"))
    direction = np.arctan2(np.hypot(1, 0.5), 2) / np.hypot(1, 0.5)
    assert angles[0] == pytest.approx(20 - 10 * direction)
    assert geometry.box_in_picture(points + [50, 0, 0], picture()) is None


def test_flow_is_read_as_middlebury_describes_it(home, tmp_path):
    """The test reads the file itself: tag, width, height, then u and v of each pixel."""
    exported([home.labelled], tmp_path / "out", ["flow"])
    [path] = (tmp_path / "out/flow").iterdir()
    content = path.read_bytes()
    assert content[:4] == b"PIEH"
    assert struct.unpack("<ii", content[4:12]) == (COLUMNS, ROWS)
    flow = np.frombuffer(content[12:], "<f4").reshape(ROWS, COLUMNS, 2)
    assert (flow[0] > 1e9).all()
    np.testing.assert_array_equal(flow[4, 5], [1.5, -0.25])
    assert not flow[11].any()
    with pytest.raises(CatalogError, match="has no motion; expected pictures of a sequence"):
        exported([home.plain], tmp_path / "other", ["flow"])

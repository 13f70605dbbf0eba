"""Scores equal those of pycocotools; intervals contain the true value as often as they state."""

from __future__ import annotations

import contextlib
import io
import math
import sys

import numpy as np
import pytest
import xarray as xr
from isethdr_workflows.detectors import bootstrap
from isethdr_workflows.detectors.boxes import Detections
from isethdr_workflows.detectors.classes import CLASSES
from isethdr_workflows.detectors.groups import EVERYTHING, groups
from isethdr_workflows.detectors.matching import THRESHOLDS, Matches, Picture, matches_of
from isethdr_workflows.detectors.objects import TruthObject, nearest_lamp_deg
from isethdr_workflows.detectors.precision import scores_of
from isethdr_workflows.detectors.rows import object_rows, threshold
from isethdr_workflows.detectors.tables import ALL, Answers, Compared, rows_of

from isethdr_core.errors import ConfigError

pytest.importorskip("hotcoco", reason="detections are matched by hotcoco")


@pytest.fixture
def few_draws(monkeypatch):
    """Draw roads 50 times instead of 1000."""
    monkeypatch.setattr(bootstrap, "DRAWS", 50)


def an_object(box, name="car", number=1, **fields) -> TruthObject:
    """Return an object that counts, unless the fields say otherwise."""
    known = {
        "category": name,
        "name": name,
        "distance_m": 20.0,
        "illuminance_lx": 5.0,
        "lamp_near": False,
        "visible_fraction": 1.0,
        "truncation": 0.0,
    }
    return TruthObject(
        instance=number,
        class_name=name,
        box=tuple(float(v) for v in box),
        **(known | fields),
    )


def detections(rows) -> Detections:
    """Return detections of rows (left, top, right, bottom, score, class)."""
    table = np.array([[*row[:5], CLASSES.index(row[5])] for row in rows], float).reshape(-1, 6)
    return Detections(table[:, :4], table[:, 4], table[:, 5].astype(int))


def drawn_pictures(seed: int, count: int, camera: str = "one") -> list[Picture]:
    """Return random pictures with objects, detections of some of them, and false alarms."""
    rng = np.random.default_rng(seed)
    pictures = []
    for number in range(count):
        objects = []
        found = []
        for k in range(rng.integers(0, 7)):
            low = rng.uniform(0, 150, 2)
            box = np.concatenate([low, low + rng.uniform(9, 60, 2)])
            name = CLASSES[rng.integers(3)]
            objects.append(an_object(box, name, k + 1))
            for _ in range(rng.integers(0, 3)):
                moved = box + rng.uniform(-4, 4, 4)
                found.append((*moved, round(rng.random(), 2), name))
        for _ in range(rng.integers(0, 4)):
            low = rng.uniform(0, 150, 2)
            found.append((*low, *(low + 20), rng.random() * 0.8, CLASSES[rng.integers(4)]))
        pictures.append(Picture(number, f"road {number // 2}", camera, objects, detections(found)))
    return pictures


def of_cocoeval(pictures, library, evaluation) -> np.ndarray:
    """Return the 12 statistics of a library for detections of all classes that have an object."""
    kinds = sorted({CLASSES.index(one.class_name) for p in pictures for one in p.objects})
    truth = library()
    rows = [
        {
            "image_id": k,
            "category_id": CLASSES.index(one.class_name) + 1,
            "bbox": [*one.box[:2], one.box[2] - one.box[0], one.box[3] - one.box[1]],
            "area": (one.box[2] - one.box[0]) * (one.box[3] - one.box[1]),
            "iscrowd": 0,
        }
        for k, p in enumerate(pictures, 1)
        for one in p.objects
    ]
    truth.dataset = {
        "images": [{"id": k + 1} for k in range(len(pictures))],
        "categories": [{"id": k + 1, "name": CLASSES[k]} for k in kinds],
        "annotations": [row | {"id": k} for k, row in enumerate(rows, 1)],
    }
    truth.createIndex()
    answers = [
        {
            "image_id": k,
            "category_id": int(kind) + 1,
            "bbox": [b[0], b[1], b[2] - b[0], b[3] - b[1]],
            "score": s,
        }
        for k, p in enumerate(pictures, 1)
        for b, s, kind in zip(p.found.boxes.tolist(), p.found.scores.tolist(), p.found.classes)
        if kind in kinds
    ]
    with contextlib.redirect_stdout(io.StringIO()):
        found = evaluation(truth, truth.loadRes(answers), "bbox")
        found.evaluate()
        found.accumulate()
        found.summarize()
    return np.array(found.stats, float)


@pytest.mark.parametrize("seed", range(3))
def test_scores_equal_those_of_pycocotools(seed):
    """Both sum the same numbers in float64."""
    coco = pytest.importorskip("pycocotools.coco", reason="pycocotools is what is compared with")
    evaluation = pytest.importorskip("pycocotools.cocoeval")
    pictures = drawn_pictures(seed, 30)
    expected = of_cocoeval(pictures, coco.COCO, evaluation.COCOeval)
    compared = Compared({"one": [Answers("one", pictures)]}, CLASSES)
    values = compared.draws("one", EVERYTHING)[ALL]
    ours = [values[name][0] for name in ("mAP", "mAP50", "AR")]
    np.testing.assert_allclose(ours, expected[[0, 1, 8]], rtol=0, atol=1e-12)
    assert 0.05 < expected[0] < 0.95


def test_a_draw_of_roads_is_the_score_of_the_pictures_of_these_roads():
    """The weighted scores of a draw equal the scores of pictures that are repeated as often as
    their roads were drawn.
    """
    pictures = drawn_pictures(5, 12)
    compared = Compared({"one": [Answers("one", pictures)]}, CLASSES)
    values = compared.draws("one", EVERYTHING)
    for draw in (1, 2, 3):
        again = [
            p
            for p in pictures
            for _ in range(int(compared.weights[draw][compared.road_names.index(p.road)]))
        ]
        alone = Compared({"one": [Answers("one", again)]}, CLASSES).draws("one", EVERYTHING)
        for name in (*CLASSES, ALL):
            for score, drawn in values[name].items():
                np.testing.assert_allclose(drawn[draw], alone[name][score][0], atol=0.02)
                # 0.02: detections with equal scores in several pictures may change their order
        np.testing.assert_allclose(values[ALL]["AR"][draw], alone[ALL]["AR"][0], rtol=1e-12)


def test_a_perfect_detector_has_one_and_a_blind_one_nothing(few_draws):
    pictures = drawn_pictures(1, 5)
    perfect = [
        Picture(
            p.scene,
            p.road,
            p.camera,
            p.objects,
            detections([(*o.box, 0.9, o.class_name) for o in p.objects]),
        )
        for p in pictures
    ]
    blind = [Picture(p.scene, p.road, "two", p.objects, detections([])) for p in pictures]
    compared = Compared({"one": [Answers("one", perfect)], "two": [Answers("two", blind)]}, CLASSES)
    rows = rows_of(compared, 0.02)
    for row in rows:
        if row["camera"] == "one":
            assert row["value"] == pytest.approx(1.0), row
        elif row["camera"] == "two":
            assert row["value"] == 0.0, row
    difference = next(row for row in rows if row["camera"] == "two - one")
    assert difference["value"] == pytest.approx(-1.0)


def test_objects_that_are_not_counted_are_neither_missed_nor_false_alarms():
    """A small car is found and a hidden one is missed; the near car alone makes the score."""
    near = an_object((0, 0, 40, 30))
    small = an_object((60, 0, 66, 5), number=2)
    hidden = an_object((100, 0, 140, 30), number=3, visible_fraction=0.1)
    found = [(60, 0, 66, 5, 0.99, "car"), (0, 0, 40, 30, 0.5, "car")]
    picture = Picture(0, "a", "one", [near, small, hidden], detections(found))
    matches = matches_of([picture])["car"]
    ones = np.ones((1, 1))
    scores = scores_of(matches, [picture], ones, np.zeros(1, int), EVERYTHING.member)
    assert scores.average_precision[0] == pytest.approx(1.0)
    assert scores.average_recall[0] == 1.0
    [row] = [r for r in object_rows(Answers("one", [picture]), 0, 0.1) if r["instance"] == 2]
    assert (row["counted"], row["score"]) == (0, 0.99)


def test_groups_part_the_objects_and_their_recalls_make_the_whole(few_draws):
    pictures = drawn_pictures(2, 20)
    compared = Compared({"one": [Answers("one", pictures)]}, CLASSES)
    total = compared.objects("one", ALL, EVERYTHING)
    for table in ("distance", "height", "illuminance", "lamp"):
        parts = [g for g in groups() if g.table == table]
        counts = [compared.objects("one", "car", g) for g in parts]
        recalls = [compared.draws("one", g)["car"]["AR"][0] for g in parts]
        whole = compared.draws("one", EVERYTHING)["car"]["AR"][0]
        mean = sum(n * r for n, r in zip(counts, recalls) if n) / sum(counts)
        assert mean == pytest.approx(whole)
        assert sum(compared.objects("one", ALL, g) for g in parts) == total


def test_a_threshold_leaves_the_false_alarms_that_are_allowed():
    pictures = drawn_pictures(7, 40)
    matches = matches_of(pictures)["car"]
    alarms = matches.matched[0] < 0
    for allowed in (0.0, 0.1, 0.5, 100.0):
        least = threshold(matches, 40, allowed)
        assert (alarms & (matches.scores > least)).sum() <= allowed * 40
    rows = object_rows(Answers("one", pictures), 0, 0.1)
    assert 0 < sum(row["found"] for row in rows) < len(rows)
    assert all(row["score"] > 0 for row in rows if row["found"])


def test_rounding_takes_no_false_alarm_from_those_that_are_allowed():
    """0.29 * 100 is 28.999999999999996 in floating point."""
    scores = np.arange(200.0)[::-1]
    alarms = np.full((len(THRESHOLDS), 200), -1)
    least = threshold(Matches("car", scores, np.zeros(200, int), alarms), 100, 0.29)
    assert (scores > least).sum() == 29


def test_the_error_of_a_bootstrap_is_that_of_a_mean():
    """AR of pictures with one object each is a mean of independent values, so its standard error is
    known. 1000 draws give it to 2.2 %; 10 % are allowed.
    """
    rng = np.random.default_rng(3)
    box = (0, 0, 20, 20)
    pictures = []
    for number in range(60):
        found = [(*box, 0.5, "car")] if rng.random() < 0.4 else []
        picture = Picture(number, f"road {number}", "one", [an_object(box)], detections(found))
        pictures.append(picture)
    compared = Compared({"one": [Answers("one", pictures)]}, ("car",))
    drawn = compared.draws("one", EVERYTHING)["car"]["AR"]
    found = bootstrap.estimate(drawn, 60)
    hits = [float(len(p.found.scores)) for p in pictures]
    assert found.value == pytest.approx(np.mean(hits))
    assert found.error == pytest.approx(np.std(hits, ddof=1) / math.sqrt(60), rel=0.1)
    half = 1.96 * found.error
    assert found.high - found.value == pytest.approx(half, rel=0.15)


def test_copies_of_a_scene_add_no_certainty():
    once = drawn_pictures(4, 16)
    twice = [p for p in once for _ in range(2)]
    errors = [
        bootstrap.estimate(
            Compared({"one": [Answers("one", p)]}, ("car",)).draws("one", EVERYTHING)["car"]["AR"],
            8,
        ).error
        for p in (once, twice)
    ]
    assert errors[0] == pytest.approx(errors[1])


def test_cameras_are_compared_on_the_same_roads(few_draws):
    """Two cameras with the same detections have a difference of 0 in every draw, although the score
    of each is uncertain.
    """
    one = drawn_pictures(6, 10)
    two = [Picture(p.scene, p.road, "two", p.objects, p.found) for p in one]
    rows = rows_of(
        Compared({"one": [Answers("one", one)], "two": [Answers("two", two)]}, CLASSES), 0.1
    )
    first = {
        (r["camera"], r["score"]): r for r in rows if r["table"] == "all" and r["class"] == ALL
    }
    assert first["one", "mAP"]["high"] - first["one", "mAP"]["low"] > 0.05
    assert first["two - one", "mAP"]["low"] == first["two - one", "mAP"]["high"] == 0.0
    told = {r["row"]: r["value"] for r in rows if r["table"] == "roads that tell 0.1"}
    assert math.isnan(told["the same roads"]) and told["other roads"] > 10


def test_detectors_that_differ_widen_the_interval():
    """The bootstrap draws detectors as well as roads, so different detectors widen the interval."""
    alike = [Answers("one", drawn_pictures(8, 20))] * 3
    apart = [Answers("one", drawn_pictures(8, 20)), *alike[1:]]
    blind = [Picture(p.scene, p.road, "one", p.objects, detections([])) for p in alike[0].pictures]
    apart[0] = Answers("one", blind)
    widths = []
    for of_camera in (alike, apart):
        drawn = Compared({"one": of_camera}, CLASSES).draws("one", EVERYTHING)[ALL]["AR"]
        found = bootstrap.estimate(drawn, 10)
        widths.append((found.high - found.low) / found.value)
    assert widths[1] > 2 * widths[0]


def test_the_error_over_detectors_is_that_of_their_mean():
    """Three detectors with scores s, equal on all roads: the standard error of the mean is
    std(s) / sqrt(3), with divisor 2 in the variance. 20000 draws give it to 0.5 %; 2 % are allowed.
    """
    scores = np.array([0.3, 0.5, 0.6])
    draws = 20_000
    picked = bootstrap.picked_detectors(3, draws, 1)
    drawn = bootstrap.over_detectors(np.repeat(scores[:, None], 1 + draws, 1), picked)
    assert drawn[0] == pytest.approx(scores.mean())
    assert drawn[1:].std() == pytest.approx(scores.std(ddof=1) / math.sqrt(3), rel=0.02)


@pytest.mark.parametrize("roads", [1, 2])
def test_fewer_than_three_roads_give_no_interval(roads):
    """The draws of two roads have three outcomes only, so their percentiles are no interval."""
    found = bootstrap.estimate(np.array([0.5, 0.0, 1.0, 0.5] * 10), roads)
    assert found.value == 0.5 and math.isnan(found.low) and math.isnan(found.high)
    assert math.isnan(bootstrap.roads_to_tell(found.error, roads, 0.02))


def test_rows_near_a_lamp_are_not_named_as_those_of_the_study_of_detection():
    """The two studies mean different lamps, so their rows must not have the same name."""
    rows = [group.row for group in groups() if group.table == "lamp"]
    assert rows == [
        "bright pixels within 3 degrees of the box",
        "no bright pixels within 3 degrees of the box",
    ]


def test_objects_on_one_of_many_roads_give_no_interval(few_draws):
    """Draws of ten roads give the single animal always the same recall, which shows nothing."""
    found = detections([[0, 0, 20, 20, 0.9, "car"]])
    deer = an_object((40, 0, 60, 20), "animal", 2)
    pictures = [
        Picture(k, f"road {k}", "one", [an_object((0, 0, 20, 20)), *[deer][k:]], found)
        for k in range(10)
    ]
    other = [Picture(p.scene, p.road, "two", p.objects, p.found) for p in pictures]
    compared = Compared(
        {"one": [Answers("one", pictures)], "two": [Answers("two", other)]}, CLASSES
    )
    rows = {
        (r["table"], r["row"], r["class"], r["camera"], r["score"]): r
        for r in rows_of(compared, 0.1)
    }
    for camera in ("one", "two - one"):
        row = rows["all", "all", "animal", camera, "AR"]
        assert row["value"] == 0 and math.isnan(row["low"]) and math.isnan(row["high"])
        assert row["objects"] == 1
    assert rows["all", "all", "car", "one", "AR"]["low"] == 1.0


def test_the_interval_of_a_share_ends_at_0_and_1_and_that_of_a_difference_does_not():
    """The interval of three roads is widened by sqrt(1.5), so it would end at -0.11 and 1.11."""
    drawn = np.array([0.5, 0.0, 1.0, 0.5] * 10)
    share = bootstrap.estimate(drawn, 3, bootstrap.SHARE)
    assert (share.low, share.high) == (0.0, 1.0)
    assert bootstrap.estimate(drawn, 3).low < -0.1


def test_roads_to_tell_follow_the_formula():
    """If 40 roads give a standard error of 0.1, a difference of 0.2 needs 40 (2.8 / 2)^2 roads."""
    assert bootstrap.roads_to_tell(0.1, 40, 0.2) == math.ceil(40 * (2.801585 / 2) ** 2)
    assert math.isnan(bootstrap.roads_to_tell(0.0, 40, 0.2))


def test_without_hotcoco_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "hotcoco", None)
    with pytest.raises(ConfigError, match=r"isethdr\[detect\]"):
        matches_of(drawn_pictures(0, 3))


def test_the_angle_to_a_lamp_follows_the_projection_of_the_picture():
    """A focal length of 10 mm; a lamp at 65 degrees beside a box that ends at 60 degrees."""
    truth = xr.Dataset(
        coords={"y": [0.0], "x": 1e-2 * np.radians([59.0, 60.0, 65.0])},
        attrs={"focal_length_mm": 10.0, "projection": "equidistant"},
    )
    lamps = np.array([[0, 2]])
    assert nearest_lamp_deg(truth, lamps, (0, 0, 2, 1)) == pytest.approx(5, abs=1e-6)
    del truth.attrs["projection"]
    tangents = np.degrees(np.arctan(np.radians([60.0, 65.0])))
    apart = tangents[1] - tangents[0]
    assert nearest_lamp_deg(truth, lamps, (0, 0, 2, 1)) == pytest.approx(apart, abs=1e-6)

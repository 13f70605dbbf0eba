"""Intervals over roads contain the true mean as often as they state; tables count every object
once.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from isethdr_workflows.dataset.generate import Generated
from isethdr_workflows.dataset.record import Definition
from isethdr_workflows.dataset.study.cameras import Imaged, Shot
from isethdr_workflows.dataset.study.files import csv_text, summary_rows
from isethdr_workflows.dataset.study.intervals import mean_over_roads
from isethdr_workflows.dataset.study.markdown import markdown_page
from isethdr_workflows.dataset.study.tables import tables_of
from scipy.stats import t


def test_one_value_a_road_is_the_ordinary_student_interval():
    values = np.array([0.2, 0.5, 0.9, 0.4, 0.7])
    found = mean_over_roads(values, range(5))
    half = t.ppf(0.975, 4) * values.std(ddof=1) / np.sqrt(5)
    assert (found.value, found.count, found.roads) == (pytest.approx(0.54), 5, 5)
    assert (found.low, found.high) == pytest.approx((0.54 - half, 0.54 + half))


def test_copies_of_a_scene_add_no_certainty():
    """Ten equal scenes of a road give the same interval as one scene."""
    values = np.array([0.2, 0.5, 0.9, 0.4])
    one = mean_over_roads(values, range(4))
    ten = mean_over_roads(np.repeat(values, 10), np.repeat(np.arange(4), 10))
    assert (ten.low, ten.high) == pytest.approx((one.low, one.high))


def test_the_interval_holds_the_mean_in_95_of_100_cases():
    """Roads have 1 to 6 scenes. Levels vary as much from road to road as from scene to scene. The
    limits of 0.92 and 0.98 allow for the standard error of 500 cases, 1 %, and for a ratio of two
    sums that is not quite normal with ten roads. An interval that ignores roads contains the mean
    in fewer than 0.85 of the cases.
    """
    random = np.random.default_rng(4)
    inside = np.zeros(2)
    for _ in range(500):
        roads = np.repeat(np.arange(10), random.integers(1, 7, 10))
        values = random.normal(size=10)[roads] + random.normal(size=len(roads))
        for k, clusters in enumerate((roads, np.arange(len(roads)))):
            found = mean_over_roads(values, clusters)
            inside[k] += found.low <= 0 <= found.high
    assert 0.92 < inside[0] / 500 < 0.98
    assert inside[1] / 500 < 0.85


def test_without_values_or_with_one_road_nothing_is_claimed():
    nothing = mean_over_roads([math.nan], ["a"])
    assert math.isnan(nothing.value) and nothing.count == 0
    one = mean_over_roads([0.5, 0.7], ["a", "a"])
    assert one.value == pytest.approx(0.6) and math.isnan(one.low)
    cut = mean_over_roads([1.0, 1.0, 0.1], range(3), (0.0, 1.0))
    assert cut.low == 0.0 and cut.high == 1.0


def shot(number, values, lux=5.0):
    """Return a scene with a car and a tree, and its contrast detection `values` in two cameras."""
    rows = (
        {"instance": 1, "name": "car", "category": "car", "distance_m": 20.0},
        {"instance": 2, "name": "tree", "category": "tree", "distance_m": 20.0},
    )
    lit = {"illuminance_lx": {"sky": lux, "headlights": 1.0}}
    scores = [
        {"camera": camera, "metric": "contrast_detection", "object": name, "value": v, "unit": ""}
        for camera, v in zip(("one", "two"), values, strict=True)
        for name in ("", "car", "tree")
    ]
    weights = {"sky": 1.0, "headlights": 2.0}
    return Shot(number, f"road {number}", "k", tuple(scores), tuple(r | lit for r in rows), weights)


def test_tables_count_each_thing_once_and_name_empty_classes():
    shots = (shot(0, (0.2, 0.4)), shot(1, (0.4, 0.8), lux=500.0))
    tables = tables_of(Imaged(shots, ()))
    assert tables.cameras == ["one", "two"]
    by_class = {row.name: row for row in tables.objects["class"]}
    assert by_class["car"].objects == 2 and by_class["bus"].objects == 0
    assert "tree" not in by_class  # trees are not counted
    assert [m.value for m in by_class["car"].means] == pytest.approx([0.3, 0.6])
    lux = {row.name: row.objects for row in tables.objects["illuminance"]}
    # 5 + 2 and 500 + 2 lx under the weights of the lighting
    assert lux["1 to 10 lx"] == lux["100 to 1000 lx"] == 1 and sum(lux.values()) == 2
    [frame] = tables.frame
    assert frame.differences[0].value == pytest.approx(0.3)
    half = t.ppf(0.975, 1) * np.std([0.2, 0.4], ddof=1) / np.sqrt(2)
    assert frame.differences[0].high - frame.differences[0].value == pytest.approx(half)
    rows = summary_rows(tables)
    assert csv_text(["a"], rows).count("\n") == 1 + len(rows)
    assert ",nan" not in csv_text(["a"], rows)


def test_luminances_have_geometric_means_and_ratios():
    """Two scenes have 1 and 100 cd/m2 in one camera, and twice as much in the other. The factor
    between the cameras has an interval of zero width.
    """
    shots = [
        Shot(
            number,
            f"road {number}",
            "k",
            tuple(
                {"camera": c, "metric": "top", "object": "", "value": f * level, "unit": "cd m-2"}
                for c, f in (("one", 1), ("two", 2))
            ),
            (),
            {},
        )
        for number, level in enumerate((1.0, 100.0))
    ]
    [row] = tables_of(Imaged(tuple(shots), ())).frame
    assert [m.value for m in row.means] == pytest.approx([10.0, 20.0])
    assert [row.differences[0].low, row.differences[0].high] == pytest.approx([2.0, 2.0])


def test_objects_without_illuminance_have_a_row_of_their_own():
    bare = shot(0, (0.2, 0.4))
    rows = tuple({k: v for k, v in row.items() if k != "illuminance_lx"} for row in bare.objects)
    tables = tables_of(Imaged((Shot(0, "r", "k", bare.scores, rows, bare.weights),), ()))
    assert tables.objects["illuminance"][-1].name == "not known"


def test_the_page_in_markdown_names_its_commands_and_has_a_row_for_each_class_that_was_seen():
    imaged = Imaged((shot(0, (0.2, 0.4)), shot(1, (0.4, 0.8))), ())
    definition = Definition("night", 3, 2, "roads", "", ("renderer.width=64",), {}, "")
    text = markdown_page(Generated(definition, {}), imaged, tables_of(imaged), ["lens=ideal"])
    commands = text.replace("\n", " ")
    assert (
        "isethdr dataset generate night recipe=roads count=2 seed=3 renderer.width=64" in commands
    )
    assert "isethdr dataset score night lens=ideal" in commands
    assert "| car | 2 | 0.3 (0 to 1) | 0.6 (0 to 1) |" in text and "| bus |" not in text
    # the difference of 0.2 and 0.4 has the half width 12.706 * 0.1
    assert "| 0.3 (-0.971 to 1.57) |" in text

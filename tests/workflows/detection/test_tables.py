"""Tables, curves and the number of roads follow their closed forms; the page needs no network."""

from __future__ import annotations

import csv
import math
from dataclasses import replace

import numpy as np
import pytest
from isethdr_workflows.dataset.record import folder_of
from isethdr_workflows.dataset.study.intervals import Mean
from isethdr_workflows.detection.observer.observing import Check, Observer
from isethdr_workflows.detection.questions import BUNDLED, QUESTIONS, question_of
from isethdr_workflows.detection.results.checks import overstated, too_many
from isethdr_workflows.detection.results.csv_tables import means_csv, objects_csv
from isethdr_workflows.detection.results.levels import at_levels, crossing
from isethdr_workflows.detection.results.markdown import markdown
from isethdr_workflows.detection.results.number_text import d_text, roads_text, share_text
from isethdr_workflows.detection.results.page import page
from isethdr_workflows.detection.results.recall import SoughtObject, recalls
from isethdr_workflows.detection.results.recall_picture import bins_of, draw_recalls
from isethdr_workflows.detection.results.shares import (
    Found,
    compared_with,
    geometric,
    lines,
    roads_needed,
)
from isethdr_workflows.detection.results.study_results import CurvePoint, Results
from isethdr_workflows.detection.results.summary import summary
from scipy.stats import norm

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.presets import presets


def found(scene, camera, value, **more) -> Found:
    fields = {
        "scene": scene,
        "road": f"road {scene}",
        "camera": camera,
        "condition": "night",
        "level": 1.0,
        "instance": 1,
        "name": "person 1",
        "kind": "person",
        "distance_m": 40.0,
        "height_px": 30.0,
        "illuminance_lx": 2.0,
        "near_lamp": False,
        "d": 4.0,
        "noise_only": 9.0,
        "found": value,
        "found_noise_only": 1.0,
        "transfer": 0.8,
    }
    return Found(**fields | more)


def rows(one, two):
    return [found(k, c, v) for c, values in (("a", one), ("b", two)) for k, v in enumerate(values)]


def results(cells) -> Results:
    return Results(
        dataset="drawn",
        question="",
        asked=QUESTIONS[""],
        how=Observer(),
        cameras=("a", "b"),
        overrides=("lens=ideal",),
        rows=tuple(cells),
        checks={"a": Check(9, 10, 8.5, 1, 1, 20)},
    )


def test_roads_needed_for_a_difference_follow_the_variance_over_roads():
    """With one object per road, the number is (1.96 + 0.84)^2 variance / difference^2. For paired
    cameras the variance is that of their difference, otherwise the sum of both variances.
    """
    one = np.array([0.1, 0.5, 0.9, 0.3, 0.7])
    two = one + np.array([0.02, 0.05, 0.01, 0.03, 0.04])
    [needed] = roads_needed(rows(one, two), told=0.02)
    factor = (norm.ppf(0.975) + norm.ppf(0.8)) ** 2 / 0.02**2
    assert needed.paired == pytest.approx(factor * np.var(two - one, ddof=1))
    both = np.var(one, ddof=1) + np.var(two, ddof=1)
    assert needed.unpaired == pytest.approx(factor * both)


def test_fewer_than_three_roads_have_no_interval():
    two = lines(rows([0.2, 0.6], [0.3, 0.5]))[0]
    assert two.means[0].value == pytest.approx(0.4) and math.isnan(two.means[0].low)
    assert math.isnan(two.differences[0].low)
    three = lines(rows([0.2, 0.6, 0.4], [0.3, 0.5, 0.4]))[0]
    assert math.isfinite(three.means[0].low) and math.isfinite(three.differences[0].low)
    assert math.isnan(roads_needed(rows([0.2, 0.6], [0.3, 0.5]))[0].paired)


def test_every_object_is_in_one_row_of_each_table():
    cells = rows([0.2, 0.6, 0.4], [0.3, 0.5, 0.4])
    cells += [
        found(1, c, 0.9, instance=2, kind="car", distance_m=9.0, near_lamp=True) for c in "ab"
    ]
    cells += [found(1, c, math.nan, instance=3, d=math.nan) for c in "ab"]
    counts: dict[str, int] = {}
    for line in lines(cells):
        counts[line.table] = counts.get(line.table, 0) + line.objects
    assert set(counts.values()) == {4}


def test_a_group_that_one_camera_does_not_show_keeps_the_columns_of_all():
    """Pixels of one camera are larger, so the same person is in another class of height."""
    cells = [found(1, "a", 0.9, height_px=20.0), found(1, "b", 0.3, height_px=14.0)]
    tables = {(line.table, line.name): line for line in lines(cells)}
    small = tables["height", "below 16 px"]
    large = tables["height", "16 to 32 px"]
    assert math.isnan(small.means[0].value) and small.means[1].value == 0.3
    assert large.means[0].value == 0.9 and math.isnan(large.means[1].value)
    assert len(small.differences) == len(large.differences) == 1
    only_a = results(cells[:1])
    assert len(lines(only_a.rows, only_a.cameras)[0].means) == 2
    sheet = csv.DictReader(means_csv(results(cells), list(tables.values())).splitlines())
    assert {r["camera"]: r["found"] for r in sheet if r["row"] == "below 16 px"} == {
        "a": "",
        "b": "0.3",
    }


def test_a_level_without_any_value_is_no_side_of_a_crossing():
    levels = [0.01, 0.1, 1.0]
    roads = [f"road {k}" for k in range(9)]
    assert math.isnan(crossing(levels, np.array([[math.nan, 0.9, 1.0]] * 9), roads, 0.5).level)
    assert math.isnan(crossing(levels, np.array([[-0.2, -0.1, math.nan]] * 9), roads, 0.0).level)


def test_the_interval_of_a_crossing_is_as_wide_with_few_roads():
    """Four roads whose means cross at different places: the standard error of their mean has the
    divisor 3. Four roads give few different samples, so 10 % are allowed.
    """
    levels = [1e-3, 10.0]
    shifts = np.array([-0.3, -0.1, 0.1, 0.3])
    values = np.array([0.5 + 0.25 * (np.log10(levels) + 1 + s) for s in shifts])
    found_at = crossing(levels, values, list("abcd"), 0.5)
    width = np.log10(found_at.high / found_at.low)
    assert width == pytest.approx(2 * 1.96 * shifts.std(ddof=1) / 2, rel=0.1)


def test_a_crossing_is_where_the_mean_crosses_and_its_interval_holds_it():
    """The share of objects found is a ramp over the logarithm of the illuminance. It crosses 0.5
    near 0.1 lux, at a different place on each road.
    """
    levels = [0.01, 0.1, 1.0]
    shifts = np.linspace(-0.4, 0.4, 9)
    values = np.array([0.5 + 0.5 * (np.log10(levels) + 1 + s) for s in shifts])
    roads = [f"road {k}" for k in range(9)]
    middle = crossing(levels, values, roads, 0.5)
    assert middle.level == pytest.approx(0.1)
    # the standard error of the mean shift is std / 3, in decades
    half = 1.96 * shifts.std() / 3
    assert np.log10(middle.high) + 1 == pytest.approx(half, rel=0.2)
    assert np.log10(middle.low) + 1 == pytest.approx(-half, rel=0.2)
    assert math.isnan(crossing(levels, values, ["one"] * 9, 0.5).low)
    assert math.isnan(crossing(levels, values + 5, roads, 0.5).level)


def test_values_between_levels_are_linear_in_the_logarithm():
    known = [(1.0, 0.2), (0.01, 0.0)]
    assert at_levels(known, [0.1, 1.0]) == pytest.approx([0.1, 0.2])
    assert np.isnan(at_levels(known, [2.0, 0.001])).all()


def test_the_page_and_the_tables_name_everything():
    cells = results(rows([0.2, 0.6, 0.4], [0.3, 0.5, 0.4]))
    tables = lines(cells.rows)
    text = page(cells, tables)
    assert "src=" not in text and "<script" not in text and "no interval" not in text
    assert "lens=ideal" in text and "noise alone" in text.lower()
    assert "| class: person | 3 | 0.400 (" in markdown(cells, tables)
    sheet = list(csv.reader(means_csv(cells, tables).splitlines()))
    assert len({len(line) for line in sheet}) == 1 and len(sheet) == 1 + 2 * len(tables)
    # all have a d' of 9 against noise alone and a transfer accuracy of 0.8; no detector was scored
    row = "| person | b | 9 (9 to 9) | 0.800 (0.800 to 0.800) |"
    assert row in markdown(cells, tables) and "recall" not in markdown(cells, tables)
    assert len(objects_csv(cells.rows).splitlines()) == 7
    told = [replace(row, told_apart=0.5 + row.found / 2) for row in cells.rows]
    counted = markdown(results(told), tables).partition("Counted:")[2]
    # half of the differences of the shares found: -0.1, 0.1, 0
    assert "| all: all objects | 3 | 0.700 (" in counted and "| 0.000 (" in counted
    assert "told apart: class,person,a,3" in means_csv(results(told), tables)
    two = results(rows([0.2, 0.6], [0.3, 0.5]))
    assert "2 roads give no interval" in page(two, lines(two.rows)).replace("\n", " ")


def test_the_rows_of_the_command_hold_both_measures_with_their_intervals():
    told = [
        replace(row, told_apart=0.5 + row.found / 2) for row in rows([0.2, 0.6, 0.4], [0.4] * 3)
    ]
    of = {(row["table"], row["camera"]): row for row in summary(results(told))}
    one, two = (of["light and distance", camera] for camera in "ab")
    assert one["row"] == "night, 30 to 60 m" and one["found"] == pytest.approx(0.4)
    assert one["told_apart"] == pytest.approx(0.7) and math.isnan(one["told_apart_less_first"])
    # differences of 0.1, -0.1, 0: Student's 4.303 times 0.1 over the square root of 3
    assert two["told_apart_less_first"] == pytest.approx(0.0)
    assert two["told_apart_less_first_high"] == pytest.approx(4.303 * 0.1 / 3**0.5, rel=1e-3)


def test_a_curve_is_drawn_with_its_crossing():
    asked = replace(QUESTIONS["dark"], levels=(0.1, 1.0))
    points = [CurvePoint(c, x, x / 2, 0.0, x, 3, 3) for c in "ab" for x in (0.1, 1.0)]
    both = crossing((0.1, 1.0), np.array([[0.2, 0.8]] * 3), ["1", "2", "3"], 0.5)
    cells = replace(results([]), asked=asked, curve=tuple(points), crossings={"a": both})
    cells = replace(cells, counted_curve=tuple(replace(one, found=0.9) for one in points))
    assert "polyline" in page(cells, []) and "0.316 (0.316 to 0.316)" in page(cells, [])
    assert "| 0.1 | 3 | 0.050 (0.000 to 0.100) |" in markdown(cells, [])
    assert "crossing,level,a,,,0.3162" in means_csv(cells, [])
    assert "| 0.1 | 3 | 0.900 (" in markdown(cells, []).partition("Counted:")[2]
    assert "told apart,0.1,b,3,3,0.9" in means_csv(cells, [])


def test_curves_of_many_cameras_stand_below_each_other():
    """A row has at most 105 columns of text if names have 25 letters."""
    asked = replace(QUESTIONS["dark"], levels=(0.1, 1.0, 3.0))
    names = [f"typical_split_pixel_{k}_bit" for k in range(16)]
    objects = {0.1: 3, 1.0: 3, 3.0: 2}  # the highest level that most objects reach is 1 lux
    points = [
        CurvePoint(name, x, 0.5, 0.25, 0.75, count, 3, 0.125, 0.0, 0.25)
        for name in names
        for x, count in objects.items()
    ]
    cells = replace(results([]), asked=asked, cameras=tuple(names), curve=tuple(points))
    both = {names[0]: crossing((0.1, 1.0), np.array([[0.2, 0.8]] * 3), ["1", "2", "3"], 0.5)}
    cells = replace(cells, counted_curve=tuple(points), crossings=both, counted_crossings=both)
    text = markdown(cells, [])
    row = (
        f"| {names[0]} | 0.316 (0.316 to 0.316) | 0.316 (0.316 to 0.316) | 0.125 (0.000 to 0.250) |"
    )
    assert row in text and "told apart at 1 lux, less" in text
    assert f"| {names[1]} | 3 | 2 | 0.500 (0.250 to 0.750) | 0.500 (0.250 to 0.750) |" in text
    assert max(len(line) for line in text.splitlines() if line.startswith("| typ")) <= 105


def test_the_question_of_darkness_asks_all_bundled_sensors():
    """The sensors of the main job have short names."""
    short = {f"typical_{name}" for name in ("bayer", "split_pixel", "rgbw")}
    own = [name for name in presets("sensor") if not name.startswith("acme")]
    assert set(BUNDLED) == {
        name.removeprefix("typical_") if name in short else name for name in own
    }


def test_questions_are_told_apart():
    with pytest.raises(ConfigError, match="no question 'capture'.*captures.*type for example"):
        question_of("capture")


def test_detectors_are_compared_for_the_objects_that_both_know(tmp_path):
    cells = rows([0.2, 0.6, 0.4], [0.3, 0.5, 0.4])
    cells = [replace(row, d=10 * row.found) for row in cells]
    path = tmp_path / "detector_objects.csv"
    assert recalls(path, cells) == []
    head = "scene,road,instance,camera,detector,counted,found,score"
    lines_of = ["0,r,1,a,small,1,0,0.1", "1,r,1,a,small,1,1,0.9", "2,r,1,a,small,1,1,0.5"]
    others = ["0,r,9,a,small,1,1,0.9", "0,r,1,b,small,0,1,0.9"]  # unknown; not counted
    path.write_text("\n".join([head, *lines_of, *others]))
    whole, person = recalls(path, cells)
    assert (whole.kind, person.kind, whole.objects) == ("all", "person", 3)
    assert whole.detector_found.value == pytest.approx(2 / 3)
    assert whole.observer_found.value == pytest.approx(0.4)
    assert whole.rank == pytest.approx(1.0)


def test_recall_is_drawn_in_bins_of_equally_many_objects(tmp_path):
    """Objects in any order: the bins are of increasing d', and their recall is the mean in each."""
    shares = [0.9, 0.1, 0.5, 0.2, 0.8, 0.6]
    members = [
        SoughtObject("small", "a", found(k, "a", share, d=10 * share), float(share > 0.55), share)
        for k, share in enumerate(shares)
    ]
    bins = bins_of(members, 2)
    assert [one.objects for one in bins] == [3, 3]
    assert [one.observer.value for one in bins] == pytest.approx([0.8 / 3, 2.3 / 3])
    assert [one.detector.value for one in bins] == [0.0, 1.0]
    assert [one.objects for one in bins_of(members[:2])] == [1, 1]
    path = tmp_path / "recall.png"
    draw_recalls(members, path)
    assert path.read_bytes().startswith(b"\x89PNG")


def test_detectors_stand_in_the_table_of_the_objects(tmp_path, monkeypatch):
    """The recall of camera a is 2/3; its interval over three roads is Student's, cut to 0..1."""
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    cells = results([replace(row, d=1.0) for row in rows([0.2, 0.6, 0.4], [0.3, 0.5, 0.4])])
    head = "scene,road,instance,camera,detector,counted,found,score"
    lines_of = [f"{k},r,1,a,small,1,{int(k > 0)},0.1" for k in range(3)]
    path = folder_of(cells.dataset) / "detector_objects.csv"
    path.parent.mkdir(parents=True)
    path.write_text("\n".join([head, *lines_of]))
    text = markdown(cells, lines(cells.rows))
    assert "| contrast transfer | recall of detector small |" in text
    assert (
        "| all objects | a | 9 (9 to 9) | 0.800 (0.800 to 0.800) | 0.667 (0.000 to 1.000) |" in text
    )
    assert "| all objects | b | 9 (9 to 9) | 0.800 (0.800 to 0.800) | – |" in text


def test_a_geometric_mean_of_d_has_the_interval_of_its_logarithm():
    values = [0.0, 1.0, 100.0]  # 0 counts as 0.01
    cells = [found(k, "a", 0.5, noise_only=value) for k, value in enumerate(values)]
    mean = geometric(cells)
    assert mean.value == pytest.approx(1.0)
    # logarithms of -2, 0, 2 decades: Student's 4.303 times 2 over the square root of 3
    assert math.log10(mean.high) == pytest.approx(4.303 * 2 / 3**0.5, rel=1e-3)
    assert d_text(replace(mean, low=0.5, high=1206.4)) == "1 (0.5 to 1206)"


def test_shares_are_shown_in_thousandths_and_roads_in_whole_numbers():
    assert share_text(Mean(-3.8e-15, -2e-14, 1e-14, 7, 3)) == "0.000 (0.000 to 0.000)"
    assert share_text(Mean(0.7868, 0.516, 1.0, 36, 3)) == "0.787 (0.516 to 1.000)"
    assert share_text(Mean(0.5, math.nan, math.nan, 3, 1)) == "0.500"
    assert roads_text(7.4e-4) == "3 or fewer"
    assert roads_text(37.1) == "38"


def test_a_page_warns_where_far_more_places_pass_than_the_threshold_is_for():
    assert too_many(Check(places=100, false_alarms=25))
    assert not too_many(Check(places=100, false_alarms=9))
    assert overstated(Check(hits=80, trials=100, expected=86.0))
    assert not overstated(Check(hits=80, trials=100, expected=84.0))


def test_a_second_form_of_a_camera_is_compared_with_the_camera_itself():
    cameras = ["bayer", "rgbw", "rgbw, twice the render noise"]
    assert [compared_with(name, cameras) for name in cameras] == ["bayer", "bayer", "rgbw"]

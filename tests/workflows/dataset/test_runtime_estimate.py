"""The runtime estimate is exact for equal scenes, and its interval contains the true total."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_workflows.dataset.actions import print_runtime_estimate, request_of
from isethdr_workflows.dataset.record import SceneRecord
from isethdr_workflows.dataset.runtime_estimate import runtime_estimate
from isethdr_workflows.dataset.summary import (
    DECADES,
    by_decade,
    class_counts,
    duplicates,
    far,
    thumbnail,
)


def records(seconds):
    """Return records of scenes that took `seconds`, and half as much processor time."""
    return [
        SceneRecord(number, "plain", f"plain-{number}", (), ("a",), s, s / 2, 1000)
        for number, s in enumerate(seconds)
    ]


def test_equal_scenes_take_their_number_times_one():
    expected = runtime_estimate(records([30.0] * 6), 60)
    assert (expected.seconds.value, expected.seconds.low, expected.seconds.high) == (1800.0,) * 3
    assert expected.stored_bytes.value == 60_000
    assert expected.cpu_seconds.value == 900.0


def test_processor_time_needs_a_record_of_each_scene():
    """Records of earlier versions have no processor time."""
    older = SceneRecord(6, "plain", "plain-6", (), ("a",), 30.0, stored_bytes=1000)
    assert runtime_estimate([*records([30.0] * 6), older], 60).cpu_seconds is None


def test_scenes_at_the_same_time_share_the_time_of_the_machine():
    pairs = [replace(record, at_once=2) for record in records([30.0] * 6)]
    assert runtime_estimate(pairs, 60).seconds.value == 900.0
    assert runtime_estimate(pairs, 60).cpu_seconds.value == 900.0  # not shared


def test_nothing_is_left_of_a_dataset_that_is_made():
    expected = runtime_estimate(records([10.0, 30.0, 20.0]), 3)
    assert (expected.seconds.low, expected.seconds.value, expected.seconds.high) == (60.0,) * 3


def test_an_estimate_for_fewer_scenes_than_are_made_counts_these_alone():
    expected = runtime_estimate(records([10.0, 30.0, 20.0, 40.0]), 2)
    assert (expected.seconds.value, expected.sample) == (40.0, 2)


def test_the_interval_holds_the_total_in_95_of_100_cases():
    """Run times are normally distributed, so Student's interval is exact. 500 cases have a standard
    error of 1 %; 0.92 to 0.98 is three of them.
    """
    random = np.random.default_rng(1)
    inside = 0
    for _ in range(500):
        seconds = random.normal(100.0, 15.0, 60)
        expected = runtime_estimate(records(seconds[:6]), 60).seconds
        inside += expected.low <= seconds.sum() <= expected.high
    assert 0.92 < inside / 500 < 0.98


def test_thumbnails_keep_the_light():
    xyz = np.random.default_rng(0).random((360, 640, 3))
    small = thumbnail(xyz)
    assert small.shape == (120, 213, 3)
    assert small.mean() == pytest.approx(xyz[:, :639].mean(), rel=1e-12)


def test_every_lit_tile_is_in_a_decade():
    luminance = np.array([[0.0, 1e-9, 2e-6], [0.5, 5.0, 3e9]])
    counts = dict(zip(DECADES[:-1], by_decade(luminance)))
    assert counts == {d: {-6.0: 2, -1.0: 1, 0.0: 1, 6.0: 1}.get(d, 0) for d in DECADES[:-1]}


def test_a_scene_far_from_the_others_is_named_and_equal_ones_are_not():
    assert far([10.0, 11.0, 9.0, 10.5, 100.0, 9.5]) == [4]
    assert far([10.0, 11.0, 9.0, 10.5, 12.0, 9.5]) == []
    assert far([10.0] * 6) == []
    assert far([1.0, 100.0]) == []


def test_objects_are_counted_by_the_illuminance_under_each_lighting():
    """One table of objects is used by night (headlights alone) and by day. A third scene states no
    illuminance.
    """
    car = {"category": "car", "box": [0, 0, 4, 20], "distance_m": 40.0}
    lit = car | {"illuminance_lx": {"sky": 2000.0, "headlights": 5.0}}
    scenes = [SceneRecord(k, "f", "r", (), ("a",), objects=(lit,)) for k in (0, 1)]
    scenes.append(SceneRecord(2, "f", "r", (), ("a",), objects=(car,)))
    night = {"sky": 1e-5, "headlights": 1.0}
    day = {"sky": 1.0, "headlights": 0.0}
    [row] = class_counts(scenes, {0: night, 1: day, 2: night})
    assert (row.objects, row.by_lux) == (3, (0, 0, 1, 0, 0, 1))
    assert class_counts(scenes)[0].by_lux == (0,) * 6


def test_the_cameras_own_car_is_no_object():
    """Its lamps may be in the picture and in the map of objects, but are not to be detected."""
    rows = [
        {"category": name, "box": [0, 0, 4, 20], "distance_m": 2.0, "visible_fraction": 1.0}
        for name in ("car", "own vehicle", "road", "deer")
    ]
    [scene] = [SceneRecord(0, "f", "r", (), ("a",), objects=tuple(rows))]
    assert [row.category for row in class_counts([scene])] == ["car", "deer"]


def test_scenes_with_the_same_radiance_are_duplicates():
    assert duplicates(records([1.0, 2.0, 3.0])) == [[0, 1, 2]]


def test_without_scenes_the_command_that_renders_a_sample_is_shown_as_it_was_typed(capsys):
    settings = ["recipe=streets", "count=60", "~flare.dirt", "sample=1"]
    request = request_of("mine", settings)
    print_runtime_estimate(None, settings, request, None)
    expected = "isethdr dataset generate mine recipe=streets count=60 '~flare.dirt' sample=6\n"
    assert capsys.readouterr().out.endswith(expected)

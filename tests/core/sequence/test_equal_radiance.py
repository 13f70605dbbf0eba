"""Radiance that is stored for another frame serves a frame with equal light."""

from dataclasses import replace

import pytest

from isethdr_core.sequence.equal_radiance import note, noted, remove_stale_notes

from .counting import LABELLED, Counting, frame, levels
from .waiting import Waiting


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    Counting.calls.clear()


def test_a_frame_in_which_nothing_has_changed_is_not_rendered():
    first, ids = frame(Waiting(0.25))
    again, same = frame(Waiting(0.75))
    assert len(Counting.calls) == 1 and ids == same
    assert first.identical(again.assign_attrs(first.attrs))
    frame(Waiting(0.75))
    assert len(Counting.calls) == 1


def test_states_of_a_lamp_that_blinks_are_rendered_once_each():
    for time_s in (0.5, 1.5):
        frame(Waiting(time_s))
    assert len(Counting.calls) == 2
    assert levels(frame(Waiting(0.75))[0])["blinker"] == 41.0
    assert levels(frame(Waiting(1.75))[0])["blinker"] == 61.0
    assert len(Counting.calls) == 2


def test_a_store_with_a_part_of_the_light_groups_does_not_serve_beside_own_ones():
    frame(Waiting(0.25), replace(LABELLED, groups=("sky",)))
    light, ids = frame(Waiting(0.75))
    assert set(levels(light)) == {"sky", "steady", "blinker"} and len(ids) == 1
    assert set(Counting.calls[1]) == {"sky", "steady", "blinker"}
    frame(Waiting(0.5))
    assert len(Counting.calls) == 2


@pytest.mark.slow
def test_a_frame_in_which_something_moves_is_rendered_anew():
    frame(Waiting(2.5))
    light, _ = frame(Waiting(3.0))
    assert len(Counting.calls) == 2 and set(Counting.calls[0]) == set(Counting.calls[1])
    assert float(light.distance.max()) == 1.0


@pytest.mark.slow
def test_less_effort_or_another_renderer_does_not_serve():
    frame(Waiting(0.1))
    frame(Waiting(0.2), samples=8)
    frame(Waiting(0.3), step=2)
    assert len(Counting.calls) == 3
    frame(Waiting(0.4))
    assert len(Counting.calls) == 3


@pytest.mark.slow
def test_a_store_that_has_been_removed_is_rendered_anew(tmp_path):
    _, [name] = frame(Waiting(0.25))
    frame(Waiting(0.75))
    (tmp_path / "scenes" / f"{name}.zarr").rename(tmp_path / "gone.zarr")
    frame(Waiting(0.75))
    assert len(Counting.calls) == 2


def test_a_note_goes_with_the_last_store_that_it_names(tmp_path):
    for name in ("one", "two"):
        (tmp_path / f"{name}-1.zarr").mkdir()
    note(tmp_path, "mine", ["one", "two"])
    (tmp_path / "one-1.zarr").rmdir()
    assert remove_stale_notes(tmp_path) == 0 and noted(tmp_path, "mine") == ["one", "two"]
    (tmp_path / "two-1.zarr").rmdir()
    assert remove_stale_notes(tmp_path) == 1 and not list(tmp_path.iterdir())

"""Light groups whose light does not change are copied from the store of another frame."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from isethdr_core.demand import NoiseLimit
from isethdr_core.scene import Lamp, Model, Part, SceneDescription, flat
from isethdr_core.sequence.equal_content import contents_of
from isethdr_core.sequence.equal_groups import LimitBeside, TooNoisy
from isethdr_core.store import open_scene, read_attrs

from .counting import Counting, levels
from .counting import frame as frame_or_shot
from .test_equal_content import CHANGES, with_lamp_changed
from .waiting import AXIS, FACES, SQUARE, Waiting

OFF_AND_ON = (0.5, 1.5)  # times at which the blinker is off and on, s


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    Counting.calls.clear()


@dataclass(frozen=True)
class Changed:
    """The scene `Waiting` with the blinker on and one more change, `CHANGES[change]`."""

    change: int

    def __call__(self) -> SceneDescription:
        return CHANGES[self.change](Waiting(1.5)())


def frame(scene, **settings):
    """Return radiance and store names of a frame of a sequence."""
    return frame_or_shot(scene, exposures={}, **settings)


def attributes(home, name):
    return read_attrs(home / "scenes" / f"{name}.zarr")


def test_only_the_group_of_the_lamp_that_changes_is_rendered(tmp_path):
    (off, [first]), (on, [second]) = (frame(Waiting(t)) for t in OFF_AND_ON)
    assert Counting.calls[1:] == [("blinker",)]
    assert levels(on) == {**levels(off), "blinker": levels(off)["blinker"] + 20.0}
    for name in ("radiance", "xyz_noise"):
        for group in ("sky", "steady"):
            planes = [light[name].sel(light_group=group).values for light in (off, on)]
            np.testing.assert_array_equal(*planes)
    stated = attributes(tmp_path, second)
    assert stated["groups_from"] == {"sky": first, "steady": first}
    assert set(stated["groups"]) == set(stated["noise"]) == {"sky", "steady", "blinker"}
    assert stated["noise"]["blinker"] != attributes(tmp_path, first)["noise"]["blinker"]
    assert sorted(lamp["group"] for lamp in stated["lamps"]) == ["blinker", "steady"]
    [row] = [row for row in stated["ledger"] if row["stage"].startswith("renderer")]
    assert {term["part"] for term in row["errors"]} == {"sky", "steady", "blinker"}


def test_the_store_stays_whole_without_the_one_that_groups_were_taken_from(tmp_path):
    _, [first] = frame(Waiting(0.5))
    light, [second] = frame(Waiting(1.5))
    (tmp_path / "scenes" / f"{first}.zarr").rename(tmp_path / "gone.zarr")
    alone = open_scene(tmp_path / "scenes" / f"{second}.zarr")
    np.testing.assert_array_equal(alone.radiance.values, light.radiance.values)
    frame(Waiting(1.75))
    assert len(Counting.calls) == 2


@pytest.mark.parametrize("change", range(len(CHANGES)))
def test_a_change_of_surface_material_camera_or_sky_leaves_no_group_equal(change):
    contents = contents_of(Waiting()())
    changed = contents_of(CHANGES[change](Waiting()()))
    shared = {g for g in contents.groups if contents.groups[g] == changed.groups.get(g)}
    only_lamp = CHANGES[change] is with_lamp_changed
    assert shared == ({"sky", "steady"} if only_lamp else set())
    assert (contents.surfaces == changed.surfaces) == only_lamp


@pytest.mark.slow
@pytest.mark.parametrize("change", [k for k, c in enumerate(CHANGES) if c is not with_lamp_changed])
def test_after_such_a_change_everything_is_rendered(change):
    frame(Waiting(1.5))
    frame(Changed(change))
    assert set(Counting.calls[1]) == {"sky", "steady", "blinker"}


def test_where_only_the_next_frame_moves_one_group_is_rendered_for_the_labels():
    frame(Waiting(1.5, frames_per_s=10.0))
    light, _ = frame(Waiting(1.95, frames_per_s=10.0))
    assert Counting.calls[1:] == [("sky",)]
    assert set(levels(light)) == {"sky", "steady", "blinker"}


def test_single_shots_take_over_no_groups():
    for time_s in OFF_AND_ON:
        frame_or_shot(Waiting(time_s))
    assert set(Counting.calls[1]) == {"sky", "steady", "blinker"}


def test_the_seed_of_a_frame_stays_while_nothing_moves_and_is_no_other_frames():
    drawn = []
    for time_s in (0.5, 1.5, 2.5, 3.5):  # the box moves after two seconds
        light, [name] = frame(Waiting(time_s))
        drawn.append(levels(light)["sky"])
    assert drawn[0] == drawn[1] and len({*drawn}) == 3
    single, [shot] = frame_or_shot(Waiting(3.5))
    assert levels(single)["sky"] == 1.0 and shot != name


def test_light_with_fewer_samples_is_not_taken_over():
    frame(Waiting(0.5))
    frame(Waiting(1.5), samples=8)
    assert set(Counting.calls[1]) == {"sky", "steady", "blinker"}


def lens(normals, lamp):
    """Return the scene with one more part that has these normals, and emits light with a lamp."""
    scene = Waiting()()
    part = Part("lens", SQUARE, FACES, "matt", normals, lamp)
    models = {**scene.models, "box": Model("box", (*scene.models["box"].parts, part))}
    return replace(scene, models=models)


def test_smooth_normals_which_a_lamp_loses_make_another_surface():
    lamp = Lamp("brake", "blinker", 10.0, flat(1.0), AXIS)
    facets = np.tile(AXIS, (4, 1))
    curved = facets + 0.1 * SQUARE
    curved /= np.linalg.norm(curved, axis=1, keepdims=True)
    for normals, equal in ((facets, True), (None, True), (curved, False)):
        off, on = (contents_of(lens(normals, state)).groups for state in (None, lamp))
        assert (off["steady"] == on["steady"]) is equal
        assert off["blinker"] != on["blinker"]


def test_noise_of_groups_that_are_taken_over_is_taken_off_what_is_allowed():
    light, _ = frame_or_shot(Waiting(0.5))
    others = light.sel(light_group=["sky", "steady"])
    weights = {"sky": 0.5, "steady": 0.0, "blinker": 1.0}
    limit = NoiseLimit(weights, np.full((3, 2, 4), 1.0))
    mine = light.sel(light_group=["blinker"])
    variance = (weights["sky"] * others.xyz_noise.values[0]) ** 2
    left = LimitBeside(lambda _: limit, [others], 0.6)(mine).xyz
    np.testing.assert_allclose((0.6 * left) ** 2 + variance, 0.36, rtol=1e-6)  # float32 noise
    tight = replace(limit, xyz=limit.xyz / 20)
    with pytest.raises(TooNoisy):
        LimitBeside(lambda _: tight, [others], 0.6)(mine)

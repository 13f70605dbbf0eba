"""Radiance that is stored for another frame serves a frame with equal light."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest

from isethdr_core.data.quantities import scene_radiance as dataset
from isethdr_core.demand import Demand
from isethdr_core.runs.radiance_cache import held_and_missing, scene_radiance
from isethdr_core.uncertainty.ledger import Ledger

from .waiting import Waiting

LABELLED = Demand(labels=frozenset({"distance"}))


@dataclass(frozen=True)
class Counting:
    """Radiance is the intensity of the lamps of a group; the distance is the place of the box."""

    effort_fields: ClassVar[tuple[str, ...]] = ("samples",)
    calls: ClassVar[list[tuple[str, ...]]] = []
    samples: int = 4
    step: int = field(default=1)

    def __call__(self, description, demand):
        groups = demand.groups or description.light_groups()
        self.calls.append(tuple(groups))
        lamps = [p.lamp for m in description.models.values() for p in m.parts if p.lamp]
        levels = [sum(n.intensity_cd for n in lamps if n.group == g) + 1 for g in groups]
        cube = np.array(levels)[:, None, None, None] * np.ones((1, 1, 2, 4))
        place = description.objects[0].pose[1, 3]
        return dataset(cube, groups, [550.0], np.arange(4), [0, 1], distance=np.full((2, 4), place))


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    Counting.calls.clear()


def frame(scene, demand=LABELLED, **renderer):
    """Return radiance and store names of a frame."""
    chain = SimpleNamespace(
        scene=scene, renderer=Counting(**renderer), lighting=None, versions={}, leave_out=True
    )
    config = SimpleNamespace(
        scene=SimpleNamespace(name="waiting"), renderer=SimpleNamespace(name="counting")
    )
    light, ids = scene_radiance(chain, demand, Ledger(), config)
    assert held_and_missing(chain, demand)[1] is None  # known without building the scene again
    return light.load(), ids


def levels(light) -> dict[str, float]:
    groups = [str(g) for g in light.light_group.values]
    return {g: float(light.radiance.values[k].mean()) for k, g in enumerate(groups)}


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

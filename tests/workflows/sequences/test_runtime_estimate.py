"""The runtime estimate counts frames that show the same light once."""

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import ClassVar

import pytest
from isethdr_workflows.sequences.runtime_estimate import EqualFrames

from isethdr_core.conformance.renderer import world
from isethdr_core.demand import Demand
from isethdr_core.scene import Model


@dataclass(frozen=True)
class Blinking:
    """A scene with lamps that are brighter in odd frames and a camera that moves in frame 4."""

    frame: int = 0

    def __call__(self):
        scene = world()
        models = {name: self.lit(model) for name, model in scene.models.items()}
        x, *others = scene.camera.position_m
        camera = replace(scene.camera, position_m=(x + (self.frame == 4), *others))
        return replace(scene, models=models, camera=camera)

    def lit(self, model):
        candela = 10.0 + self.frame % 2
        return Model(
            model.name,
            tuple(
                replace(part, lamp=part.lamp and replace(part.lamp, intensity_cd=candela))
                for part in model.parts
            ),
        )


@dataclass(frozen=True)
class Renderer:
    effort_fields: ClassVar[tuple[str, ...]] = ()
    seed: int = 0


def test_equal_frames_and_light_groups_are_counted_once(tmp_path, monkeypatch):
    monkeypatch.setenv("ISETHDR_HOME", str(tmp_path))
    equal = EqualFrames()
    demand = Demand()

    def missing(frame):
        chain = SimpleNamespace(scene=Blinking(frame), renderer=Renderer(), exposures={})
        return equal.missing(chain, demand, demand)

    first = world().light_groups()
    assert len(first) > 1 and missing(0) == demand
    rest = missing(1).groups  # the lamps that have changed
    assert rest and set(rest) < set(first)
    assert missing(2) is None and missing(3) is None  # equal to 0 and 1
    assert missing(4) == demand
    equal.most_s = 0.0
    with pytest.raises(TimeoutError):
        missing(0)

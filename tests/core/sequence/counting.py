"""A renderer for tests that records its calls, and a function that renders a frame with it."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import ClassVar

import numpy as np

from isethdr_core.data.quantities import scene_radiance as dataset
from isethdr_core.demand import Demand
from isethdr_core.runs.radiance_cache import held_and_missing, scene_radiance
from isethdr_core.uncertainty.ledger import Ledger, error

LABELLED = Demand(labels=frozenset({"distance"}))


@dataclass(frozen=True)
class Counting:
    """A renderer that returns simple numbers.

    Radiance is the intensity of the lamps of a group, plus 1 and the last three digits of the seed.
    The label `distance` is the position of the box.
    """

    effort_fields: ClassVar[tuple[str, ...]] = ("samples",)
    calls: ClassVar[list[tuple[str, ...]]] = []
    samples: int = 4
    step: int = 1
    seed: int = 0

    def __call__(self, description, demand):
        groups = demand.groups or description.light_groups()
        self.calls.append(tuple(groups))
        lamps = [p.lamp for m in description.models.values() for p in m.parts if p.lamp]
        drawn = 1 + self.seed % 1000
        levels = [sum(n.intensity_cd for n in lamps if n.group == g) + drawn for g in groups]
        cube = np.array(levels)[:, None, None, None] * np.ones((1, 1, 2, 4))
        place = description.objects[0].pose[1, 3]
        distance = np.full((2, 4), place)
        ds = dataset(cube, groups, [550.0], np.arange(4), [0, 1], distance=distance)
        ds["xyz_noise"] = (
            ("light_group", "xyz_channel", "y", "x"),
            np.broadcast_to(cube, (len(groups), 3, 2, 4)).astype(np.float32) / 10,
        )
        ds.attrs["noise"] = {group: level / 10 for group, level in zip(groups, levels)}
        ds.attrs["lamps"] = [
            {"instance": k, "group": n.group} for k, n in enumerate(lamps) if n.group in groups
        ]
        for group in groups:
            error(0.1, "relative", "statistical", f"noise of {group}", part=group)
        return ds


def frame(scene, demand=LABELLED, exposures=None, **renderer):
    """Return radiance and store names of a frame; with `exposures`, it belongs to a sequence."""
    chain = SimpleNamespace(
        scene=scene,
        renderer=Counting(**renderer),
        lighting=None,
        versions={},
        leave_out=True,
        exposures=exposures,
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

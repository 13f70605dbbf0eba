"""Cost of frames in which only lamps change: the other light groups are not rendered again.

The vehicles of a night drive stand still. Their tail lamps switch to brake lamps and back, on the
left and on the right of the camera in turn: four frames with four states. The frames are rendered
twice in this process: one after the other into one folder of results, as the frames of a sequence,
and each anew into its own folder. The CPU seconds are those of building, rendering and storing the
scene. The first rendering compiles kernels and is not counted. The command line may override the
config. Run:

    python benchmarks/sequence_blinking.py renderer.samples=16
    python benchmarks/sequence_blinking.py                     # samples by the cameras' need
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from omegaconf import DictConfig

import isethdr_core as hdr
from isethdr_core.data.scene_description import Model, Part, SceneDescription
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.runs.radiance_cache import scene_radiance
from isethdr_core.uncertainty.ledger import Ledger

STATES = ((False, False), (True, False), (False, True), (True, True))  # left, right
BRAKE = 10.0  # intensity of a brake lamp over that of a tail lamp
SCENE = [
    "scene=night_drive",
    "lighting=night_city",
    "renderer.width=96",
    "renderer.height=54",
    "renderer.step_nm=20",
]


@dataclass(frozen=True)
class Braking:
    """A scene with brake lamps in place of tail lamps on the left or right of the camera."""

    scene: Any
    left: bool
    right: bool

    def __call__(self) -> SceneDescription:
        """Return the description; each object with tail lamps has a model of its own."""
        made = self.scene()
        models = {}
        objects = []
        for number, placed in enumerate(made.objects):
            model = made.models[placed.model]
            name = placed.model
            if any(part.lamp and part.lamp.kind == "tail" for part in model.parts):
                brakes = self.left if placed.pose[1, 3] > 0 else self.right
                name = f"{name} {number}"
                model = Model(name, tuple(_switched(part, brakes) for part in model.parts))
            models[name] = model
            objects.append(replace(placed, model=name))
        return replace(made, models=models, objects=tuple(objects))


def _switched(part: Part, brakes: bool) -> Part:
    if part.lamp is None or part.lamp.kind != "tail" or not brakes:
        return part
    candela = BRAKE * part.lamp.intensity_cd
    return replace(part, lamp=replace(part.lamp, intensity_cd=candela))


class Frame(NamedTuple):
    """One rendered frame."""

    light: xr.Dataset
    seconds: float  # CPU s


def frame(home: Path, config: DictConfig, state: tuple[bool, bool]) -> Frame:
    """Return a frame rendered with `home` as home folder, whose stores may be reused."""
    os.environ["ISETHDR_HOME"] = str(home)
    built = chain(config)
    built = replace(built, scene=Braking(built.scene, *state), exposures={})
    rows = Ledger()
    start = time.process_time()
    light = scene_radiance(built, plan(built, rows), rows, config)[0].load()
    return Frame(light, time.process_time() - start)


def main() -> None:
    """Print CPU seconds of each frame, as part of a sequence and anew, and their ratio."""
    config = hdr.compose([*SCENE, *sys.argv[1:]])
    with tempfile.TemporaryDirectory() as folder:
        frame(Path(folder) / "compiled", config, STATES[0])
        totals = np.zeros(2)
        for number, state in enumerate(STATES):
            kept = frame(Path(folder) / "sequence", config, state)
            anew = frame(Path(folder) / f"frame {number}", config, state)
            totals += kept.seconds, anew.seconds
            taken = ", ".join(kept.light.attrs["groups_from"]) or "none"
            places = [list(anew.light.light_group.values).index(g) for g in kept.light.light_group]
            equal = np.array_equal(kept.light.radiance, anew.light.radiance.values[places])
            print(
                f"frame {number}: {kept.seconds:6.2f} s, anew {anew.seconds:6.2f} s; copied:"
                f" {taken}; {'equal' if equal else 'not equal'} bit by bit",
                flush=True,
            )
        print(
            f"{len(STATES)} frames: {totals[0]:.1f} CPU s, anew {totals[1]:.1f} CPU s:"
            f" {totals[1] / totals[0]:.2f} times"
        )


if __name__ == "__main__":
    main()

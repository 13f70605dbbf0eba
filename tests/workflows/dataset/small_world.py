"""A tiny world and its renderer, for a test's own process or as a plugin of other processes."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from isethdr_core.component import Component
from isethdr_core.conformance.renderer import world
from isethdr_core.errors import ConfigError
from isethdr_core.hookspecs import hookimpl
from isethdr_core.quantities import centres, scene_radiance

RENDERED: list[float] = []


@dataclass(frozen=True)
class SmallWorld:
    """A lamp over a road; every fifth seed cannot be built."""

    seed: int = 0
    intensity_cd: float = 100.0
    fails: bool = True  # whether every fifth seed fails

    def __call__(self):
        """Return the road, lamp and sky of the conformance kit."""
        if self.fails and self.seed % 5 == 0:
            raise ConfigError(f"the seed {self.seed} leaves no room; expected another")
        return world(intensity_cd=self.intensity_cd + self.seed % 7)


@dataclass(frozen=True)
class Small:
    """Give each tile the level of the lamp."""

    width: int = 12
    seconds: float = 0.0  # shortest run time, s

    def __call__(self, description, demand):
        """Return `width` x 8 tiles in 7 bands with all labels."""
        groups = description.light_groups()
        lamp = next(
            part.lamp
            for model in description.models.values()
            for part in model.parts
            if part.lamp is not None
        )
        time.sleep(self.seconds)
        RENDERED.append(lamp.intensity_cd)
        shape = (8, self.width)
        radiance = np.ones((len(groups), 7, *shape)) * 1e-4
        radiance[-1] *= lamp.intensity_cd
        instance = np.zeros(shape, np.uint32)
        instance[3:5, 4:7] = 1
        radiance[..., instance == 1] *= 3
        ds = scene_radiance(
            radiance,
            groups,
            np.linspace(400, 700, 7),
            centres(self.width, 0.6),
            centres(8, 0.4),
            instance=instance,
            category=(instance * 3).astype(np.uint16),
            depth=np.full(shape, 20.0, np.float32),
            distance=np.full(shape, 21.0, np.float32),
            normal=np.zeros((*shape, 3), np.float32),
        )
        car = {"instance": 1, "category": "car", "name": "car", "box": [4, 3, 3, 2]}
        ds.attrs["objects"] = [car | {"visible_fraction": 1.0, "distance_m": 21.0}]
        ds.attrs["noise"] = dict.fromkeys(groups, 0.01)
        return ds


@hookimpl
def isethdr_components():
    """Return the world and its renderer."""
    return [Component("scene", "small_world", SmallWorld), Component("renderer", "small", Small)]


def installed(folder: Path) -> Path:
    """Install this file as the package `acme_world` into `folder`, and return the folder."""
    info = folder / "acme_world-1.0.dist-info"
    info.mkdir(parents=True)
    shutil.copy(Path(__file__), folder / "acme_world.py")
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: acme_world\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[isethdr]\nacme = acme_world\n")
    return folder

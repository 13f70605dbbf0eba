"""Cost of the frames of a waiting car: light groups that do not change are not rendered again.

The camera's car in a street has stopped at a red light. The frames are rendered twice in this
process: one after the other into one folder of results, as by `isethdr sequence`, and each anew
into its own folder. The CPU seconds are those of building, rendering and storing the scene. The
first rendering compiles kernels and is not counted. The last column states whether the radiance of
both renderings is equal bit by bit, or else the largest difference of a tile's luminance in
standard errors of the difference. The command line may override the config of all frames. Run:

    python benchmarks/sequence_waiting.py                          # an empty road
    python benchmarks/sequence_waiting.py scene.vehicles_per_km=15 # with traffic
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

import isethdr_core as hdr
from isethdr_core.physics.photometry import luminance
from isethdr_core.runs.rendering import render
from isethdr_core.storage.join import join_scenes

FRAMES = 4
FRAMES_PER_SECOND = 10
START_S = 9.0  # with this seed the car stands from 8.2 s on
EMPTY = [
    f"scene.{things}=0"
    for things in ("vehicles_per_km", "people_per_km", "riders_per_km", "animals_per_km")
]
SCENE = [
    "scene=street",
    "scene.road=city_crossing",
    "scene.seed=2",
    "lighting=night_city",
    "renderer.width=96",
    "renderer.height=54",
    "renderer.samples=16",
    "renderer.step_nm=20",
]


class Frame(NamedTuple):
    """One rendered frame."""

    light: xr.Dataset
    seconds: float  # CPU s
    paths: tuple[Path, ...]


def frame(home: Path, time_s: float, overrides: list[str]) -> Frame:
    """Return a frame rendered with `home` as home folder, whose stores may be reused."""
    os.environ["ISETHDR_HOME"] = str(home)
    settings = [f"scene.time_s={time_s!r}", f"scene.frames_per_s={FRAMES_PER_SECOND}", *overrides]
    config = hdr.compose([*SCENE, *settings])
    start = time.process_time()
    paths = render(config).stores
    seconds = time.process_time() - start
    return Frame(join_scenes([hdr.open_scene(path) for path in paths]).load(), seconds, paths)


def difference(one: xr.Dataset, other: xr.Dataset) -> str:
    """Return in words the difference between two renderings of a frame."""
    groups = [str(g) for g in one.light_group.values]
    places = [[str(g) for g in other.light_group.values].index(g) for g in groups]
    first = one.radiance.values
    second = other.radiance.values[places]
    if np.array_equal(first, second):
        return "equal bit by bit"
    worst = 0.0
    nm = one.wavelength.values
    for k, place in enumerate(places):
        apart = np.abs(luminance(first[k] - second[k], nm))
        noise = np.hypot(one.xyz_noise.values[k, 1], other.xyz_noise.values[place, 1])
        worst = max(worst, float(np.max(apart[noise > 0] / noise[noise > 0], initial=0.0)))
    return f"differ by up to {worst:.3g} standard errors"


def main() -> None:
    """Print CPU seconds of each frame, as part of a sequence and anew, and their ratio."""
    overrides = EMPTY + sys.argv[1:]
    times_s = [START_S + k / FRAMES_PER_SECOND for k in range(FRAMES)]
    with tempfile.TemporaryDirectory() as folder:
        frame(Path(folder) / "compiled", times_s[0] - 1, overrides)
        totals = np.zeros(2)
        for number, time_s in enumerate(times_s):
            kept = frame(Path(folder) / "sequence", time_s, overrides)
            anew = frame(Path(folder) / f"frame {number}", time_s, overrides)
            totals += kept.seconds, anew.seconds
            print(
                f"frame {number}: {kept.seconds:6.2f} s, anew {anew.seconds:6.2f} s,"
                f" {difference(kept.light, anew.light)}",
                flush=True,
            )
        print(
            f"{FRAMES} frames: {totals[0]:.1f} CPU s, anew {totals[1]:.1f} CPU s:"
            f" {totals[1] / totals[0]:.2f} times"
        )


if __name__ == "__main__":
    main()

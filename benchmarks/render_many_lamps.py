"""Time to equal noise: 1,000 lamps against 10 of the same total flux and area.

    python benchmarks/render_many_lamps.py [tiles across: 64]

Lamps hang in rows above a street of boxes and face down. The noise of a tile is the standard
deviation over repetitions divided by their mean. Time to equal noise is CPU seconds of a pass times
the square of the noise, for the median tile and for the 99th percentile. The set-up of the lamps'
tables is timed separately.
"""

from __future__ import annotations

import os
import sys
import time

import numpy as np

os.environ.setdefault("OMP_NUM_THREADS", "1")

from isethdr_mitsuba.doctor import choose_variant
from isethdr_mitsuba.frame import Built, Cube, follower
from isethdr_mitsuba.lamps.placed_lamps import placed_lamps
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_mitsuba.world.view import view_of

from isethdr_core.physics.photometry import xyz_weights
from isethdr_core.scene import (
    Camera,
    Lamp,
    Material,
    Model,
    Part,
    Placed,
    SceneDescription,
    flat,
)

# total flux and area of all lamps
FLUX_LM = 1e5
AREA_M2 = 1.0
REPEATS = 8
SAMPLES = 64
BANDS_NM = np.array([450.0, 520, 590, 660])
LENGTH_M = 60.0
WIDTH_M = 20.0
HEIGHT_M = 6.0
BOX_FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
BOX_FACES += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]


def square(half, material, lamp=None, up=1.0):
    v = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float) * half
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return Part("square", v, faces if up > 0 else faces[:, ::-1], material, None, lamp)


def at(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def street(count: int) -> SceneDescription:
    """Return a street with `count` lamps."""
    half = np.sqrt(AREA_M2 / count) / 2
    # the flux of a Lambertian lamp, lm, is pi times its intensity, cd
    lamp = Lamp("street", "streetlights", FLUX_LM / count / np.pi, flat(1.0), (0.0, 0.0, -1.0))
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    models = {
        "ground": Model("ground", (square(100.0, "grey"),)),
        "lamp": Model("lamp", (square(half, "black", lamp, up=-1.0),)),
        "box": Model("box", (Part("box", corners * 2 - [1, 1, 0], np.array(BOX_FACES), "grey"),)),
    }
    objects = [Placed("ground", "ground", "road", at(0, 0, 0))]
    rng = np.random.default_rng(1)
    for k, (x, y) in enumerate(rng.uniform([4, -9], [LENGTH_M, 9], (40, 2))):
        objects.append(Placed(f"box{k}", "box", "building", at(x, y, 0)))
    across = max(2, round(np.sqrt(count * WIDTH_M / LENGTH_M)))
    along = -(-count // across)
    for k in range(count):
        x = (k // across + 0.5) * LENGTH_M / along
        y = (k % across + 0.5) * WIDTH_M / across - WIDTH_M / 2
        objects.append(Placed(f"lamp{k}", "lamp", "street lamp", at(x, y, HEIGHT_M)))
    materials = {n: Material(n, reflectance=flat(r)) for n, r in (("grey", 0.4), ("black", 0.0))}
    camera = Camera((-4, 0, 2.5), (20, 0, 0.5), 50.0, 16 / 9)
    return SceneDescription("street", models, tuple(objects), materials, camera)


def measure(count: int, width: int) -> dict[str, float]:
    """Return CPU seconds of set-up and of a pass, and relative noise of tiles."""
    import mitsuba as mi

    mi.set_variant(choose_variant("llvm"))
    from isethdr_mitsuba.world.geometry import build_world
    from isethdr_mitsuba.world.materials import ramp_surfaces

    description = street(count)
    settings = MitsubaRenderer(width=width, height=width * 9 // 16, margin=0.0, step_nm=70.0)
    view = view_of(description.camera, settings.width, settings.height, 0.0)
    surfaces = ramp_surfaces(description)
    groups = ["streetlights"]
    start = time.process_time()
    lamps = placed_lamps(description)
    world = build_world(description, surfaces)
    cube = Cube(groups, BANDS_NM, view)
    paths = follower(description, Built(world, surfaces), lamps, cube, settings)
    setup = time.process_time() - start
    weights = xyz_weights(BANDS_NM)[1]
    pictures = []
    seconds = []
    for seed in range(REPEATS + 1):  # the first pass compiles
        start = time.process_time()
        estimate = paths.even_pass(seed, SAMPLES)
        seconds.append(time.process_time() - start)
        pictures.append(np.tensordot(weights, estimate[0][: len(BANDS_NM)].astype(float), 1))
    tiles = np.array(pictures[1:])
    mean = tiles.mean(0)
    lit = mean > 0.01 * mean.mean()
    noise = tiles.std(0, ddof=1)[lit] / mean[lit]
    return {
        "setup_s": setup,
        "pass_s": float(np.median(seconds[1:])),
        "median": float(np.median(noise)),
        "p99": float(np.percentile(noise, 99)),
    }


def main() -> None:
    width = int(sys.argv[1]) if len(sys.argv) > 1 else 64
    few = measure(10, width)
    many = measure(1000, width)
    for count, estimate in ((10, few), (1000, many)):
        print(count, "lamps:", ", ".join(f"{k} {v:.3g}" for k, v in estimate.items()))
    for name in ("median", "p99"):
        ratio = many["pass_s"] * many[name] ** 2 / (few["pass_s"] * few[name] ** 2)
        print(f"time to equal noise, {name} tile: {ratio:.2f} times")
    extra = 1e3 * (many["setup_s"] - few["setup_s"]) / 990
    print(f"set-up: {extra:.2f} ms a lamp")


if __name__ == "__main__":
    main()

"""Fog against Mitsuba's `volpath`: light scattered once, and light scattered at any order.

The scene is small: dark ground, a board as large as a person 20 m ahead, two headlamps of the
camera's car and two of an oncoming car 45 m away. By night the lamps light the scene. By day an
even sky above the fog does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from isethdr_mitsuba.renderer import MitsubaRenderer
from isethdr_mitsuba.world.view import view_of

from isethdr_core.demand import Demand
from isethdr_core.scene import (
    Camera,
    Fog,
    Lamp,
    Material,
    Model,
    Part,
    Placed,
    SceneDescription,
    flat,
)

from .fog_reference import volpath_pictures

Plane = npt.NDArray[np.float64]  # (y, x)

COLUMNS = 16
ROWS = 9
BATCHES = 8
ALL_ORDERS = 24  # segments of a path; more change the light of these scenes by less than the noise
NEAR_M = 8.0  # farthest distance of the region `road_near`
FAR_M = 25.0  # nearest distance of the region `road_far`


def fog_scattering(
    visibilities: str = "50 100 200 500", samples: int = 256, ours: int = 4096
) -> list[dict[str, Any]]:
    """Return a row for each visibility, light and region of the picture.

    Parameters
    ----------
    visibilities : visibilities, m, separated by spaces.
    samples : samples per tile in each of the eight batches of `volpath`.
    ours : samples per tile of this renderer.

    Returns
    -------
    rows with visibility_m, light, region, and the radiance of this renderer over that of `volpath`
    with its standard error, for all orders of scattering (`over_all`), and by night also for paths
    of two segments (`over_once`).
    """
    rows = []
    for visibility_m in map(float, visibilities.split()):
        for light in ("headlights", "sky"):
            rows += _rows(visibility_m, light, samples, ours)
    return rows


def _rows(visibility_m: float, light: str, samples: int, ours: int) -> list[dict[str, Any]]:
    fog = Fog(-np.log(0.05) / visibility_m)
    scene = replace(small_scene(light), fog=fog)
    regions = regions_of(scene, light)
    view = view_of(scene.camera, COLUMNS, ROWS, 0.0)
    top_m = scene.camera.position_m[2] + fog.above_camera_m if light == "sky" else 500.0
    found = {"all": rendered(scene, light, 5, ours)}
    depths = {"all": ALL_ORDERS}
    if light == "headlights":
        found["once"] = rendered(scene, light, 2, ours)
        depths["once"] = 2
    out = {name: {"visibility_m": visibility_m, "light": light, "region": name} for name in regions}
    for name, depth in depths.items():
        pictures = volpath_pictures(scene, view, light, depth, top_m)
        batches = np.array([pictures(seed, samples) for seed in range(BATCHES)])
        for region, tiles in regions.items():
            of_batches = batches[:, tiles].mean(1)
            mean = float(of_batches.mean())
            out[region][f"over_{name}"] = float(found[name][tiles].mean()) / mean
            error = float(of_batches.std(ddof=1)) / np.sqrt(BATCHES) / mean
            out[region][f"over_{name}_error"] = error
    return list(out.values())


def rendered(
    scene: SceneDescription, group: str, max_depth: int, samples: int, seed: int = 0
) -> Plane:
    """Return this renderer's radiance (y, x) at 550 nm.

    Parameters
    ----------
    scene : scene with fog.
    group : light group.
    max_depth : largest number of segments of a path; -1: no limit.
    samples : paths per tile.
    seed : seed of the paths.
    """
    renderer = MitsubaRenderer(
        width=COLUMNS,
        height=ROWS,
        margin=0.0,
        samples=samples,
        first_nm=550.0,
        last_nm=550.0,
        max_depth=max_depth,
        seed=seed,
    )
    found: Plane = renderer(scene, Demand(groups=(group,))).radiance.values[0, 0].astype(float)
    return found


def regions_of(scene: SceneDescription, light: str) -> dict[str, npt.NDArray[np.bool_]]:
    """Return a mask (y, x) of the tiles of each region: air, the board, the road nearby and far
    away.

    Tiles with a directly visible lamp are left out, because `volpath` renders no such lamps here.

    Parameters
    ----------
    scene : scene with fog.
    light : `headlights` or `sky`.
    """
    renderer = MitsubaRenderer(width=COLUMNS, height=ROWS, margin=0.0, samples=1, step_nm=300.0)
    labels = renderer(scene, Demand(labels=frozenset({"instance", "distance"})))
    instance = labels.instance.values
    distance = labels.distance.values
    names = {placed.name: number for number, placed in enumerate(scene.objects, 1)}
    road = instance == names["road"]
    regions = {
        "air": instance == 0,
        "board": instance == names["board"],
        "road_near": road & (distance < NEAR_M),
        "road_far": road & (distance > FAR_M),
    }
    if light != "sky":
        lamps = rendered(replace(scene, fog=None), light, 1, 1) > 0
        regions = {name: tiles & ~lamps for name, tiles in regions.items()}
    return regions


def small_scene(light: str) -> SceneDescription:
    """Return the scene in clear air: by day if `light` is `sky`, else by night."""
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    upright = np.array([[0.0, 1, -1], [0, -1, -1], [0, -1, 1], [0, 1, 1]])  # faces -x
    level = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    beam = Lamp("low_beam", "headlights", 1e4, flat(1.0), (-1.0, 0, -0.03), 4.0, 16.0, 1e-3)
    parts = {
        "road": Part("road", 2500 * level, faces, "ground"),
        "board": Part("board", upright * [1, 0.6, 0.9], faces, "cloth"),
        "lamp": Part("lamp", 0.08 * upright, faces, "black", lamp=beam),
    }
    at = lambda x, y, z, turned=False: np.array(
        [[-1.0, 0, 0, x], [0, -1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]]
        if turned
        else [[1.0, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]]
    )
    objects = [
        Placed("road", "road", "road", at(0, 0, 0)),
        Placed("board", "board", "person", at(20, -2.5, 0.9)),
    ]
    if light != "sky":
        objects += [
            Placed(f"own{k}", "lamp", "car", at(1.5, y, 0.65, turned=True))
            for k, y in enumerate((-0.6, 0.6))
        ]
        objects += [
            Placed(f"oncoming{k}", "lamp", "car", at(45, y, 0.65)) for k, y in enumerate((2.9, 4.1))
        ]
    return SceneDescription(
        "fog",
        {o.model: Model(o.model, (parts[o.model],)) for o in objects},
        tuple(objects),
        {n: Material(n, reflectance=flat(v)) for n, v in _REFLECTANCES.items()},
        Camera((0.0, 0, 1.3), (20.0, 0, 1.3), 45.0, COLUMNS / ROWS),
        flat(1e-3) if light == "sky" else None,
    )


_REFLECTANCES = {"ground": 0.08, "cloth": 0.3, "black": 0.0}

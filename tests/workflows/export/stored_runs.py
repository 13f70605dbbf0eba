"""A home folder with one computed run, one run with labelled objects, a scene and a sweep."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from isethdr_scenes.pictures import array_scene

import isethdr_core as hdr
from isethdr_core.quantities import centres, scene_radiance
from isethdr_core.runs.labels import Labels, add_labels
from isethdr_core.storage.store import write_store
from isethdr_core.sweeps.record import Job, Sweep, begin, write_job

ROWS = 12
COLUMNS = 16
BANDS = (450.0, 555.5, 650.0)
QUICK = [
    "experiment=own_picture",
    "sensor=bayer",
    f"sensor.rows={ROWS}",
    f"sensor.columns={COLUMNS}",
    "lens=ideal",
    "~flare@flare.dirt",
    "isp=linear",
    "report=false",
    "draws=1",
    "cache_gb=0",
    *(f"~metric.{name}" for name in ("shares", "dynamic_range", "snr", "colour", "ssim")),
    *(f"~metric.{name}" for name in ("log_luminance", "contrast", "detection")),
]
LABELLED = "1abe11ed00000000"
SCENE = "5ce4e00000000000-00000000"
SWEEP = "two"


@dataclass(frozen=True)
class Home:
    """A home folder and the keys of its runs."""

    folder: Path
    plain: str  # the run without labels
    labelled: str = LABELLED


def stored_home(folder: Path) -> Home:
    """Make the home folder; ISETHDR_HOME must name it."""
    ramp = np.linspace(1, 400, ROWS * COLUMNS * 3).reshape(ROWS, COLUMNS, 3)  # brightest below
    run = hdr.run(hdr.compose([*array_scene(ramp, unit="cd/m2", horizontal_field_deg=2), *QUICK]))
    add_labels(run.path, Labels("first"))
    groups = {f"{kind}/bayer": run.open(f"{kind}/bayer").load() for kind in ("picture", "captures")}
    groups["picture/bayer"]["xyz"] *= 0.5  # so that the two runs differ
    groups["truth/bayer"] = labelled(run.open("truth/bayer").load())
    attributes = {**run.attributes, "key": LABELLED, "scene_ids": [SCENE], "lighting": "night"}
    attributes["objects"] = groups["truth/bayer"].attrs["objects"]
    attributes["config"] = run.attributes["config"] | {
        "scene": {"name": "three_boxes", "time_s": 0.25}
    }
    write_store(folder / "runs", LABELLED, groups, attributes)
    write_store(folder / "scenes", SCENE, {"": scene()}, {"kind": "scene", "recipe": SCENE[:16]})
    sweep = Sweep(SWEEP, ("sensor=bayer",), ("scene",), 3)
    begin(sweep)
    for number, key in enumerate((run.key, LABELLED, "")):
        write_job(sweep.folder, Job(number, (), 1.0, key, error="" if key else "failed"))
    return Home(folder, run.key)


def labelled(truth: xr.Dataset) -> xr.Dataset:
    """Return a reference picture with a car, a person in front of it, and a road."""
    instance = np.zeros((ROWS, COLUMNS), np.uint32)
    instance[8:] = 3  # the road
    instance[3:9, 4:12] = 1  # the car
    instance[4:10, 6:8] = 2  # the person, in two columns
    truth["instance"] = (("y", "x"), instance)
    motion = np.zeros((ROWS, COLUMNS, 2), np.float32)
    motion[instance == 1] = (1.5, -0.25)  # the car
    motion[0] = np.nan
    truth["motion"] = (("y", "x", "uv"), motion)
    for name, value in surfaces(ROWS, COLUMNS).items():
        truth[name] = (("y", "x", "direction")[: value.ndim], value)
    rows = (("car", [4, 3, 8, 6]), ("person", [6, 4, 2, 6]), ("road", [0, 8, 16, 4]))
    truth.attrs["objects"] = [
        {
            "instance": number,
            "category": category,
            "name": f"{category} {number}",
            "box": [float(v) for v in box],
            "visible_fraction": 0.75,
            "distance_m": 10.0 * number,
            "position_m": [10.0 * number, 0.0, 0.0],
            "in_frame": 1.0,
            "truncation": 0.25,
            "illuminance_lx": {"sky": 100.0 * number, "headlights": 4.0, "tunnel": 1.0},
        }
        for number, (category, box) in enumerate(rows, 1)
    ]
    return truth


def surfaces(rows: int, columns: int) -> dict[str, np.ndarray]:
    """Return labels of a slope below a sky of one row: depth and distance in m, and normals."""
    depth = np.linspace(90.5, 3.25, rows * columns, dtype=np.float32).reshape(rows, columns)
    depth[0] = np.inf
    normal = np.zeros((rows, columns, 3), np.float32)
    normal[1:] = (-0.6, 0.0, 0.8)
    return {"depth": depth, "distance": 1.25 * depth, "normal": normal}


def scene() -> xr.Dataset:
    """Return scene radiance of two light groups that is brightest in the lower right."""
    light = np.arange(2 * len(BANDS) * 3 * 4, dtype=np.float32).reshape(2, len(BANDS), 3, 4)
    x = centres(4, 0.4)
    y = centres(3, 0.3)
    return scene_radiance(light, ("sky", "headlights"), BANDS, x, y, **surfaces(3, 4))

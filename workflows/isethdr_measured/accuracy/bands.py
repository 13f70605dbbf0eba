"""Width of the spectral bands: electrons of a camera, compared with those from bands of 2 nm."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from isethdr_workflows.accuracy.point import Point, Work

from isethdr_core.plugins.registry import build

from .transport import of_paths

if TYPE_CHECKING:
    import xarray as xr

SIZE = {"width": 64, "height": 36}
STEPS_NM = (5.0, 10.0, 20.0, 30.0, 60.0)
FINE_NM = 2.0
SAMPLES = 64


def measured() -> list[Work]:
    """Return one diagram: median relative error of a pixel's electrons. All band widths use the
    same random paths. Seconds are those of the paths.
    """
    scene = build("scene", "night_drive")()
    default = build("renderer", "mitsuba").step_nm
    render = {
        step: build("renderer", "mitsuba", **SIZE, samples=SAMPLES, step_nm=step)
        for step in (*STEPS_NM, FINE_NM)
    }
    truth = electrons(render[FINE_NM](scene))
    points = []
    for step in STEPS_NM:
        [(rendering, cpu_s, peak_mb)] = of_paths(render[step], scene)
        mine = electrons(rendering)
        lit = truth > 1e-3 * truth.max()
        points.append(
            Point(
                f"{step:g} nm",
                float(np.median(np.abs(mine[lit] / truth[lit] - 1))),
                cpu_s,
                peak_mb,
                "default" if step == default else "",
            )
        )
    # for smooth spectra, the error is proportional to the square of the width
    own_error = points[0].error * (FINE_NM / STEPS_NM[0]) ** 2
    return [
        Work(
            "bands",
            "median relative error of a pixel's electrons",
            f"bands of {FINE_NM:g} nm, same paths",
            own_error,
            points,
        )
    ]


def electrons(scene: xr.Dataset) -> np.ndarray:
    """Return mean electrons (y, x) of a camera with a lens that neither blurs nor vignettes. All
    light groups have the weight 1.
    """
    mixed = build(
        "lighting", "weights", weights=dict.fromkeys(map(str, scene.light_group.values), 1.0)
    )(scene)
    focal_mm = 3e-3 * SIZE["width"] / mixed.attrs["field_width"]
    light = build("lens", "ideal", f_number=2.0, focal_length_mm=focal_mm, falloff="none")(mixed)
    sensor = build("sensor", "bayer", pitch_um=3.0, rows=SIZE["height"], columns=SIZE["width"])
    return np.asarray(sensor.expected(light).values, float)

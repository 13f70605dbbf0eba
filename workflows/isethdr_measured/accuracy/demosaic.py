"""Demosaic methods, against the reference picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from isethdr_isp.demosaic.methods import AUTOMATIC, chosen
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core import generator
from isethdr_core.plugins.registry import build
from isethdr_core.truth import truth

from ..demosaic_methods import ARRAYS, PITCH_UM, radiance

SIZE = (240, 320)
BORDER = 8


def measured() -> list[Work]:
    """Return one diagram per filter array: rms error of luminance over its mean, on stripes of 100
    cd/m2 that grow finer from left to right.
    """
    return [array(cfa, methods) for cfa, methods in ARRAYS.items()]


def array(cfa: str, methods: Sequence[str]) -> Work:
    """Return the diagram of one filter array. The reference is the picture of the same camera
    without noise and with every colour in every pixel. The default is the method that cameras of
    the main job choose.
    """
    rows, columns = SIZE
    mixed = radiance("stripes", 100.0, rows, columns)
    focal_mm = PITCH_UM * 1e-3 / (mixed.attrs["field_width"] / (columns + 8))
    light = build("lens", "ideal", f_number=2.0, focal_length_mm=focal_mm, falloff="none")(mixed)
    shot = build("sensor", "bayer", pitch_um=PITCH_UM, cfa=cfa, rows=rows, columns=columns)(
        light, generator(seed=1)
    )
    filters = shot["filter"].values
    default = chosen(AUTOMATIC, filters, [str(name) for name in shot["channel"].values])
    points = []
    inner = (slice(BORDER, -BORDER), slice(BORDER, -BORDER), 1)
    for method in methods:
        isp = build("isp", "linear", demosaic=method)
        picture, cpu_s, peak_mb = timed(lambda isp=isp: isp(shot))
        true = truth(mixed, picture)["xyz"].values[inner]
        error = np.sqrt(np.mean((picture["xyz"].values[inner] - true) ** 2)) / true.mean()
        points.append(
            Point(method, float(error), cpu_s, peak_mb, "default" if method == default else "")
        )
    return Work(
        f"demosaic {cfa.replace('/', '-')}",
        "rms error of luminance over its mean",
        "noise-free truth on the same pixels",
        1e-7,
        points,
    )

"""Mantissa bits kept in a store, against the radiance before it was stored."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core import store
from isethdr_core.plugins.registry import build
from isethdr_core.storage.encoding import KEEPBITS

BITS = (4, 6, 8, 10, 12, 16, None)  # None keeps all 23

SIZE = (320, 180)  # tiles


def measured() -> list[Work]:
    """Return one diagram: error of a radiance that is written and read back, against the seconds
    for both, with its size on disk.
    """
    scene = radiance()
    exact = scene.radiance.values.astype(float)
    points = []
    with tempfile.TemporaryDirectory() as folder:
        for bits in BITS:

            def there_and_back(bits: int | None = bits) -> tuple[Path, Any]:
                path = store.write_store(
                    folder,
                    f"bits-{bits}-{np.random.default_rng().integers(1 << 60)}",
                    {"": scene},
                    {},
                    keepbits=bits,
                )
                return path, store.open_store(path, "").radiance.values

            (path, back), cpu_s, peak_mb = timed(there_and_back)
            size = sum(f.stat().st_size for f in Path(path).rglob("*") if f.is_file()) / 1e6
            points.append(
                Point(
                    f"{bits or 23} bits, {size:.1f} MB",
                    float(np.max(np.abs(back / exact - 1))),
                    cpu_s,
                    peak_mb,
                    "default" if bits == KEEPBITS else "",
                )
            )
    return [
        Work(
            "store",
            "largest relative error of a radiance",
            "the radiance before it was stored",
            0.0,
            points,
        )
    ]


def radiance() -> Any:
    """Return the radiance of a colour chart over six decades, with a grain of 2 % like that of a
    rendering.
    """
    scene = build("scene", "macbeth", width=SIZE[0], height=SIZE[1])().load()
    rng = np.random.default_rng(3)
    grain = rng.normal(1, 0.02, scene.radiance.shape) * 10 ** rng.uniform(
        -6, 0, scene.radiance.shape[-2:]
    )
    return scene.assign(
        radiance=(scene.radiance * grain.astype(np.float32)).assign_attrs(scene.radiance.attrs)
    )

"""Paths per tile of the renderer, per light group, against a long rendering with other random numbers."""

from __future__ import annotations

import numpy as np

from isethdr_core import ledger

from .point import Point, Work, timed

SIZE = {"width": 96, "height": 54}
SAMPLES = (6, 24, 96, 384)
LONG = 3072  # paths per tile of the reference


def measured() -> list[Work]:
    """Return one diagram per light group: luminance-weighted median relative error of a tile's luminance, of tiles above 1 % of the mean."""
    from isethdr_core.registry import build

    scene = build("scene", "night_drive")()
    default = build("renderer", "mitsuba").samples
    build("renderer", "mitsuba", **SIZE, samples=1, seed=98)(scene)  # kernels of the renderer are compiled once
    with ledger.stage(ledger.Ledger(), "reference") as row:
        long = build("renderer", "mitsuba", **SIZE, samples=LONG, seed=99)(scene)
    truth, points = luminance_of(long), {}
    for samples in SAMPLES:
        render = build("renderer", "mitsuba", **SIZE, samples=samples, seed=1)
        found, cpu_s, peak_mb = timed(lambda render=render: render(scene), repeat=1)
        for group, light in luminance_of(found).items():
            points.setdefault(group, []).append(Point(f"{samples} paths", median_error(light, truth[group]), cpu_s, peak_mb,
                                                      "default" if samples == default else ""))
    return [Work(f"renderer {group}", "luminance-weighted median relative error of a tile", f"{LONG} paths per tile, other random numbers",
                 next((e.value for e in row.errors if e.what.endswith(group)), np.nan), of) for group, of in points.items()]


def luminance_of(scene) -> dict:
    """Return {group: luminance in cd/m2 (y, x)}."""
    from isethdr_core.physics.photometry import luminance

    nm = scene.wavelength.values
    return {str(g): luminance(scene.radiance.sel(light_group=g).values.astype(float), nm) for g in scene.light_group.values}


def median_error(found, truth) -> float:
    """Return the relative error below which half of the light lies, over tiles above 1 % of the mean; the unit of the renderer's own estimate."""
    used = truth > 0.01 * truth.mean()
    if not used.any():
        return 0.0
    error, weight = np.abs(found[used] / truth[used] - 1), truth[used]
    order = np.argsort(error)
    below = np.cumsum(weight[order])
    return float(error[order][np.searchsorted(below, below[-1] / 2)])

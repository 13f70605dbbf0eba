"""Paths per tile of the renderer, per light group, against a long rendering with other random
numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_mitsuba import frame
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core import Demand
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.registry import build

from .changed import changed

if TYPE_CHECKING:
    import xarray as xr

SIZE = {"width": 96, "height": 54}
SAMPLES = (6, 24, 96, 384)
LONG = 2048  # paths per tile of the reference
LABELS = frozenset({"instance", "normal", "distance"})
ERROR_OF = "luminance-weighted median relative error of a tile"


def measured() -> list[Work]:
    """Return one diagram per light group: luminance-weighted median relative error of a tile's
    luminance, over the tiles above a tenth of the median tile.

    Tiles that show a lamp or the sky directly are left out, because their light is known without
    paths. Seconds are those of the passes that the group was part of, including the other groups
    in these passes. They exclude the seconds of the scene, which are the same for any number of
    paths.
    """
    long, own_errors, short = rendered()
    truth = luminance_of(long)
    points = {}
    for samples, (rendering, cpu_s, peak_mb) in short.items():
        for k, (group, light) in enumerate(luminance_of(rendering).items()):
            error = median_error(light, truth[group], ~long.source_seen.values[k])
            points.setdefault(group, []).append(
                Point(
                    setting(samples),
                    error,
                    cpu_s * rendering.took[group],
                    peak_mb,
                    "" if samples else "default",
                )
            )
    return [
        Work(
            f"renderer {group}",
            ERROR_OF,
            f"{LONG} paths per tile, other random numbers",
            own_errors[group],
            of,
        )
        for group, of in points.items()
    ]


def setting(samples: int | None) -> str:
    """Return the name of a setting. `samples` is the number of paths per tile; None: paths are
    followed until the noise is low enough.
    """
    return f"{samples} paths" if samples else "to a noise of 0.1"


@lru_cache(maxsize=1)
def rendered() -> tuple[Any, dict[Any, Any], dict[int | None, Any]]:
    """Return (long rendering, {group: its own error}, {samples or None: (rendering, CPU s of its
    paths, peak MB)}). The renderings have labels. They are made once per process.
    """
    sample_counts = (*SAMPLES, None)
    runs = [{"samples": LONG, "seed": 97}, *({"samples": n, "seed": 1} for n in sample_counts)]
    (long, _, _), *short = of_paths(
        build("renderer", "mitsuba", **SIZE),
        build("scene", "night_drive")(),
        runs,
        LABELS,
        repeat=1,
    )
    return long, own_errors(long), dict(zip(sample_counts, short))


def own_errors(scene: xr.Dataset) -> dict:
    """Return {group: `median_error` that follows from the stated noise of each tile, if the noise
    is normally distributed}.
    """
    normal = 0.6745  # median of the absolute value of a normal deviate
    stated_sd = normal * scene.xyz_noise.isel(xyz_channel=1).values  # noise of Y
    return {
        group: median_error(light + noise, light, ~luminance)
        for (group, light), noise, luminance in zip(
            luminance_of(scene).items(), stated_sd, scene.source_seen.values
        )
    }


def of_paths(
    render: Callable[..., Any],
    scene: xr.Dataset,
    runs: Any = ({},),
    labels: frozenset[str] = frozenset(),
    repeat: int = 2,
) -> list[Any]:
    """Return [(scene radiance, CPU s of its paths, peak MB)], one entry for each mapping of `runs`.
    The scene is built once.

    The radiance has the variable `source_seen` (light_group, y, x). It marks tiles where more than
    1 % of the light comes from a directly visible lamp, which needs no paths. With the label
    distance it also marks tiles that show the sky. The first call of each kind compiles kernels, so
    seconds are those of the cheapest of `repeat` calls.

    Parameters
    ----------
    render : renderer.
    scene : description of the scene.
    runs : fields of the renderer that are changed, one mapping for each result.
    labels : labels that the rendering holds.
    repeat : number of repetitions; the cheapest counts.
    """
    plain = frame.estimate
    path_results = []

    def estimate(one_pass: Callable[..., Any], settings: Any, *arguments: Any, **named: Any) -> Any:
        path_results.extend(
            timed(
                lambda run=run: plain(
                    one_pass, replace(render, **run).decided(), *arguments, **named
                ),
                repeat,
            )
            for run in runs
        )
        # a copy, because the renderer adds the light of visible lamps to it in place
        return replace(path_results[-1][0], radiance=path_results[-1][0].radiance.copy())

    with changed(frame, estimate=estimate):
        rendering = render(scene, Demand(labels=labels))
    lamps = rendering.radiance.values - path_results[-1][0].radiance
    # differences this small come from rounding of the radiance, not from lamps
    lamps[lamps < 1e-6 * rendering.radiance.values] = 0.0
    return [
        (with_paths(rendering, paths, lamps), cpu_s, peak_mb)
        for paths, cpu_s, peak_mb in path_results
    ]


def with_paths(scene: xr.Dataset, paths: Any, lamps: Any) -> Any:
    """Return scene radiance with the light of other paths, and with `source_seen`, the tiles that
    show lamps or the sky.

    Parameters
    ----------
    scene : scene radiance of one rendering.
    paths : estimate of the light that needs paths, (light_group, wavelength, y, x).
    lamps : light of directly visible lamps, on the same grid.
    """
    light = paths.radiance + lamps
    lamp = lamps.sum(axis=1)
    source_seen = lamp > 0.01 * light.sum(axis=1)
    if "distance" in scene:
        source_seen |= ~np.isfinite(scene.distance.values)
    with_new_paths = scene.assign(
        radiance=scene.radiance.copy(data=light.astype(np.float32)),
        xyz_noise=scene.xyz_noise.copy(data=paths.xyz_noise.astype(np.float32)),
        source_seen=(("light_group", "y", "x"), source_seen),
    )
    groups = [str(g) for g in scene.light_group.values]
    noise = {g: float(n) for g, n in zip(groups, paths.noise) if np.isfinite(n)}
    # seconds of the passes that a group was part of, over the largest of all groups
    took = {g: float(s) for g, s in zip(groups, paths.seconds / paths.seconds.max())}
    return with_new_paths.assign_attrs(noise=noise, took=took)


def luminance_of(scene: xr.Dataset) -> dict:
    """Return {group: luminance in cd/m2 (y, x)}."""
    nm = scene.wavelength.values
    return {
        str(g): luminance(scene.radiance.sel(light_group=g).values.astype(float), nm)
        for g in scene.light_group.values
    }


def median_error(values: np.ndarray, truth: Any, of: bool = True) -> float:
    """Return the relative error below which half of the light lies.

    A tile counts as at most ten times as bright as the median tile. Otherwise one rare bright path
    of the reference would decide. Tiles below a tenth of the median are left out.

    Parameters
    ----------
    values : (y, x) light under test, any unit.
    truth : (y, x) light of the reference, same unit.
    of : (y, x) bool, tiles that are compared; True: all.
    """
    lit = (truth > 0) & of
    if not lit.any():
        return 0.0
    middle = np.median(truth[lit])
    bright = lit & (truth > 0.1 * middle)
    error = np.abs(values[bright] / truth[bright] - 1)
    weight = np.minimum(truth[bright], 10 * middle)
    order = np.argsort(error)
    below = np.cumsum(weight[order])
    return float(error[order][np.searchsorted(below, below[-1] / 2)])

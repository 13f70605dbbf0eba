"""Fireflies: single tiles that a rendering made far too bright by rare bright paths.

A tile counts where its luminance is more than 8 times the median of the tiles of the same instance
in 5 x 5 around it, and 5 standard deviations of the least noisy camera above that median, and where
a judge does not confirm it. The judge is another rendering of the scene with other random numbers,
asked for a tenth of the noise variance; where its paths reach their limit it has fewer than ten
times as many. It confirms a tile if its own luminance there is at least half as high.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

import isethdr_core as hdr
from isethdr_core.data.quantities import tristimulus
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.runs.radiance_cache import scene_radiance
from isethdr_core.uncertainty.ledger import Ledger

Plane = npt.NDArray[Any]  # (y, x)

TIMES_MEDIAN = 8.0
SIGMAS = 5.0
AROUND = 2  # tiles on each side: 5 x 5
MORE_PATHS = 10.0  # of the judge
CONFIRMED = 0.5  # of a tile's luminance that the judge has to have


class Rendered(NamedTuple):
    """One rendering of the main job's scene under its lighting."""

    luminance: Plane  # cd/m2
    instance: Plane
    sigma: Plane  # of the least noisy camera that looks, cd/m2; infinite where none does


def fireflies(width: int = 160, height: int = 90, overrides: str = "") -> list[dict[str, Any]]:
    """Return one row: how many tiles of the main job's rendering are fireflies.

    Parameters
    ----------
    width, height : tiles of the rendering.
    overrides : further settings of the main job, parted by spaces.

    Returns
    -------
    row with the tiles looked at, those that stand out, those that the judge does not confirm, and
    the largest luminance over that of the judge among those that stand out.
    """
    settings = [f"renderer.width={width}", f"renderer.height={height}", *overrides.split()]
    config = hdr.compose(settings)
    share = float(config.renderer.noise_share_allowed) / MORE_PATHS**0.5
    judging = [
        f"renderer.noise_share_allowed={share}",
        f"renderer.seed={int(config.renderer.seed) + 1}",
    ]
    ours = rendered(config)
    judge = rendered(hdr.compose([*settings, *judging]))
    out = standing_out(ours)
    alone = out & (judge.luminance < CONFIRMED * ours.luminance)
    ratio = ours.luminance[out] / np.maximum(judge.luminance[out], np.finfo(float).tiny)
    return [
        {
            "scene": str(config.scene.name),
            "tiles": int(np.isfinite(ours.sigma).sum()),
            "standing_out": int(out.sum()),
            "fireflies": int(alone.sum()),
            "largest_over_judge": float(ratio.max(initial=0.0)),
        }
    ]


def rendered(config: Any) -> Rendered:
    """Return the rendering of a config, from its store where there is one."""
    built = chain(config)
    rows = Ledger()
    demand = plan(built, rows)
    scene, _ = scene_radiance(built, demand, rows, config)
    mixed = built.lighting(scene)
    luminance = tristimulus(mixed)["xyz"].values[..., 1]
    sigma = demand.noise_limit(scene).xyz[1]
    return Rendered(luminance, scene["instance"].values, sigma)


def standing_out(one: Rendered) -> npt.NDArray[np.bool_]:
    """Return the tiles (y, x) that stand out of those of their instance around them."""
    median = median_around(one.luminance, one.instance)
    return (one.luminance > TIMES_MEDIAN * median) & (one.luminance > median + SIGMAS * one.sigma)


def median_around(values: Plane, instance: Plane) -> Plane:
    """Return the median (y, x) of the tiles of the same instance in 5 x 5 around each tile."""
    rows, columns = values.shape
    side = range(2 * AROUND + 1)
    padded = np.pad(values.astype(float), AROUND, constant_values=np.nan)
    same = np.pad(instance.astype(np.int64), AROUND, constant_values=-1)
    around = np.stack(
        [
            np.where(
                same[y : y + rows, x : x + columns] == instance,
                padded[y : y + rows, x : x + columns],
                np.nan,
            )
            for y in side
            for x in side
        ]
    )
    return np.asarray(np.nanmedian(around, axis=0))

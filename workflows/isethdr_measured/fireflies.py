"""Fireflies: single tiles of a rendering that rare bright paths make far too bright.

A tile stands out if its luminance is more than 8 times the median of the tiles of the same instance
in the 5 x 5 tiles around it, and more than 5 standard deviations of the least noisy camera above
that median. A second rendering, the check, follows paths through these tiles alone, with other
random numbers and ten times the largest number of paths that a tile of the first rendering may
have. It confirms a tile if its own luminance there is at least half as high. A tile that stands out
and is not confirmed is a firefly.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from isethdr_mitsuba.paths.by_need.fireflies import median_around
from isethdr_mitsuba.paths.by_need.rounds import Rounds, render_by_need

from .job_paths import JobPaths, job_paths

Plane = npt.NDArray[Any]  # (y, x)

TIMES_MEDIAN = 8.0  # least luminance of a tile that stands out, over the median around it
SIGMAS = 5.0  # least distance from that median, standard deviations of the least noisy camera
MORE_PATHS = 10  # paths of the judge, over the largest number that a tile of the rendering may have
JUDGE_SEED = 77_000
CONFIRMED = 0.5  # least luminance by the judge, over that of the rendering, of a confirmed tile


class Rendered(NamedTuple):
    """One rendering of the main job's scene under its lighting."""

    luminance: Plane  # cd/m2
    instance: Plane
    # noise of the least noisy camera that sees the tile, cd/m2; infinite where no camera does
    sigma: Plane


def fireflies(width: int = 160, height: int = 90, overrides: str = "") -> list[dict[str, Any]]:
    """Return one row: how many tiles of the main job's rendering are fireflies.

    Parameters
    ----------
    width, height : tiles of the rendering.
    overrides : further settings of the main job, separated by spaces.

    Returns
    -------
    one row with the number of tiles that a camera sees, of those that stand out, and of those among
    the latter that the judge does not confirm; the judge's paths per tile; and, over the tiles that
    stand out, the largest ratio of the rendering's luminance to the judge's.
    """
    size = [f"renderer.width={width}", f"renderer.height={height}"]
    job = job_paths([*size, *overrides.split()])
    ours, weight = rendered(job)
    out = standing_out(ours)
    paths = MORE_PATHS * int(job.renderer.most_samples)
    tiles = np.flatnonzero(out)
    light = job.of_tiles(JUDGE_SEED, tiles, paths) + job.layer[:, :, tiles]
    judge = weight @ job.luminance(light)
    alone = judge < CONFIRMED * ours.luminance[out]
    ratio = ours.luminance[out] / np.maximum(judge, np.finfo(float).tiny)
    return [
        {
            "tiles": int(np.isfinite(ours.sigma).sum()),
            "standing_out": len(tiles),
            "fireflies": int(alone.sum()),
            "judge_paths": paths,
            "largest_over_judge": float(ratio.max(initial=0.0)),
        }
    ]


def rendered(job: JobPaths) -> tuple[Rendered, npt.NDArray[np.float64]]:
    """Return a rendering of a job with as many paths as its cameras need, and the weights (group,)
    of the light groups in it.
    """
    settings = job.renderer
    rounds = Rounds(
        job.paths,
        job.instance,
        settings.seed,
        most=settings.most_samples,
        in_field=job.view.in_field(),
    )
    render_by_need(rounds, job.limit, settings.limit_share())
    radiance = rounds.radiance()
    limit = job.limit(radiance)
    weight = np.array([limit.weights.get(group, 0.0) for group in job.groups])
    luminance = weight @ job.luminance(radiance + job.layer)
    shape = job.view.shape
    return Rendered(luminance.reshape(shape), job.instance, limit.xyz[1].reshape(shape)), weight


def standing_out(one: Rendered) -> npt.NDArray[np.bool_]:
    """Return a mask (y, x) of the tiles that stand out from the tiles of their instance around
    them.
    """
    rows, columns = (index.ravel() for index in np.indices(one.luminance.shape))
    median = median_around(one.luminance, one.instance, rows, columns)
    median = median.reshape(one.luminance.shape)
    return (one.luminance > TIMES_MEDIAN * median) & (one.luminance > median + SIGMAS * one.sigma)

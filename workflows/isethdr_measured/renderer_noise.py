"""The noise of renderings that go by the cameras: what is stated, what is true, and what it costs;
and the light of each group against even passes.

Renderings of a scene with other random numbers differ by their true noise. The stated noise is that
of each tile, as stored (`xyz_noise`). Both are shares of the noise of the least noisy camera that
looks, of luminance, in tiles where that is finite.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from isethdr_mitsuba.paths.need_driven import Rounds, render_by_need

from .job_paths import JobPaths, job_paths

Array = npt.NDArray[np.float64]

# the main job, and two scenes under the lighting that each is meant for; in the tunnel no number of
# paths below thousands reaches the noise of the cameras
SCENES = {
    "main": "",
    "tunnel": "scene=tunnel lighting=tunnel scene.seed=11 renderer.most_samples=512",
    "country": "scene=street_country lighting=night_rural",
}
JUDGE_SEED = 500
# least noise by which a tile is weighed, as a share of the mean light of its group
WEIGHT_FLOOR = 0.1


class Rendering(NamedTuple):
    """One rendering under its lighting; luminance in cd/m2."""

    groups: Array  # (group, tile) luminance at weight 1, without lamps seen directly
    noise: Array  # (group, tile), stated
    mixed: Array  # (tile,) luminance
    stated: Array  # (tile,) its stated noise
    limit: Array  # (tile,) noise of the least noisy camera; infinite where none looks
    paths: float  # per tile, mean over the groups
    cpu_s: float  # of the paths alone


def renderer_noise(
    scene: str = "main",
    shares: str = "1.2,0.6,0.3",
    renderings: int = 3,
    width: int = 48,
    overrides: str = "",
) -> list[dict[str, Any]]:
    """Return a row for each share of the cameras' noise that a rendering is asked for.

    Parameters
    ----------
    scene : main, tunnel or country.
    shares : values of `renderer.noise_share_allowed`.
    renderings : with other random numbers, for each share.
    width : tiles across; the height is 9/16 of it.
    overrides : further settings, parted by spaces.

    Returns
    -------
    rows with CPU s of the scene and its tables, CPU s and paths per tile of one rendering; the
    stated noise that 50, 90 and 99 % of the tiles are below; and stated over true at these shares
    of the tiles. For that ratio, normal noise as stated is spread over as many renderings as there
    are, so that both have the scatter of so few. `worst_99` is the ratio of the rendering that is
    farthest from 1 at 99 %.
    """
    job = _job(scene, width, overrides)
    rows = []
    for k, share in enumerate(map(float, shares.split(","))):
        found = [by_need(job, 100 * (k + 1) + seed, share) for seed in range(renderings)]
        rows.append({"scene": scene, "share": share, "tables_s": job.cpu_s, **_quantiles(found)})
    return rows


def renderer_light(
    scene: str = "main",
    renderings: int = 3,
    judges: int = 3,
    samples: int = 512,
    width: int = 48,
    overrides: str = "",
) -> list[dict[str, Any]]:
    """Return a row for each light group: its light where paths follow need, over that of even
    passes.

    Tiles are weighted by the inverse variance that one more rendering states, so that a few glints
    do not decide. Weights do not depend on the light that they weigh.

    Parameters
    ----------
    scene : name of the scene, a key of `SCENES`.
    renderings : renderings that follow need, with other random numbers.
    judges : renderings of even passes, with other random numbers.
    samples : paths per tile of an even pass.
    width : tiles along x; along y there are width * 9 / 16.
    overrides : further overrides of the config, separated by spaces.
    """
    job = _job(scene, width, overrides)
    share = float(job.renderer.limit_share())
    ours = [by_need(job, seed, share).groups for seed in range(renderings)]
    judge = [evenly(job, JUDGE_SEED + seed, samples) for seed in range(judges)]
    weigher = by_need(job, JUDGE_SEED - 1, share)
    rows = []
    for g, group in enumerate(job.groups):
        floor = WEIGHT_FLOOR * weigher.groups[g].mean()
        if not floor > 0:
            continue
        weight = 1 / (weigher.noise[g] ** 2 + floor**2)
        pair = [np.stack([one[g] for one in way]) for way in (ours, judge)]
        sums = [light @ weight for light in pair]
        errors = [v.std(ddof=1) / np.sqrt(len(v)) / v.mean() for v in sums]
        rows.append(
            {
                "scene": scene,
                "group": group,
                "need_over_even": float(sums[0].mean() / sums[1].mean()),
                "standard_error": float(np.hypot(*errors)),
                "unweighted": float(pair[0].mean() / pair[1].mean()),
            }
        )
    return rows


def _job(scene: str, width: int, overrides: str) -> JobPaths:
    """Return a scene at a number of tiles."""
    size = [f"renderer.width={width}", f"renderer.height={width * 9 // 16}"]
    return job_paths([*SCENES[scene].split(), *size, *overrides.split()])


def by_need(job: JobPaths, seed: int, share: float) -> Rendering:
    """Return a rendering that follows paths until the noise is `share` of the cameras'.

    Parameters
    ----------
    job : the scene of a job.
    seed : seed of the paths.
    share : noise at which the renderer stops, over that of the cameras.
    """
    start = time.process_time()
    rounds = Rounds(job.paths, job.instance, seed, 0, job.renderer.most_samples)
    render_by_need(rounds, job.limit, share)
    seconds = time.process_time() - start
    radiance = rounds.radiance()
    limit = job.limit(radiance)
    weight = np.array([limit.weights.get(group, 0.0) for group in job.groups])
    light = job.luminance(radiance)
    noise = rounds.xyz_noise()[:, 1]
    return Rendering(
        light,
        noise,
        weight @ light,
        np.sqrt(np.square(weight) @ np.square(noise)),
        limit.xyz[1].ravel(),
        float(rounds.mean_paths().mean()),
        seconds,
    )


def evenly(job: JobPaths, seed: int, samples: int) -> Array:
    """Return luminance (group, tile) at weight 1 after the same number of paths through each tile.

    Parameters
    ----------
    job : the scene of a job.
    seed : seed of the paths.
    samples : paths per tile.
    """
    every = np.arange(job.instance.size)
    return job.luminance(job.of_tiles(1000 * seed, every, samples))


def _quantiles(found: list[Rendering]) -> dict[str, float]:
    """Return what `renderer_noise` tells of the renderings of one share."""
    limit = np.mean([one.limit for one in found], 0)
    seen = np.isfinite(limit)
    shares = (50, 90, 99)
    relative = lambda values: np.percentile(values[seen] / limit[seen], shares)
    each = [one.stated for one in found]
    true = relative(np.std([one.mixed for one in found], 0, ddof=1))
    rng = np.random.default_rng(1)
    spread = lambda stated: relative(
        np.std([s * rng.standard_normal(limit.shape) for s in stated], 0, ddof=1)
    )
    ratio = spread(each) / true
    single = [spread([one] * len(found))[-1] / true[-1] for one in each]
    stated = np.mean([relative(one) for one in each], 0)
    row = {
        "cpu_s": float(np.mean([one.cpu_s for one in found])),
        "paths": float(np.mean([one.paths for one in found])),
    }
    row |= {f"stated_{s}": float(v) for s, v in zip(shares, stated, strict=True)}
    row |= {f"over_true_{s}": float(v) for s, v in zip(shares, ratio, strict=True)}
    return row | {"worst_99": float(max(single, key=lambda r: abs(np.log(r))))}

"""Noise of renderings that follow as many paths as the cameras need: the stated noise, the true
noise and the cost; and the light of each light group, compared with that of even passes.

The true noise is the scatter of renderings of a scene with different random numbers. The stated
noise is the stored noise of each tile (`xyz_noise`). Both are noise of luminance, and both are
given as shares of the noise of the least noisy camera, in the tiles that a camera sees.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from isethdr_mitsuba.paths.by_need.rounds import Rounds, render_by_need

from .job_paths import JobPaths, job_paths

Array = npt.NDArray[np.float64]

# the main job, and two scenes under the lighting that each is meant for; in the tunnel it takes
# thousands of paths per tile to reach the noise of the cameras
SCENES = {
    "main": "",
    "tunnel": "scene=tunnel lighting=tunnel scene.seed=11 renderer.most_samples=512",
    "country": "scene=street_country lighting=night_rural",
}
JUDGE_SEED = 500
SHARES = 50, 90, 99  # percentiles over the tiles
# largest scatter of an even pass in a tile whose light counts as well known, relative
KNOWN = 0.05


class Rendering(NamedTuple):
    """One rendering under its lighting. Luminance and its noise are in cd/m2."""

    groups: Array  # (group, tile) luminance at weight 1, without directly visible lamps
    noise: Array  # (group, tile) stated noise of `groups`
    mixed: Array  # (tile,) luminance under the lighting
    stated: Array  # (tile,) stated noise of `mixed`
    limit: Array  # (tile,) noise of the least noisy camera; infinite where no camera sees the tile
    paths: float  # paths per tile, mean over the groups
    cpu_s: float  # CPU time of the paths alone


def renderer_noise(
    scene: str = "main",
    shares: str = "1.6,0.8,0.4",
    renderings: int = 8,
    width: int = 48,
    overrides: str = "",
) -> list[dict[str, Any]]:
    """Return a row for each share of the cameras' noise at which a rendering stops.

    Parameters
    ----------
    scene : main, tunnel or country.
    shares : values of `renderer.noise_share_allowed`.
    renderings : number of renderings with different random numbers, for each share.
    width : tiles across; the height is 9/16 of it.
    overrides : further settings, separated by spaces.

    Returns
    -------
    rows with CPU s of the scene and its tables, CPU s and paths per tile of one rendering; the 50,
    90 and 99 % quantiles of the stated noise over the tiles; and these quantiles over those of the
    true noise. For the ratio, the stated noise is replaced by the scatter of as many simulated
    renderings with normal noise of that size, because the scatter of few renderings is itself
    uncertain. `error_99` is the standard error of the ratio at 99 %, from leaving out each
    rendering in turn (jackknife: Efron 1982). `worst_99` is the ratio at 99 % of the rendering for
    which it is farthest from 1.
    """
    job = _job(scene, width, overrides)
    rows = []
    for k, share in enumerate(map(float, shares.split(","))):
        found = [by_need(job, 100 * (k + 1) + seed, share) for seed in range(renderings)]
        rows.append({"scene": scene, "share": share, "tables_s": job.cpu_s, **_quantiles(found)})
    return rows


def renderer_light(
    scene: str = "main",
    renderings: int = 12,
    judges: int = 8,
    samples: int = 1024,
    width: int = 48,
    overrides: str = "",
) -> list[dict[str, Any]]:
    """Return a row for each light group: its light by adaptive sampling, over that of even passes.

    The light is that before rare light is moved to other tiles, which keeps its sum. Two ratios are
    given: that of all light, in which a few glints count most, and that of the tiles whose light
    the even passes know well. These tiles are chosen by other even passes than those that judge.

    Parameters
    ----------
    scene : name of the scene, a key of `SCENES`.
    renderings : number of adaptive renderings, with different random numbers.
    judges : number of renderings by even passes, with different random numbers. Half of them choose
        the tiles.
    samples : paths per tile of an even pass.
    width : tiles along x; along y there are width * 9 / 16.
    overrides : further overrides of the config, separated by spaces.

    Returns
    -------
    rows with scene, group, need_over_even (ratio of the sums of all tiles), standard_error of that
    ratio; known_share (share of the light that lies in tiles with a standard error of an even pass
    of at most `KNOWN`), known_need_over_even and known_standard_error for these tiles.
    """
    job = _job(scene, width, overrides)
    share = float(job.renderer.limit_share())
    ours = np.stack([_unmoved(job, seed, share) for seed in range(renderings)])
    even = np.stack([evenly(job, JUDGE_SEED + seed, samples) for seed in range(judges)])
    choosing = even[::2]
    judge = even[1::2]
    rows = []
    for g, group in enumerate(job.groups):
        mean = choosing[:, g].mean(0)
        if not mean.any():
            continue
        known = (mean > 0) & (choosing[:, g].std(0, ddof=1) <= KNOWN * mean)
        every = _ratio(ours[:, g], judge[:, g])
        of_known = _ratio(ours[:, g][:, known], judge[:, g][:, known])
        rows.append(
            {
                "scene": scene,
                "group": group,
                "need_over_even": every[0],
                "standard_error": every[1],
                "known_share": float(mean[known].sum() / mean.sum()),
                "known_need_over_even": of_known[0],
                "known_standard_error": of_known[1],
            }
        )
    return rows


def _ratio(ours: Array, judge: Array) -> tuple[float, float]:
    """Return the ratio of the light of renderings (rendering, tile) and its standard error."""
    sums = [light.sum(1) for light in (ours, judge)]
    errors = [v.std(ddof=1) / np.sqrt(len(v)) / v.mean() for v in sums]
    return float(sums[0].mean() / sums[1].mean()), float(np.hypot(*errors))


def _unmoved(job: JobPaths, seed: int, share: float) -> Array:
    """Return luminance (group, tile) of adaptive sampling, before rare light is moved away."""
    rounds = _rounds(job, seed)
    rounds.pilot()
    rounds.until_done(job.limit(rounds.radiance()), share)
    return job.luminance(rounds.radiance())


def _job(scene: str, width: int, overrides: str) -> JobPaths:
    """Return the paths of a scene with `width` tiles across."""
    size = [f"renderer.width={width}", f"renderer.height={width * 9 // 16}"]
    return job_paths([*SCENES[scene].split(), *size, *overrides.split()])


def by_need(job: JobPaths, seed: int, share: float) -> Rendering:
    """Return a rendering that follows paths until its noise is `share` of the cameras' noise.

    Parameters
    ----------
    job : the scene of a job.
    seed : seed of the paths.
    share : noise at which the renderer stops, over that of the cameras.
    """
    start = time.process_time()
    rounds = _rounds(job, seed)
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


def _rounds(job: JobPaths, seed: int) -> Rounds:
    """Return the buffers of an adaptive rendering, still without paths."""
    return Rounds(
        job.paths,
        job.instance,
        seed,
        most=job.renderer.most_samples,
        in_field=job.view.in_field(),
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
    """Return the figures of `renderer_noise` for the renderings of one share."""
    limit = np.mean([one.limit for one in found], 0)
    each = np.array([one.stated for one in found])
    mixed = np.array([one.mixed for one in found])
    normal = np.random.default_rng(1).standard_normal(each.shape)
    ratio, error_99 = stated_over_true(each * normal, mixed, limit)
    single = [stated_over_true(one * normal, mixed, limit)[0][-1] for one in each]
    stated = np.mean([_percentiles(one, limit) for one in each], 0)
    row = {
        "cpu_s": float(np.mean([one.cpu_s for one in found])),
        "paths": float(np.mean([one.paths for one in found])),
    }
    row |= {f"stated_{s}": float(v) for s, v in zip(SHARES, stated, strict=True)}
    row |= {f"over_true_{s}": float(v) for s, v in zip(SHARES, ratio, strict=True)}
    row["error_99"] = error_99
    return row | {"worst_99": float(max(single, key=lambda r: abs(np.log(r))))}


def stated_over_true(simulated: Array, mixed: Array, limit: Array) -> tuple[Array, float]:
    """Return the ratio of stated to true noise at the percentiles `SHARES` of the tiles, and the
    standard error of the last one by the jackknife (Efron 1982), NaN for fewer than three
    renderings.

    Parameters
    ----------
    simulated : (rendering, tile) normal noise of the stated size.
    mixed : (rendering, tile) luminance; its scatter is the true noise.
    limit : (tile,) noise of the least noisy camera; infinite where no camera sees the tile.
    """

    def ratio(chosen: npt.NDArray[np.bool_]) -> Array:
        stated, true = (
            _percentiles(values[chosen].std(0, ddof=1), limit) for values in (simulated, mixed)
        )
        return stated / true

    count = len(mixed)
    every = ratio(np.ones(count, bool))
    if count < 3:
        return every, float("nan")
    without_one = [ratio(np.arange(count) != k)[-1] for k in range(count)]
    return every, float(np.std(without_one) * np.sqrt(count - 1))


def _percentiles(noise: Array, limit: Array) -> Array:
    """Return the percentiles `SHARES` of noise (tile,) over `limit` (tile,), in the tiles that a
    camera sees.
    """
    seen = np.isfinite(limit)
    return np.percentile(noise[seen] / limit[seen], SHARES)

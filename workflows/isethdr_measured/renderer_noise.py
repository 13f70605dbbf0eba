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

import isethdr_core as hdr
from isethdr_core.data.quantities import tristimulus
from isethdr_core.pipeline.chain import chain, plan
from isethdr_core.runs.radiance_cache import scene_radiance
from isethdr_core.uncertainty.ledger import Ledger

Array = npt.NDArray[np.float64]

# the main job, and two scenes under the lighting that each is meant for
SCENES = {
    "main": "",
    "tunnel": "scene=tunnel lighting=tunnel scene.seed=11",
    "country": "scene=street_country lighting=night_rural",
}
JUDGE_SEED = 500
WEIGHT_FLOOR = 0.1  # of a group's mean light: no tile weighs as if it were noisier by less


class Rendering(NamedTuple):
    """One rendering under its lighting; luminance in cd/m2."""

    mixed: Array  # (y, x) luminance
    stated: Array  # (y, x) its stated noise
    limit: Array  # (y, x) noise of the least noisy camera; infinite where none looks
    groups: dict[str, Array]  # {light group: (y, x)} at weight 1
    noise: dict[str, Array]  # {light group: (y, x)}, stated
    paths: float  # per tile, mean over the groups
    cpu_s: float  # scene, tables and paths


def renderer_noise(
    scene: str = "main",
    shares: str = "1.2,0.6,0.3",
    renderings: int = 4,
    width: int = 96,
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
    rows with CPU s and paths per tile of one rendering; the stated noise that 50, 90 and 99 % of
    the tiles are below; and stated over true at these shares of the tiles. For that ratio, normal
    noise as stated is spread over as many renderings as there are, so that both have the scatter
    of so few. `worst` is the ratio of the rendering that is farthest from 1 at 99 %.
    """
    rows = []
    for k, share in enumerate(map(float, shares.split(","))):
        settings = [f"renderer.noise_share_allowed={share}"]
        found = [
            rendered([*_settings(scene, width, overrides), *settings], 100 * (k + 1) + seed)
            for seed in range(renderings)
        ]
        rows.append({"scene": scene, "share": share, **_quantiles(found)})
    return rows


def renderer_light(
    scene: str = "main",
    renderings: int = 4,
    judges: int = 4,
    samples: int = 1024,
    width: int = 64,
    overrides: str = "",
) -> list[dict[str, Any]]:
    """Return a row for each light group: its light where paths follow need, over that of even
    passes of `samples` paths per tile (`judges` of them, with other random numbers).

    Tiles are weighted by the inverse variance that one more even pass states, so that a few glints
    do not decide. Weights do not depend on the light that they weigh.
    """
    base = _settings(scene, width, overrides)
    ours = [rendered(base, seed) for seed in range(renderings)]
    even = [f"renderer.samples={samples}"]
    long = [rendered([*base, *even], JUDGE_SEED + seed) for seed in range(judges)]
    weigher = rendered([*base, f"renderer.samples={samples // 4}"], JUDGE_SEED - 1)
    rows = []
    for group, light in weigher.groups.items():
        floor = WEIGHT_FLOOR * light.mean()
        if not floor > 0:
            continue
        weight = 1 / (weigher.noise[group] ** 2 + floor**2)
        sums = [
            np.array([(one.groups[group] * weight).sum() for one in way]) for way in (ours, long)
        ]
        ratio = sums[0].mean() / sums[1].mean()
        errors = [s.std(ddof=1) / np.sqrt(len(s)) / s.mean() for s in sums]
        plain = [np.mean([one.groups[group].sum() for one in way]) for way in (ours, long)]
        rows.append(
            {
                "scene": scene,
                "group": group,
                "need_over_even": float(ratio),
                "standard_error": float(np.hypot(*errors)),
                "unweighted": float(plain[0] / plain[1]),
            }
        )
    return rows


def _settings(scene: str, width: int, overrides: str) -> list[str]:
    """Return the overrides of a scene at a number of tiles."""
    size = [f"renderer.width={width}", f"renderer.height={width * 9 // 16}"]
    return [*SCENES[scene].split(), *size, *overrides.split()]


def rendered(overrides: list[str], seed: int) -> Rendering:
    """Return a rendering with the random numbers of `seed`."""
    config = hdr.compose([*overrides, f"renderer.seed={seed}"])
    built = chain(config)
    rows = Ledger()
    demand = plan(built, rows)
    start = time.process_time()
    scene, _ = scene_radiance(built, demand, rows, config)
    seconds = time.process_time() - start
    groups = [str(g) for g in scene["light_group"].values]
    limit = demand.noise_limit(scene)
    noise = {g: scene["xyz_noise"].sel(light_group=g).values[1].astype(float) for g in groups}
    square = sum(np.square(limit.weights.get(g, 0.0) * noise[g]) for g in groups)
    luminance = tristimulus(scene["radiance"])["xyz"].sel(xyz_channel="Y").values.astype(float)
    spans = scene.attrs["path_span"].values()
    return Rendering(
        tristimulus(built.lighting(scene))["xyz"].values[..., 1].astype(float),
        np.sqrt(square),
        limit.xyz[1],
        dict(zip(groups, luminance, strict=True)),
        noise,
        float(np.mean([last - first for first, last in spans])),
        seconds,
    )


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

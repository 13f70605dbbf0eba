"""Score errors: how far the renderer's own noise moves the scores of a picture, by finite differences.

The noise moves the truth and the picture together, so both are changed by one standard deviation of it, tile by tile with other
random signs and sizes, and the metrics are asked again. The electrons that flares bring are left: noise has averaged out in them.
"""

from __future__ import annotations

import math

import numpy as np

from . import ledger
from .ledger import Ledger
from .light_in_time import time_mean
from .physics.photometry import xyz_weights
from .scene_noise import relative_noise
from .truth import seen

CHANGES = 2  # of the scene: each asks all metrics once more, an eighth of what four draws take
TIMES = 4  # standard deviations that a change is at most: light is never negative


def state(camera, scores, metrics, mixed, scene, count: int = CHANGES) -> None:
    """State in the ledger the rms change of the scores of a whole picture, each in its unit, over `count` changes of the scene.

    Parameters
    ----------
    camera : `pipeline.Camera`. `scores` : of its picture. `metrics` : as the run asks them.
    mixed, scene : the light, and the scene with its noise, tile by tile; without it nothing is stated.
    """
    mixed, metrics = time_mean(mixed), list(metrics)
    noise = relative_noise(scene, mixed)
    if noise is None or not metrics:  # how little is known of the noise is said of the picture
        return
    noise = noise[1]  # of luminance: what a picture's pixels are changed by, whatever their colour
    level = sum(w * band for w, band in zip(xyz_weights(mixed.wavelength.values)[1], mixed.values))
    true = seen(level, mixed, camera.picture)
    before = {_name(s): s.value for s in scores if not s.object}
    squares: dict[tuple, list[float]] = {}
    for draw in range(count):
        random = np.random.default_rng([draw, 20260])  # of its own: the shot's noise must not depend on whether scores are asked for
        change = level * noise * np.clip(random.standard_normal(noise.shape), -TIMES, TIMES)
        apart = seen(np.maximum(level + change, 0.0) - level, mixed, camera.picture)[..., None]
        share = apart / np.where(true > 0, true, 1.0)[..., None]
        apart = share * camera.truth["xyz"].values
        moved = [data.assign(xyz=data["xyz"].copy(data=data["xyz"].values + apart)) for data in (camera.picture, camera.truth)]
        for s in _ask(metrics, *moved, camera.labels):
            if math.isfinite(s.value - before.get(_name(s), math.nan)):
                squares.setdefault(_name(s), []).append((s.value - before[_name(s)]) ** 2)
    for (metric, unit, _), found in squares.items():
        rms = math.sqrt(math.fsum(found) / len(found))
        ledger.error(rms, unit or "1", "statistical", f"score {metric}: renderer, {len(found)} changes of the scene")


def _name(score):
    return score.metric, score.unit, score.object


def _ask(metrics, picture, truth, labels):
    with ledger.stage(Ledger(), "scores"):  # what they state of a changed scene is no news
        return [score for metric in metrics for score in metric(picture, truth, labels) if not score.object]

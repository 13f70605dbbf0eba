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

CHANGES = 10  # of the scene: nine times of ten their rms is right within a factor of 1.5, as far as scores follow light linearly
SURE = 0.9  # share of runs for which that factor holds


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
    spread = np.sqrt(np.log1p(noise**2))  # light is never negative, and what few paths bring is skew: log-normal, of that mean and deviation
    true = seen(level, mixed, camera.picture)
    before = {_name(s): s.value for s in scores if not s.object}
    asked = [(metric, _labels(metric, camera, before)) for metric in metrics]
    squares: dict[tuple, list[float]] = {}
    for draw in range(count):
        random = np.random.default_rng([draw, 20260])  # of its own: the shot's noise must not depend on whether scores are asked for
        change = level * np.expm1(spread * random.standard_normal(noise.shape) - spread**2 / 2)
        apart = seen(change, mixed, camera.picture)[..., None]
        share = apart / np.where(true > 0, true, 1.0)[..., None]
        apart = share * camera.truth["xyz"].values
        moved = [data.assign(xyz=data["xyz"].copy(data=data["xyz"].values + apart)) for data in (camera.picture, camera.truth)]
        found = [_ask(metric, *moved, labels) for metric, labels in asked]
        asked = [one for one, own in zip(asked, found) if own]  # a metric that speaks of objects alone is asked once
        for s in (s for own in found for s in own):
            if math.isfinite(s.value - before.get(_name(s), math.nan)):
                squares.setdefault(_name(s), []).append((s.value - before[_name(s)]) ** 2)
    for (metric, unit, _), found in squares.items():
        rms = math.sqrt(math.fsum(found) / len(found))
        ledger.error(rms, unit or "1", "statistical", f"score {metric}: renderer, {len(found)} changes of the scene, right within a factor of "
                     f"{known_within(len(found)):.1f}")


def _labels(metric, camera, before):
    """Return labels without any object where the whole picture's scores are the same with them: objects cost most of the time."""
    if camera.labels is None or "instance" not in camera.labels:
        return camera.labels
    bare = camera.labels.assign(instance=camera.labels["instance"] * 0)
    found = _ask(metric, camera.picture, camera.truth, bare)
    same = found and all(np.array_equal(s.value, before.get(_name(s), math.inf), equal_nan=True) for s in found)
    return bare if same else camera.labels


def known_within(count: int) -> float:
    """Return the factor within which the rms of `count` normal changes is their standard deviation, `SURE` of the times: a chi-squared share."""
    from scipy.special import gammainc

    low, high = 1.0, 100.0
    for _ in range(40):
        factor = math.sqrt(low * high)
        share = gammainc(count / 2, count * factor**2 / 2) - gammainc(count / 2, count / factor**2 / 2)
        low, high = (factor, high) if share < SURE else (low, factor)
    return high


def _name(score):
    return score.metric, score.unit, score.object


def _ask(metric, picture, truth, labels):
    with ledger.stage(Ledger(), "scores"):  # what they state of a changed scene is no news
        return [score for score in metric(picture, truth, labels) if not score.object]

"""Score errors: how far the renderer's own noise moves the scores of a picture, shift and scatter,
by changes of the scene.

A renderer says by how much the light that either half of its paths found differs from their mean. A
changed scene shows the light of one half or the other in each tile, by lot (the wild bootstrap: Wu
1986), and goes through sensor and image processing again, with the same noise of the sensor; the
truth is changed alike. What of the light was spread stays: noise has averaged out in it. A score
that is the mean of the scores of a picture's parts is asked of some parts, each a sample of its
own; every other one of the whole picture, again and again. One more scene has its noise smoothed
away: it tells how far noise has shifted a score already.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.special import gammainc

from ..data.derived_once import shared, values_only
from ..data.reference_picture import seen
from ..data.temporal_modulation import time_mean
from ..plugins.protocols import HasMeanOfParts
from . import ledger
from .error_terms import ErrorTerm, Quantity, Source
from .ledger import LeftOut
from .render_noise import (
    NOISE,
    direct_share,
    luminance_cd_m2,
    on_light,
    relative_halves,
    smoothing_change,
)
from .score_intervals import NOT_MEASURED, RendererError, ScoreKey, key_of

RENDERER = "renderer"  # key of the terms
RENDERED = "rendered_s"  # attribute of scenes that a renderer made
CHANGES = 6  # of the scene, for scores of whole pictures
SURE = 0.9  # share of runs for which the stated factor holds
FEW_TILES = (
    8  # that a score may rest on: each knows its own noise from one difference of half buffers
)
SIDE = (
    3  # a picture is cut into SIDE x SIDE parts, a third of which is asked of each of three changes
)
# pixels: side of the pieces that make up a part, at least. Their seams are no part of the scene;
# windows of metrics are about 10 wide
BLOCK = 48


@dataclass(frozen=True)
class ScoreErrors:
    """The error that the renderer's noise leaves in each score, and what the ledger says of it."""

    errors: dict[ScoreKey, RendererError] = field(default_factory=dict)
    terms: tuple[ErrorTerm, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


def of_scores(
    camera, scores, metrics, mixed, scene, light, again, count: int = CHANGES
) -> ScoreErrors:
    """Return the error that the scene's noise leaves in each score, in its unit.

    Parameters
    ----------
    camera : `pipeline.Camera`. `scores` : of its picture. `metrics` : as the run asks them; one
        whose class says `MEAN_OF_PARTS = True` has scores of the frame that need no labels and are,
        nearly, means of those of the picture's parts.
    mixed, scene : the light, and the scene with what halves of its paths differ by, tile by tile;
        without it nothing is stated.
    light : that the camera saw, on the sensor plane. `again` : function(light) -> picture, with the
        same noise of the sensor.
    count : changes of the scene, for metrics of whole pictures.

    Returns
    -------
    The error of each score; none where the scene stores no half buffers. It is `NOT_MEASURED` for a
    score that the smoothed scene lacks, or all but one of the changed scenes. It has scores of
    objects where the picture is too small to be cut into parts.
    """
    mixed, metrics = time_mean(mixed), list(metrics)
    apart = relative_halves(scene, mixed)
    if apart is None or not metrics:
        if metrics and (NOISE in scene or RENDERED in scene.attrs):
            why = "the scene has no half buffers: the intervals hold the noise realisations only"
            return ScoreErrors(left_out=(LeftOut("renderer noise in scores", why, math.inf, "1"),))
        return ScoreErrors()
    parts = _parts(camera.truth)
    of_parts = [metric for metric in metrics if parts and _is_mean_of_parts(metric)]
    of_whole = [metric for metric in metrics if metric not in of_parts]
    pair_of = _camera_of_changes(camera, mixed, light, again)
    moved, samples = {}, {}
    smoothed: dict[ScoreKey, list[float]] = {}
    few = _with_one_object(camera.labels) if parts else camera.labels
    with shared(few):
        if parts:
            whole = _of_whole(of_whole, camera, scores, few)
        else:
            whole = [(metric, camera.labels, _values(scores)) for metric in of_whole]
        for k in range(max(SIDE * bool(of_parts), count * bool(whole))):
            pair = pair_of(_by_lot(apart, k))
            for part in parts[k] if of_parts and k < SIDE else ():
                _add(
                    samples,
                    *(
                        _of_part(of_parts, *both, part)
                        for both in (pair, (camera.picture, camera.truth))
                    ),
                )
            if k < count:
                _add_moves(moved, pair, whole, objects=not parts)
        pair = pair_of(smoothing_change(apart, luminance_cd_m2(mixed)))
        every = [*whole, *((metric, None, _before(scores)) for metric in of_parts)]
        _add_moves(smoothed, pair, every, objects=not parts)
    left_out, terms = [], []
    if parts and any(score.object for score in scores):
        why = (
            "objects of large pictures are not measured again: their intervals hold the noise"
            " realisations only"
        )
        left_out.append(LeftOut("renderer noise in scores of objects", why, math.inf, "1"))
    for (name, unit, _), found in samples.items():
        how = f"changes of {len(found)} parts of the picture"
        terms += _terms(name, unit, *_of_frame(np.array(found)), how, len(found) - 1)
    for (name, unit, of_object), found in moved.items():
        if not of_object:
            rms, shift = math.sqrt(np.mean(np.square(found))), float(np.mean(found))
            how = f"{len(found)} changes of the scene"
            terms += _terms(name, unit, rms, shift, how, len(found))
    asked = {key_of(score) for score in scores if not (parts and score.object)}
    measured = _errors(samples, smoothed, SIDE) | _errors(moved, smoothed)
    errors = dict.fromkeys(asked, NOT_MEASURED) | measured
    return ScoreErrors(errors, tuple(terms), tuple(left_out))


def _is_mean_of_parts(metric) -> bool:
    return isinstance(metric, HasMeanOfParts) and metric.MEAN_OF_PARTS


def known_within(count: int) -> float:
    """Return the factor within which the rms of `count` normal changes is their standard deviation,
    `SURE` of the times: a chi-squared share.
    """
    from scipy.optimize import brentq

    def share_beyond(factor: float) -> float:
        low, high = gammainc(count / 2, np.array([factor**-2, factor**2]) * count / 2)
        return float(high - low) - SURE

    return brentq(
        share_beyond, 1.0, 100.0
    )  # the share rises from 0; with one change it is 0.99 at 100


def _camera_of_changes(camera, mixed, light, again):
    """Return a function that gives (picture, truth) of a scene whose luminance changes by a
    relative `change` (y, x) in all its colours.
    """
    level = luminance_cd_m2(mixed)
    true, xyz, straight = (
        seen(level, mixed, camera.picture),
        camera.truth["xyz"],
        direct_share(light, mixed),
    )

    def pair(change):
        share = seen(change * level, mixed, camera.picture) / np.where(true > 0, true, 1.0)
        factor = 1 + straight * on_light(change.astype(np.float32), mixed, light)
        changed = light.copy(data=light.values * factor.astype(light.dtype))
        # the terms of a changed scene are those of the scene, which have been recorded
        picture = ledger.collected(lambda: again(changed)).result
        return picture, camera.truth.assign(xyz=xyz.copy(data=xyz.values * (1 + share[..., None])))

    return pair


def _by_lot(apart, draw: int):
    """Return the change (y, x) that shows one half buffer or the other in each tile, by lot."""
    random = np.random.default_rng(
        [draw, 20260]
    )  # of its own: the shot's noise must not depend on whether scores are asked for
    return np.where(random.random(apart.shape) < 0.5, apart, -apart)


def _parts(picture) -> list[list[dict]]:
    """Return indices {y, x} of the parts that a picture is cut into, in three lists that each have
    some of all rows and columns; none of a small one.

    A part holds pieces from all over the picture, so that it is like the whole, and each is large
    enough to look like a picture itself.
    """
    cuts = {}
    for d in ("y", "x"):
        pieces = picture.sizes[d] // (SIDE * BLOCK)
        if pieces < 2:
            return []
        strips = np.array_split(np.arange(picture.sizes[d]), SIDE * pieces)
        cuts[d] = [np.concatenate(strips[k::SIDE]) for k in range(SIDE)]
    return [
        [{"y": cuts["y"][k], "x": cuts["x"][(k + shift) % SIDE]} for k in range(SIDE)]
        for shift in range(SIDE)
    ]


def _of_part(metrics, picture, truth, part):
    picture, truth = picture.isel(part), truth.isel(part)
    with shared(truth):
        return _values(score for metric in metrics for score in _ask(metric, picture, truth, None))


def _of_frame(found) -> tuple[float, float]:
    """Return (rms error, mean shift) of the frame's score from changes of that of its parts, each
    with noise of its own.

    Parts scatter more than the frame, the mean of all of them; their shift is its own.
    """
    if len(found) < 2:
        return abs(float(found[0])), 0.0
    shift = _shift(found)
    return math.hypot(float(found.std(ddof=1)) / SIDE, shift), shift


def _shift(found) -> float:
    """Return what the mean of changes is more than its own scatter."""
    mean = float(found.mean())
    return math.copysign(math.sqrt(max(mean**2 - float(found.var(ddof=1)) / len(found), 0.0)), mean)


def _errors(changes, smoothed, parts_across: int = 1) -> dict[ScoreKey, RendererError]:
    """Return the error of each score that at least two changed scenes and the smoothed scene have.

    `parts_across` : the parts that each change belongs to, along one side of the frame. Parts
        scatter more than the frame by that.

    The variance is the product of two estimates, over the changes and over the tiles that the score
    rests on: their relative variances, 2 over the degrees of freedom of each, add up.
    """
    errors = {}
    for key in changes.keys() & smoothed.keys():
        found = np.array(changes[key])
        if len(found) > 1:
            standard_error = float(found.std(ddof=1)) / parts_across
            freedom = 1 / (1 / (len(found) - 1) + 1 / FEW_TILES)
            errors[key] = RendererError(standard_error, freedom, _shift(found), *smoothed[key])
    return errors


def _before(scores) -> dict[ScoreKey, float]:
    """Return the scores of the whole picture before any change."""
    return _values(score for score in scores if not score.object)


def _of_whole(metrics, camera, scores, few) -> list[tuple]:
    """Return (metric, labels, scores before) of metrics that say something of the whole picture.

    Labels are `few`, those with one object only, where the picture's scores are the same with them:
    objects cost most of the time.
    """
    before, out = _before(scores), []
    for metric in metrics:
        labels = few
        found = _ask(metric, camera.picture, camera.truth, labels)
        if not all(
            np.array_equal(s.value, before.get(key_of(s), math.inf), equal_nan=True) for s in found
        ):
            labels = camera.labels
        if found:  # one that speaks of objects alone is asked no more
            out.append((metric, labels, before))
    return out


def _with_one_object(labels):
    if labels is None or "instance" not in labels:
        return labels
    instance = labels["instance"]
    first = instance.values[instance.values > 0].min(initial=np.iinfo(instance.dtype).max)
    return labels.assign(instance=instance * (instance == first))


def _add_moves(found, pair, asked, objects: bool) -> None:
    """Add to `found` by how much the scores of a changed picture and truth differ from those
    before.
    """
    _, truth = pair
    with shared(truth):
        for metric, labels, before in asked:
            _add(found, _values(_ask(metric, *pair, labels, objects)), before)


def _add(found, after, before) -> None:
    """Add to `found` by how much scores differ from those before; what has no number on either side
    tells nothing.
    """
    for name, value in after.items():
        if math.isfinite(value - before.get(name, math.nan)):
            found.setdefault(name, []).append(value - before[name])


def _terms(name, unit, rms, shift, how, free) -> list[ErrorTerm]:
    """Return the term of one score, none where nothing is known of it (`free` degrees of
    freedom).
    """
    if free <= 0:
        return []
    side = f", of it {shift:.2g} to one side" if shift else ""
    label = (
        f"score {name}: renderer{side}, by {how}, right within a factor of {known_within(free):.1f}"
    )
    source = Source(key=RENDERER)
    return [ErrorTerm(source, Quantity.SCORE, name, rms, unit or "1", "statistical", label)]


def _values(scores) -> dict[ScoreKey, float]:
    return {key_of(score): score.value for score in scores}


def _ask(metric, picture, truth, labels, objects: bool = False):
    # its terms are those of the picture, which have been recorded; only its values count
    with values_only():
        scores = ledger.collected(lambda: metric(picture, truth, labels)).result
    return [score for score in scores if objects or not score.object]

"""Score errors: shift and scatter of the scores of a picture due to the renderer's own noise.

They are measured with changes of the scene (`changed_scenes`). The method depends on the size of
the picture. A small picture is computed for several changed scenes. One more scene has its noise
smoothed away: it shows how far noise has already shifted a score. For a large picture, one exposure
shows a changed scene in most parts of the picture, and the smoothed scene in the others. If a score
is the mean of the scores of the parts, each part is an independent sample. All other scores are
computed for whole pictures, composed of blocks of the changed scene and its opposite. The display
white of the reference picture is a percentile: `percentile_errors` computes how far noise moves it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from ..data.derived_once import read_only, shared, values_only
from ..data.score_checks import check_scores, check_scores_of_parts, noted
from ..display.display_view import white_cd_m2
from ..plugins.protocols import HasMeanOfParts, ScoresParts
from . import ledger
from .changed_scenes import (
    ChangedScenes,
    Pair,
    ScoredShot,
    joined_in_blocks,
    mirrored,
    numbers_of,
    part_of,
    parts_of,
    where_exposed,
)
from .error_terms import ErrorTerm, Quantity, Source
from .ledger import LeftOut
from .reference_white import (
    NO_WHITE,
    White,
    at_white,
    finds_white,
    keys_of_white,
    white_of,
    with_white,
)
from .render_noise import NOISE
from .score_intervals import (
    NOT_MEASURED,
    RendererError,
    ScoreKey,
    key_of,
)
from .score_movements import (
    Movement,
    beside_white,
    beyond_scatter,
    known_within,
    movement_of_blocks,
    movement_of_lots,
    movement_of_parts,
    variance_of,
)

if TYPE_CHECKING:
    import xarray as xr

    from ..data.scores import Score
    from ..plugins.protocols import Metric

RENDERER = "renderer"  # key of the error terms
RENDERED = "rendered_s"  # attribute of scenes that a renderer made
CHANGES = 6  # changed pictures for scores of whole pictures; an even number
# number of parts of a large picture in which lots change the scene; the other parts are smoothed
PARTS_CHANGED = 6

Values = dict[ScoreKey, float]
T = TypeVar("T")


@dataclass(frozen=True)
class ScoreErrors:
    """The error of each score due to the renderer's noise, and the rows for the ledger."""

    errors: dict[ScoreKey, RendererError] = field(default_factory=dict)
    terms: tuple[ErrorTerm, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


class Question(NamedTuple):
    """A metric, and its scores before the change of the picture."""

    metric: Metric
    labels: xr.Dataset | None
    before: Values


def of_scores(shot: ScoredShot, metrics: Iterable[Metric], count: int = CHANGES) -> ScoreErrors:
    """Return the error of each score due to the noise of the scene, in the unit of the score.

    Parameters
    ----------
    shot : shot with the scores of its picture. Without half buffers in its scene, no error is
        stated.
    metrics : metrics of the run. If the class of a metric has `MEAN_OF_PARTS = True`, its scores of
        the frame need no labels, and are nearly the means of the scores of parts of the picture.
    count : changed pictures for scores of whole pictures; an even number.

    Returns
    -------
    The error of each score; none without half buffers. It is `NOT_MEASURED` if the score is missing
    in the smoothed scene, or in all changed pictures except one. Scores of objects are included if
    the picture is too small to be divided into parts.
    """
    metrics = list(metrics)
    if not metrics:
        return ScoreErrors()
    if shot.relative_halves is None:
        return _without_halves(shot.scene)
    return _stated(shot.scores, _measured(shot, metrics, count))


def of_each(
    shot: ScoredShot, metrics: Sequence[Metric], scores: Sequence[Sequence[Score]]
) -> list[ScoreErrors]:
    """Return the result of `of_scores` for each metric.

    The result of one metric does not depend on the others. The metrics share the changed pictures,
    which take most of the time.

    Parameters
    ----------
    shot : shot with the scores of its picture by all metrics.
    metrics : metrics with scores to compute again.
    scores : scores of the picture, by each of these metrics.
    """
    if not metrics:
        return []
    if shot.relative_halves is None:
        return [_without_halves(shot.scene) for _ in metrics]
    measured = _measured(shot, metrics, CHANGES)
    return [_stated(own, measured) for own in scores]


def joined(errors_of_metrics: Sequence[ScoreErrors]) -> ScoreErrors:
    """Return the errors of the scores of several metrics as one."""
    return ScoreErrors(
        errors={key: error for one in errors_of_metrics for key, error in one.errors.items()},
        terms=tuple(term for one in errors_of_metrics for term in one.terms),
        left_out=tuple(dict.fromkeys(row for one in errors_of_metrics for row in one.left_out)),
    )


class _Measured(NamedTuple):
    """How changed scenes move scores."""

    movements: dict[ScoreKey, Movement]
    smoothed: Values  # changes of the scores in the smoothed scene
    of_objects: bool  # whether scores of objects were computed


def _measured(shot: ScoredShot, metrics: Sequence[Metric], count: int) -> _Measured:
    scenes = ChangedScenes(shot)
    if parts := parts_of(shot.truth):
        return _of_large_picture(shot, metrics, scenes, parts, count)
    return _of_small_picture(shot, metrics, scenes, count)


def _without_halves(scene: xr.Dataset) -> ScoreErrors:
    if NOISE not in scene and RENDERED not in scene.attrs:
        return ScoreErrors()
    why = "the scene has no half buffers: the intervals include the noise realisations only"
    return ScoreErrors(left_out=(LeftOut("renderer noise in scores", why, math.inf, "1"),))


def _of_small_picture(
    shot: ScoredShot, metrics: Sequence[Metric], scenes: ChangedScenes, count: int
) -> _Measured:
    questions = [Question(metric, shot.labels, _values(shot.scores)) for metric in metrics]
    with shared(shot.labels):
        answers = [_changes(questions, scenes.by_lot(k), objects=True) for k in range(count)]
        smoothed = _changes(questions, scenes.smoothed(), objects=True)
    movements = {key: movement_of_lots(values) for key, values in _by_score(answers).items()}
    return _Measured(movements, smoothed, of_objects=True)


def _of_large_picture(
    shot: ScoredShot,
    metrics: Sequence[Metric],
    scenes: ChangedScenes,
    parts: Sequence[dict[str, np.ndarray]],
    count: int,
) -> _Measured:
    of_parts = [metric for metric in metrics if _is_mean_of_parts(metric)]
    labels = _with_one_object(shot.labels)
    numbers = numbers_of(parts)
    with shared(labels):
        of_whole = _of_whole([m for m in metrics if m not in of_parts], shot, labels)
        if not (of_parts or of_whole):
            return _Measured({}, {}, of_objects=False)
        first, smoothed = scenes.exposed_in_parts(0, numbers >= PARTS_CHANGED)
        second = mirrored(shot.pair, first)
        white = white_of(scenes) if any(map(finds_white, metrics)) else NO_WHITE
        metrics_at_white = [with_white(metric, white.level_cd_m2) for metric in of_parts]
        before = _scores_of_parts(metrics_at_white, shot.pair, parts)
        slopes = _slopes(of_parts, white, shot.pair, parts, before)
        opposite = (numbers < PARTS_CHANGED) & (numbers % 2 == 1)
        together = _composed(_composed(first, second, opposite), smoothed, numbers >= PARTS_CHANGED)
        after = _scores_of_parts(metrics_at_white, together, parts)
        changes = [_difference(*both) for both in zip(after, before, strict=True)]
        joined = joined_in_blocks(first, second, count) if of_whole else ()
        answers = [_changes(of_whole, pair) for pair in joined]
        less_noise = _changes(of_whole, smoothed)
    movements = {key: movement_of_blocks(values) for key, values in _by_score(answers).items()}
    white_change = white_cd_m2(smoothed.truth) - white.level_cd_m2 if white.level_cd_m2 else 0.0
    for key, values in _by_score(changes[:PARTS_CHANGED]).items():
        slope = slopes.get(key, 0.0)
        movements[key] = beside_white(movement_of_parts(values), slope, white.movement)
    for key, values in _by_score(changes[PARTS_CHANGED:]).items():
        shift = beyond_scatter(float(values.mean()), variance_of(values) / len(values))
        less_noise[key] = shift + slopes.get(key, 0.0) * white_change
    for key in keys_of_white(metrics):
        movements[key] = white.movement
        less_noise[key] = white_change
    return _Measured(movements, less_noise, of_objects=False)


def _stated(scores: Sequence[Score], measured: _Measured) -> ScoreErrors:
    """Return the errors of these scores."""
    scores_measured = [score for score in scores if measured.of_objects or not score.object]
    left_out: tuple[LeftOut, ...] = ()
    if len(scores_measured) < len(scores):
        why = (
            "scores of objects are not recomputed for large pictures: their intervals include the"
            " noise realisations only"
        )
        left_out = (LeftOut("renderer noise in scores of objects", why, math.inf, "1"),)
    errors = dict.fromkeys(map(key_of, scores_measured), NOT_MEASURED)
    movements = {key: moved for key, moved in measured.movements.items() if key in errors}
    smoothed = measured.smoothed
    errors |= {
        key: _error(movement, smoothed[key])
        for key, movement in movements.items()
        if key in smoothed and movement.freedom > 0
    }
    terms = [
        _term(name, unit, movement)
        for (name, unit, of_object), movement in movements.items()
        if not of_object and movement.rms_freedom > 0
    ]
    return ScoreErrors(errors, tuple(terms), left_out)


def _error(movement: Movement, less_noise: float) -> RendererError:
    """Return the error of a score, from its movement and its change in the smoothed scene.

    The variance is the product of two estimates, over the pictures and over the tiles on which the
    score depends. Their relative variances, 2 over the degrees of freedom of each, add up.
    """
    both = 1 / movement.freedom + 1 / movement.tiles
    freedom = 1 / both if both else math.inf
    return RendererError(movement.scatter, freedom, movement.shift, less_noise)


def _is_mean_of_parts(metric: Metric) -> bool:
    return isinstance(metric, HasMeanOfParts) and metric.MEAN_OF_PARTS


def _before(scores: Iterable[Score]) -> Values:
    """Return the scores of the whole picture before any change."""
    return _values(score for score in scores if not score.object)


def _of_whole(
    metrics: Sequence[Metric], shot: ScoredShot, few: xr.Dataset | None
) -> list[Question]:
    """Return the questions of the metrics that have scores of the whole picture.

    Objects take most of the time. The labels are therefore `few`, with one object only, if the
    scores of the whole picture are the same with them.
    """
    before = _before(shot.scores)
    questions = []
    for metric in metrics:
        scores = _ask(metric, shot.pair, few)
        same_scores = all(
            np.array_equal(s.value, before.get(key_of(s), math.inf), equal_nan=True) for s in scores
        )
        if scores:  # a metric with scores of objects only is not called again
            questions.append(Question(metric, few if same_scores else shot.labels, before))
    return questions


def _with_one_object(labels: xr.Dataset | None) -> xr.Dataset | None:
    if labels is None or "instance" not in labels:
        return labels
    instance = labels["instance"]
    first = instance.values[instance.values > 0].min(initial=np.iinfo(instance.dtype).max)
    return labels.assign(instance=instance * (instance == first))


def _slopes(
    metrics: Sequence[Metric],
    white: White,
    pair: Pair,
    parts: Sequence[dict[str, np.ndarray]],
    before: Sequence[Values],
) -> Values:
    """Return the change of each score per change of the white.

    Parameters
    ----------
    metrics : metrics with scores that are means over parts.
    white : display white of the reference picture, cd/m2.
    pair : picture and reference picture.
    parts : indices of each part.
    before : scores of each part at this white.
    """
    moved = [
        at_white(metric, white.level_cd_m2 + white.movement.rms)
        for metric in metrics
        if finds_white(metric)
    ]
    if not (moved and white.movement.rms):
        return {}
    after = _scores_of_parts(moved, pair, parts)
    by_score = _by_score([_difference(*both) for both in zip(after, before, strict=True)])
    return {key: float(values.mean()) / white.movement.rms for key, values in by_score.items()}


def _scores_of_parts(
    metrics: Sequence[Metric], pair: Pair, parts: Sequence[dict[str, np.ndarray]]
) -> list[Values]:
    """Return the scores of each part of a picture and its reference picture."""
    out: list[Values] = [{} for _ in parts]
    numbers = numbers_of(parts)
    pair = _locked(pair)
    with shared(*pair):
        for metric in metrics:
            if not isinstance(metric, ScoresParts):
                continue
            key = type(metric).__name__
            with noted(key, "of_parts"):
                scores = _quietly(partial(metric.of_parts, *pair, numbers))
            check_scores_of_parts(key, scores, len(parts))
            for values, of_part in zip(out, scores, strict=True):
                values |= _values(of_part)
    one_by_one = [metric for metric in metrics if not isinstance(metric, ScoresParts)]
    for values, part in zip(out, parts):
        if one_by_one:
            piece = Pair(*(part_of(dataset, part) for dataset in pair))
            with shared(*piece):
                values |= _values(s for metric in one_by_one for s in _ask(metric, piece, None))
    return out


def _locked(pair: Pair) -> Pair:
    """Return the pair with arrays that a metric cannot change for the next metric."""
    return Pair(*map(read_only, pair))


def _composed(pair: Pair, other: Pair, where: np.ndarray) -> Pair:
    """Return the pair with the pixels `where` (y, x) of the other."""
    return Pair(*(where_exposed(*both, where) for both in zip(pair, other, strict=True)))


def _changes(questions: Sequence[Question], pair: Pair, objects: bool = False) -> Values:
    """Return the change of the scores of a changed pair.

    Parameters
    ----------
    questions : metrics, and their scores before the change.
    pair : changed picture and reference picture.
    objects : whether scores of objects count.
    """
    out: Values = {}
    pair = _locked(pair)
    with shared(*pair):
        for metric, labels, before in questions:
            out |= _difference(_values(_ask(metric, pair, labels, objects)), before)
    return out


def _difference(after: Values, before: Values) -> Values:
    """Return the differences of scores. Scores without a number before or after are left out."""
    differences = {name: value - before.get(name, math.nan) for name, value in after.items()}
    return {name: value for name, value in differences.items() if math.isfinite(value)}


def _by_score(answers: Sequence[Values]) -> dict[ScoreKey, np.ndarray]:
    """Return the changes of each score, from those of each picture."""
    names = dict.fromkeys(name for answer in answers for name in answer)
    return {name: np.array([a[name] for a in answers if name in a]) for name in names}


def _term(name: str, unit: str, movement: Movement) -> ErrorTerm:
    """Return the term of one score."""
    side = f", of it {movement.shift:.2g} to one side" if movement.shift else ""
    factor = known_within(movement.rms_freedom)
    label = (
        f"score {name}: renderer noise{side}, from {movement.how}, known within a factor of"
        f" {factor:.1f}"
    )
    source = Source(key=RENDERER)
    value = movement.rms
    return ErrorTerm(source, Quantity.SCORE, name, value, unit or "1", "statistical", label)


def _values(scores: Iterable[Score]) -> Values:
    return {key_of(score): score.value for score in scores}


def _ask(
    metric: Metric, pair: Pair, labels: xr.Dataset | None, objects: bool = False
) -> list[Score]:
    key = type(metric).__name__
    with noted(key, "__call__"):
        scores = _quietly(lambda: metric(pair.picture, pair.truth, labels))
    check_scores(key, scores)
    return [score for score in scores if objects or not score.object]


def _quietly(ask: Callable[[], T]) -> T:
    """Return the scores of a call without recording its terms: those of the picture have been
    recorded already. Only the values of the scores are used.
    """
    with values_only():
        result: T = ledger.collected(ask).result
    return result

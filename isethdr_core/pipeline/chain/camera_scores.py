"""Camera scores: the scores of a picture, how they vary with the noise of the sensor, and what the
noise of the renderer changes in them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from ...data.derived_once import values_only
from ...data.score_checks import check_scores, noted
from ...data.scores import Score, state_errors
from ...errors import ConfigError
from ...plugins.protocols import DeclaresNoise, ScoresFurther
from ...runs.noise_realisations import over_draws, state_spread
from ...uncertainty import ledger, score_errors
from ...uncertainty.changed_scenes import ScoredShot
from ...uncertainty.score_intervals import RendererError, ScoreKey, key_of
from .camera import Camera, CameraAtWork
from .side_by_side import side_by_side
from .stages import stage

if TYPE_CHECKING:
    from ...plugins.protocols import Sensor
    from .components import Chain


def first_scores(work: CameraAtWork, camera: Camera) -> dict[str, list[Score]]:
    """Return the scores of the first noise realisation by metric, each metric a stage of the run.

    Parameters
    ----------
    work : the camera at work.
    camera : its picture, reference picture and labels.

    Raises
    ------
    ConfigError : two metrics give scores of the same name.
    """
    metrics = work.chain.metrics
    own = [work.with_own_rows() for _ in metrics]
    parts = [partial(scores_of_metric, one, camera, key) for one, key in zip(own, metrics)]
    scores = side_by_side(parts)
    for one in own:
        work.rows.extend(one.rows)
    scores_of = dict(zip(metrics, scores, strict=True))
    check_names(scores_of)
    return scores_of


def check_names(scores_of: Mapping[str, Sequence[Score]]) -> None:
    """Raise ConfigError if two metrics give scores of the same name, of which only one would count.

    Parameters
    ----------
    scores_of : {name of a metric in the config: its scores}.
    """
    metric_of: dict[ScoreKey, str] = {}
    for key, scores in scores_of.items():
        for score in scores:
            other = metric_of.setdefault(key_of(score), key)
            if other != key:
                raise ConfigError(
                    f"metric.{other} and metric.{key} both give the score {score.metric!r};"
                    " expected one metric for each name of a score; type"
                    f" ~metric.{other} to leave one out, or compute its scores from the stored"
                    " run: isethdr catalog score RUN metric=NAME"
                )


def scores_of_metric(work: CameraAtWork, camera: Camera, key: str) -> list[Score]:
    """Return the scores of the first noise realisation by one metric, a stage of the run.

    Parameters
    ----------
    work : the camera at work.
    camera : its picture, reference picture and labels.
    key : name of the metric in the config.
    """
    metric = work.chain.metrics[key]
    scores: list[Score] = stage(
        work.rows,
        "metric",
        f"{key} {work.name}",
        metric,
        lambda: checked_scores(key, metric(camera.picture, camera.truth, camera.labels)),
        work.shot.kept_scores(metric),
    )
    return scores


def averaged_scores(work: CameraAtWork, camera: Camera) -> list[Score]:
    """Return the scores averaged over all noise realisations, with intervals that contain the
    renderer's noise.

    Parameters
    ----------
    work : the camera at work.
    camera : its results, with the scores of the first shot.
    """
    of_draws = work.with_own_rows()
    of_errors = work.with_own_rows()
    parts: list[Callable[[], Any]] = [
        partial(scores_of_all_realisations, of_draws, camera),
        partial(renderer_errors, of_errors, camera),
    ]
    realisations, errors = side_by_side(parts)
    work.rows.extend(of_draws.rows)
    for row in of_errors.rows:
        if row.errors:
            work.rows.append(row)
        else:  # a row without errors is not kept: its omissions move to the row before
            work.rows[-1].left_out += row.left_out
    return over_draws(realisations, errors)


def checked_scores(key: str, scores: Sequence[Any]) -> list[Score]:
    """Return the scores of one metric, and state their intervals in the ledger.

    Raises
    ------
    PluginError : as `check_scores` raises it.
    """
    checked = check_scores(key, scores)
    state_errors(checked)
    return checked


def scores_of_all_realisations(work: CameraAtWork, camera: Camera) -> list[list[Score]]:
    """Return the scores of each noise realisation, those of the first shot first.

    Parameters
    ----------
    work : the camera at work.
    camera : its results, with the scores of the first shot.
    """
    chain = work.chain
    shots = [camera.scores_of_first_shot]
    if chain.draws == 1 or not chain.metrics:
        return shots
    with ledger.stage(work.rows, f"draws {work.name}"):
        if varies(chain, work.shot.sensor):
            further = [partial(further_scores, work, camera, k) for k in range(1, chain.draws)]
            shots += side_by_side(further)
        else:
            shots += shots * (chain.draws - 1)
        state_spread(over_draws(shots), chain.draws)
    return shots


def varies(chain: Chain, sensor: Sensor) -> bool:
    """Return whether another noise realisation changes the picture. A sensor without noise declares
    this in its field `noise`.
    """
    noisy = not isinstance(sensor, DeclaresNoise) or sensor.noise
    if not chain.leave_out or noisy:
        return True
    ledger.left_out(
        f"{chain.draws - 1} more noise realisations",
        "the sensor has none: they would be the same",
        0.0,
        "relative",
        needless=True,
    )
    return False


def further_scores(work: CameraAtWork, camera: Camera, draw: int) -> list[Score]:
    """Return the scores of the same shot with other noise. Only their values are used: the error
    terms are those of the first shot.

    Parameters
    ----------
    work : the camera at work.
    camera : results of the first shot.
    draw : number of the noise realisation, from 1.
    """

    metrics = work.chain.metrics

    def scored(key: str, picture: Any) -> list[Score]:
        return scores_of_other_picture(key, metrics[key], picture, camera)

    with values_only():
        values = ledger.collected(lambda: work.shot.values_of(draw, metrics, scored))
    scores: list[Score] = values.result
    return scores


def scores_of_other_picture(key: str, metric: Any, picture: Any, camera: Camera) -> list[Score]:
    """Return the scores of another noise realisation of a camera's picture.

    Parameters
    ----------
    key : name of the metric in the config.
    metric : metric of the run.
    picture : picture of the other realisation, on the grid of the first.
    camera : results of the first shot.

    Raises
    ------
    PluginError : as `check_scores` raises it.
    """
    if isinstance(metric, ScoresFurther):
        with noted(key, "further"):
            scores = metric.further(picture, camera.picture, camera.truth, camera.labels)
        return check_scores(key, scores, "further")
    with noted(key, "__call__"):
        scores = metric(picture, camera.truth, camera.labels)
    return check_scores(key, scores)


def renderer_errors(work: CameraAtWork, camera: Camera) -> dict[ScoreKey, RendererError]:
    """Return the error of each score due to renderer noise, and add the row that states it.

    Parameters
    ----------
    work : the camera at work.
    camera : its results, with the scores of the first shot.

    Returns
    -------
    The error of each score. Empty if the scene states no renderer noise, or the scores have no
    interval.
    """
    if not work.chain.metrics:
        return {}
    with ledger.stage(work.rows, f"scores {work.name}") as row:
        if work.chain.draws > 1:
            errors = computed_errors(work, camera)
        else:
            why = "one noise realisation gives no interval; type draws=4"
            errors = score_errors.ScoreErrors(
                left_out=(ledger.LeftOut("intervals of scores", why, float("inf"), "1"),)
            )
        ledger.record(*errors.terms)
        row.left_out += errors.left_out
    return errors.errors


def computed_errors(work: CameraAtWork, camera: Camera) -> score_errors.ScoreErrors:
    """Return the errors of all scores due to renderer noise, computed or kept by an earlier run."""
    shot = work.shot.shot
    metrics = list(work.chain.metrics.values())
    scores = list(camera.scores_of.values())
    scored_shot = ScoredShot(
        picture=camera.picture,
        truth=camera.truth,
        labels=camera.labels,
        scores=camera.scores_of_first_shot,
        light=shot.light,
        mixed_radiance=shot.mixed,
        scene=shot.scene,
        expose=work.shot.picture_of,
    )
    errors_by_metric = shot.reuse.values(
        [work.shot.score_errors_name(metric) for metric in metrics],
        lambda lacking: score_errors.of_each(
            scored_shot, [metrics[k] for k in lacking], [scores[k] for k in lacking]
        ),
    )
    return score_errors.joined(errors_by_metric)

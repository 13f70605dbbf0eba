"""Number of noise realisations that a score is averaged over, against many other realisations."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core import generator
from isethdr_core.config.composition import compose
from isethdr_core.plugins.registry import build
from isethdr_core.truth import truth

if TYPE_CHECKING:
    import xarray as xr

DRAWS = (1, 2, 4, 8, 16)
MANY = 96
METRICS = ("dynamic_range", "ciede2000", "ssim", "log_luminance_error", "contrast_detection")


def measured() -> list[Work]:
    """Return one diagram per metric: rms difference of its score, in units of the score's standard
    deviation between noise realisations.
    """
    default = compose([]).draws
    metrics = {name: build("metric", name) for name in METRICS}
    one_shot = shooter()
    many_scores = [scores(metrics, *one_shot(seed)) for seed in range(100, 100 + MANY)]
    works = []
    for name, metric in metrics.items():
        known = np.array([row[name] for row in many_scores])
        scatter = float(known.std(ddof=1))
        points = []
        for draws in DRAWS:
            # the CPU seconds are those of one group of draws; the error is averaged over all groups
            # of this size
            _, cpu_s, peak_mb = timed(
                lambda draws=draws, metric=metric: [
                    metric(*one_shot(seed))[0].value for seed in range(draws)
                ],
                repeat=1,
            )
            groups = known[: MANY // draws * draws].reshape(-1, draws).mean(axis=1)
            # mean of the draws that are not in the group
            other_mean = (known.sum() - groups * draws) / (MANY - draws)
            error = np.sqrt(np.mean((groups - other_mean) ** 2)) / scatter if scatter > 0 else 0.0
            points.append(
                Point(
                    f"{draws} draw{'s' * (draws > 1)}",
                    float(error),
                    cpu_s,
                    peak_mb,
                    "default" if draws == default else "peer" if draws == 1 else "",
                )
            )
        works.append(
            Work(
                f"metric {name}",
                "rms difference in standard deviations of one draw",
                f"the mean of the others of {MANY} draws",
                1 / np.sqrt(MANY),
                points,
            )
        )
    return works


def shooter() -> Callable[..., Any]:
    """Return a function seed -> (picture, truth, None) of a colour chart in dim light. None stands
    for labels, which the chart does not have.
    """
    mixed = build("lighting", "weights", weights={"sky": 1.0})(
        build("scene", "macbeth", width=160, height=120, luminance_cd_m2=5.0)()
    )
    light = build(
        "lens",
        "ideal",
        f_number=2.0,
        focal_length_mm=3e-3 * 160 / mixed.attrs["field_width"],
        falloff="none",
    )(mixed)
    sensor = build("sensor", "bayer", pitch_um=3.0)
    isp = build("isp", "linear")

    def one(seed: int) -> tuple[Any, xr.Dataset, None]:
        picture = isp(sensor(light, generator(seed=seed)))
        return picture, truth(mixed, picture), None

    return one


def scores(metrics: Any, picture: xr.Dataset, true: np.ndarray, labels: xr.Dataset) -> dict:
    """Return {metric: its score of the whole picture}.

    Parameters
    ----------
    metrics : {name: metric}.
    picture : picture of a camera.
    true : reference picture on the same grid.
    labels : labels on the same grid.
    """
    return {name: metric(picture, true, labels)[0].value for name, metric in metrics.items()}

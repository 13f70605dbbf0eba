"""Scores of the main job's cameras with and without denoising, and the sharpness that it costs.

The scores are those of one shot: the picture as the isp returns it, and the same shot before
denoising. MTF50 is that of a slanted edge (ISO 12233) through the lens of the main job. The lens
has no dirt here, because the measurement of an edge would take the scatter of dirt for blur.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

import isethdr_core as hdr
from isethdr_core.data.reference_picture import before_denoising, truth
from isethdr_core.data.scores import Score
from isethdr_core.plugins.registry import build, build_from_config

EDGE_NAME = "slanted_edge"  # name of the chart and of its metric
CONTRASTS = (2.0, 10.0)  # bright side of the edge over its dark side
EDGE = {"width": 240, "height": 200, "horizontal_field_deg": 7.0, "luminance_cd_m2": 2.0}


def denoised_scores(
    width: int = 320, height: int = 180, shots: int = 3, overrides: str = ""
) -> list[dict[str, Any]]:
    """Return one row for each camera and score of the whole frame, and for each edge.

    Parameters
    ----------
    width, height : tiles of the main job's rendering.
    shots : number of shots of each edge over which MTF50 is averaged.
    overrides : further settings of the main job, separated by spaces.

    Returns
    -------
    rows with camera, score, unit, `denoised` (the score), `plain` (the score of the same shot
    before denoising), and `share` (the first over the second).
    """
    settings = [f"renderer.width={width}", f"renderer.height={height}", "draws=1", "report=false"]
    config = hdr.compose([*settings, *overrides.split()])
    result = hdr.run(config)
    metrics = [build_from_config("metric", node) for node in config.metric.values()]
    rows = []
    for name in result.cameras:
        picture, reference = (result.open(f"{kind}/{name}").load() for kind in ("picture", "truth"))
        pair = picture, before_denoising(picture)
        for metric in metrics:
            smooth, plain = (
                {s.metric: s for s in scores_of_frame(metric, p, reference)} for p in pair
            )
            rows += [
                _row(name, one.metric, one.unit, one.value, plain[key].value)
                for key, one in smooth.items()
                if key in plain
            ]
        rows += edges(config, name, shots)
    return rows


def scores_of_frame(metric: Any, picture: xr.Dataset, reference: xr.Dataset) -> list[Score]:
    """Return the scores of the whole frame, not those of objects.

    Parameters
    ----------
    metric : metric component.
    picture : picture of a camera.
    reference : reference picture on the same grid, with its labels.
    """
    return [score for score in metric(picture, reference, reference) if not score.object]


def edges(config: Any, camera: str, shots: int) -> list[dict[str, Any]]:
    """Return the rows of a slanted edge: the mean MTF50 of some shots, for each contrast.

    Parameters
    ----------
    config : composed config of the main job.
    camera : name of the camera in the config.
    shots : number of shots with different noise over which MTF50 is averaged.
    """
    lens, isp = (build_from_config(kind, config[kind]) for kind in ("lens", "isp"))
    sensor = build_from_config("sensor", config.cameras[camera])
    metric = build("metric", EDGE_NAME)
    rows = []
    for contrast in CONTRASTS:
        scene = build("scene", EDGE_NAME, contrast_ratio=contrast, **EDGE)()
        mixed = build("lighting", "ideal")(scene)
        light = lens(mixed)
        found = []
        for seed in range(shots):  # noise changes a single measurement by some per cent
            picture = isp(sensor(light, hdr.generator(seed=seed)))
            reference = truth(mixed, picture)
            pair = picture, before_denoising(picture)
            found.append([metric(one, reference)[0].value for one in pair])
        smooth, plain = np.mean(found, axis=0)
        name = f"MTF50 of an edge of {contrast:g}:1, mean of {shots}"
        rows.append(_row(camera, name, "cycles per pixel", smooth, plain))
    return rows


def _row(camera: str, score: str, unit: str, denoised: float, plain: float) -> dict[str, Any]:
    share = denoised / plain if plain else float("nan")
    return {
        "camera": camera,
        "score": score,
        "unit": unit,
        "denoised": float(denoised),
        "plain": float(plain),
        "share": float(share),
    }

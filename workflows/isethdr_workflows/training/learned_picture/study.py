"""The study: differences between the pictures of a network and the best classical ones, paired by
road, for each illuminance.
"""

from __future__ import annotations

import csv
import io
import math
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.data.derived_once import shared
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain.side_by_side import threads_for
from isethdr_core.plugins.registry import build
from isethdr_core.storage.atomic_write import write_text

from ...accuracy.diagram import draw
from ...accuracy.isp_cost import Cost, costs_alone
from ...dataset.study.intervals import mean_over_roads
from ..picture.camera import TrainingCamera, camera_of
from ..picture.roads import TRAIN, Road, lit, roads_of
from . import road_scores
from .contest import Contest, Shot, matrix_alone, scores_of
from .diagram import NETWORK, work_of
from .settings import GRID, GRID_FILE, SIGNS, Scores, Search, Setting

SEED = 1000  # seed of the noise of held-out shots
TUNED_ON = 3  # number of training roads on which classical settings are tuned
DIAGRAM_FILE = "work_precision.png"
# further settings of the diagram, which also shows the network and the best setting
FEWER = {
    "bilinear": Setting("bilinear", 0.0),
    "guided": Setting("guided", 0.0),
}
DRAWN = "ciede2000"
UNKNOWN = Cost(math.nan, math.nan)


class Compared(NamedTuple):
    """Scores of one held-out road at one illuminance."""

    road: str
    network: Scores  # NaN if there is no network
    classical: dict[Setting, Scores]
    matrix_alone: Scores


def learned_picture(
    *overrides: str,
    model: str = "",
    dataset: str = "streets",
    part: str = "test",
    lux: str = "0.01,0.1,1,10",
    files: str = "",
) -> list[dict]:
    """Compare a network with the best classical development on held-out roads, with 95 % intervals.
    For a camera without a network, compare the latter with the colour matrix alone.

    Parameters
    ----------
    overrides : overrides of the config: the sensor that the model is for, and the lens.
    model : ONNX file of `isp=network`; empty: the columns of the network hold NaN.
    dataset : name of a dataset in the home folder, or the folder of a dataset in another one.
    part : part of the dataset: test, or validation.
    lux : mean illuminances of the sensor plane, separated by commas; values above the 95th
        percentile of a picture are clipped for the mean.
    files : folder for three files: `classical_grid.csv`, the scores of all classical settings that
        were tried on three training roads, `held_out_scores.csv`, the scores of each road, and
        `work_precision.png`, error against CPU seconds, which needs Matplotlib; "" takes the
        folder of the model.

    Returns
    -------
    rows with lux, score, network, classical with classical_low and classical_high, difference
    (network minus classical) with low and high, roads, matrix_alone (score of the colour matrix
    without noise and mosaic), CPU seconds and peak memory of one picture, best_classical.
    """
    if not (model or files):
        raise ConfigError(
            "learned_picture has neither a model nor a folder for its tables; expected one of both;"
            " type model=FILE.onnx, or files=FOLDER for a camera without a network"
        )
    camera = camera_of(overrides)
    network = network_of(model, camera)
    folder = writable(files or str(Path(model).resolve().parent))
    roads = roads_of(dataset)
    held_out = roads.of(part)
    if not held_out or part == TRAIN:
        raise ConfigError(
            f"the part {part!r} of {roads.name} has {len(held_out)} scenes; expected a"
            " part with scenes that is not used for training; type for example part=test"
        )
    contests = [Contest(camera, level) for level in levels(lux)]
    searches = tuned(contests, roads.of(TRAIN)[:TUNED_ON], overrides)
    best = [search.best() for search in searches]  # from stored scores, without new pictures
    found: list[list[Compared]] = [[] for _ in contests]
    shots: list[Shot] = []
    for road in held_out:
        view = lit(road, camera, overrides)
        shots = [contest.shot(view, SEED) for contest in contests]
        jobs = [
            (road, shot, network, {*of.values(), *FEWER.values()}) for shot, of in zip(shots, best)
        ]
        for rows, scores in zip(found, together(compared, jobs)):
            rows.append(scores)
    costs = costs_of(model, shots[-1], {s for of in best for s in of.values()})
    write_grid(folder / GRID_FILE, contests, searches)
    if model:
        made_with = road_scores.made_with(Path(model), overrides)
        rows = scores_by_road(contests, found, best)
        road_scores.write(folder / road_scores.FILE, made_with, rows)
    if find_spec("matplotlib") is not None:
        works = [
            work(contest.lux, rows, of[DRAWN], costs)
            for contest, rows, of in zip(contests, found, best)
        ]
        draw(works, folder / DIAGRAM_FILE)
    return [
        row_of(contest.lux, score, rows, of[score], costs)
        for contest, rows, of in zip(contests, found, best)
        for score in SIGNS
    ]


def scores_by_road(
    contests: Sequence[Contest],
    found: Sequence[Sequence[Compared]],
    best: Sequence[dict[str, Setting]],
) -> list[road_scores.HeldOut]:
    """Return the scores of every road. Each classical score is that of its best setting.

    Parameters
    ----------
    contests : one contest for each illuminance.
    found : scores of the roads, for each contest.
    best : best settings by score, for each contest.
    """
    return [
        road_scores.HeldOut(
            contest.lux,
            row.road,
            row.network,
            {score: row.classical[of[score]][score] for score in SIGNS},
        )
        for contest, rows, of in zip(contests, found, best)
        for row in rows
    ]


def network_of(model: str, camera: TrainingCamera) -> Any:
    """Return the isp that runs a network; None without a model.

    Parameters
    ----------
    model : file of the network; empty: none.
    camera : camera that the network must fit.

    Raises
    ------
    ConfigError : the network does not fit the camera.
    """
    if not model:
        return None
    network = build("isp", "network", model=model)
    network.check_shot(camera.sensor.shot_form())
    return network


def together(call: Callable[[Any], Any], jobs: Sequence[Any]) -> list[Any]:
    """Return the results of all jobs in order, computed by as many threads as there are processors,
    or OMP_NUM_THREADS where that is less.

    Parameters
    ----------
    call : function that does a job.
    jobs : arguments of each job.
    """
    with ThreadPoolExecutor(threads_for(())) as threads:
        return list(threads.map(lambda job: call(*job), jobs))


def tuned(
    contests: Sequence[Contest], roads: Sequence[Road], overrides: Sequence[str]
) -> list[Search]:
    """Return a finished search for each illuminance, on the middle half of the rows of its shots.

    Parameters
    ----------
    contests : one contest of developments for each illuminance.
    roads : training roads.
    overrides : overrides of the config, as typed.
    """
    camera = contests[0].camera
    demosaics = demosaics_for(camera)
    views = [lit(road, camera, overrides) for road in roads]

    def searched(contest: Contest) -> Search:
        shots = [contest.shot(view, seed).middle() for seed, view in enumerate(views)]
        search = Search(lambda setting: mean_scores(shots, setting), demosaics)
        with shared(*(shot.reference for shot in shots)):
            search.best()
        return search

    return together(searched, [(contest,) for contest in contests])


def demosaics_for(camera: TrainingCamera) -> list[str]:
    """Return the demosaic methods of the grid that exist for the filter array of a camera."""
    found = []
    for method in GRID["demosaic"]:
        try:
            build("isp", "merge", demosaic=method).check_shot(camera.sensor.shot_form())
        except ConfigError:
            continue
        found.append(method)
    return found


def mean_scores(shots: Sequence[Shot], setting: Setting) -> Scores:
    """Return the mean scores of a setting over shots.

    Parameters
    ----------
    shots : captures of roads with their reference pictures.
    setting : classical setting.
    """
    isp = build("isp", "merge", **setting.fields())
    every = [scores_of(isp(shot.captures), shot.reference) for shot in shots]
    return {name: float(np.mean([scores[name] for scores in every])) for name in SIGNS}


def compared(road: Road, shot: Shot, network: Any, settings: set[Setting]) -> Compared:
    """Return the scores of network, classical settings and the colour matrix alone for one shot.

    Parameters
    ----------
    road : stored scene.
    shot : captures of the road and its reference picture.
    network : isp that runs the network; None: its scores are NaN.
    settings : classical settings.
    """
    learned = dict.fromkeys(SIGNS, math.nan)
    with shared(shot.reference):
        if network is not None:
            learned = scores_of(network(shot.captures), shot.reference)
        return Compared(
            road.record.road,
            learned,
            {setting: mean_scores([shot], setting) for setting in settings},
            scores_of(matrix_alone(shot, "automatic"), shot.reference),
        )


def costs_of(model: str, shot: Shot, settings: set[Setting]) -> dict[Any, Cost]:
    """Return the costs of the network and of classical settings.

    Parameters
    ----------
    model : file of the network; empty: its cost is NaN.
    shot : captures that are developed.
    settings : classical settings.
    """
    every = list(settings | set(FEWER.values()))
    isps: list[tuple[str, dict[str, Any]]] = [("merge", one.fields()) for one in every]
    if model:
        isps.append((NETWORK, {"model": model}))
    costs = costs_alone(isps, shot.captures)
    return dict(zip([*every, NETWORK], [*costs, *([] if model else [UNKNOWN])], strict=True))


def writable(folder: str) -> Path:
    """Return a folder, which is made if it is missing; raise ConfigError if it is not writable."""
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        allowed = os.access(path, os.W_OK)
    except OSError:
        allowed = False
    if not allowed:
        raise ConfigError(
            f"cannot write to {folder}; expected a folder for the tables of the study; type for"
            " example files=runs"
        )
    return path


def levels(text: str) -> list[float]:
    """Return illuminances, lux, from a text with numbers separated by commas."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or not all(0 < level < math.inf for level in found):
        raise ConfigError(f"lux is {text!r}; expected numbers above 0; type for example lux=0.1,1")
    return found


def row_of(
    lux: float, score: str, rows: Sequence[Compared], setting: Setting, costs: dict[Any, Cost]
) -> dict[str, Any]:
    """Return one row of the table.

    Parameters
    ----------
    lux : illuminance on the sensor, lux.
    score : name of the score.
    rows : scores of the held-out roads at this illuminance.
    setting : best classical setting for the score.
    costs : CPU seconds and memory of the network and of the settings.
    """
    network = [row.network[score] for row in rows]
    classical = [row.classical[setting][score] for row in rows]
    differences = np.subtract(network, classical).tolist()
    names = [row.road for row in rows]
    difference = mean_over_roads(differences, names)
    alone = mean_over_roads(classical, names)
    return {
        "lux": lux,
        "score": score,
        "network": float(np.mean(network)),
        "classical": alone.value,
        "classical_low": alone.low,
        "classical_high": alone.high,
        "difference": difference.value,
        "low": difference.low,
        "high": difference.high,
        "roads": alone.roads,
        "matrix_alone": float(np.mean([row.matrix_alone[score] for row in rows])),
        "network_cpu_s": costs[NETWORK].cpu_s,
        "classical_cpu_s": costs[setting].cpu_s,
        "network_mb": costs[NETWORK].peak_mb,
        "classical_mb": costs[setting].peak_mb,
        "best_classical": str(setting),
    }


def work(lux: float, rows: Sequence[Compared], best: Setting, costs: dict[Any, Cost]) -> Any:
    """Return the work-precision diagram of one illuminance.

    Parameters
    ----------
    lux : illuminance on the sensor, lux.
    rows : scores of the held-out roads at this illuminance.
    best : best classical setting.
    costs : CPU seconds and memory of the network and of the settings.
    """
    named = {**FEWER, "best classical": best}
    points = [
        (name, float(np.mean([row.classical[s][DRAWN] for row in rows])), costs[s])
        for name, s in named.items()
    ]
    network = float(np.mean([row.network[DRAWN] for row in rows]))
    if math.isfinite(network):
        points.append((NETWORK, network, costs[NETWORK]))
    return work_of(lux, "CIEDE2000", points)


def write_grid(path: Path, contests: Sequence[Contest], searches: Sequence[Search]) -> None:
    """Write the scores of all settings that were tried on the training roads.

    Parameters
    ----------
    path : file of the table, CSV.
    contests : one contest of developments for each illuminance.
    searches : search of each contest, in the same order.
    """
    rows = [{"lux": c.lux, **row} for c, search in zip(contests, searches) for row in search.rows()]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())

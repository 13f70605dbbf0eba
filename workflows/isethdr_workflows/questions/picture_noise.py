"""Study `picture_noise`: whether noise of the renderer, or denoising of its light, changes the
advantage of networks over classical pictures, and of RGBW over RGB.

Pictures of each road are made from the stored radiance and from versions of it. The two half
buffers of the radiance are two renderings with different seeds and half the samples each. A picture
from one half buffer is scored against two reference pictures: that of the same half buffer, which
has the same noise, and that of the other one, which has independent noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.store import open_scene

from ..dataset.study.intervals import mean_over_roads
from ..paper.fig8_9_networks import CLASSICAL, NETWORK, RGB, RGBW, Filters, filters_of, found_of
from ..training.learned_picture.contest import Contest, Shot
from ..training.learned_picture.settings import SIGNS, Scores
from ..training.learned_picture.study import SEED, together
from ..training.picture.roads import TRAIN, Road, lit_scene, roads_of
from .radiance_versions import STORED, changed
from .tables import columns

HALF_BUFFERS = ("half_a", "half_b")
DENOISED = "denoised"
# {change: pairs (version of the captures, version of the reference picture)}; the scores of the
# pairs are averaged
CHANGES: dict[str, tuple[tuple[str, str], ...]] = {
    "half_buffers": tuple((half, half) for half in HALF_BUFFERS),
    "other_half": (HALF_BUFFERS, (HALF_BUFFERS[1], HALF_BUFFERS[0])),
    DENOISED: ((DENOISED, DENOISED),),
}
PAIRS = {pair for pairs in CHANGES.values() for pair in pairs} | {(STORED, STORED)}
EVERY = "all"  # stands for all parts, of a dataset that was not used for training


class Found(NamedTuple):
    """Scores of one road, one kind of filters and one illuminance, of one pair of versions."""

    road: str
    filters: str
    lux: float
    pair: tuple[str, str]
    network: Scores
    classical: Scores


def picture_noise(
    *overrides: str,
    rgb: str = "",
    rgbw: str = "",
    sensors: str = "typical_bayer,typical_rgbw",
    dataset: str = "streets",
    part: str = "test",
    scenes: int = 0,
) -> list[dict[str, Any]]:
    """Test whether noise of the renderer changes what networks and RGBW filters win.

    Parameters
    ----------
    overrides : overrides of the config of both cameras, such as the lens.
    rgb, rgbw : ONNX files of `isp=network`. The folder of each must hold `classical_grid.csv` of
        the study `learned_picture`, which states the illuminances.
    sensors : sensors of the two models, separated by a comma.
    dataset : name of a dataset in the home folder, or the folder of a dataset in another one; its
        scenes must have half buffers.
    part : part of the dataset: test or validation; or all, for a dataset that was not used for
        training.
    scenes : number of scenes; 0: all of the part.

    Returns
    -------
    rows with answer, lux, score, `stored` (mean difference with the stored radiance) and changes of
    it, paired by road, all with 95 % limits over roads: `half_buffers` (half the samples, so twice
    the variance of the renderer's noise), `other_half` (the same against the reference picture of
    the other half buffer) and `denoised`; and `changes`, the names of those that differ from 0 and
    move the result beyond the limits of `stored`.

    Raises
    ------
    ConfigError : a model or its table is missing, or the part has no stored road.
    UnitError : a scene has no half buffers.
    """
    cameras = filters_of(rgb, rgbw, sensors, overrides)
    roads = chosen(dataset, part, scenes)
    found: list[Found] = []
    for road in roads:
        jobs = [job for item in cameras.items() for job in jobs_of(*item, road)]
        found += together(compared, jobs)
    return rows_of(found)


def chosen(dataset: str, part: str, scenes: int) -> list[Road]:
    """Return the roads of a part.

    Parameters
    ----------
    dataset : name or folder of a dataset.
    part : name of a part, or all.
    scenes : number of scenes; 0: all of the part.

    Raises
    ------
    ConfigError : the part has no roads, or is the part for training.
    """
    roads = roads_of(dataset)
    of_part = roads.of(part)
    if part == EVERY:
        every = (road for some in roads.parts.values() for road in some)
        of_part = tuple(sorted(every, key=lambda road: road.record.number))
    if not of_part or part == TRAIN or scenes < 0:
        raise ConfigError(
            f"the part {part!r} of {roads.name} has {len(of_part)} scenes, and scenes is {scenes};"
            " expected a part with scenes that is not used for training, and scenes of 0 or more;"
            " type for example part=test scenes=4"
        )
    return list(of_part[: scenes or None])


def jobs_of(name: str, filters: Filters, road: Road) -> list[tuple[Any, ...]]:
    """Return the arguments of every call of `compared` for one road and one kind of filters.

    Parameters
    ----------
    name : name of the filters, RGB or RGBW.
    filters : camera with its network and classical settings.
    road : stored scene.
    """
    stored = open_scene(road.path)
    shots = {}
    for version in sorted({version for pair in PAIRS for version in pair}):
        scene = changed(stored, version)
        view = lit_scene(scene, road.record, filters.camera, filters.overrides)
        for lux in filters.best:
            shots[version, lux] = Contest(filters.camera, lux).shot(view, SEED)
    return [
        (name, filters, road, lux, pair, _taken(shots, pair, lux))
        for lux in filters.best
        for pair in sorted(PAIRS)
    ]


def _taken(shots: dict[tuple[str, float], Shot], pair: tuple[str, str], lux: float) -> Shot:
    """Return captures of the first version with the reference picture of the second one."""
    of, against = pair
    return shots[of, lux]._replace(reference=shots[against, lux].reference)


def compared(
    name: str, filters: Filters, road: Road, lux: float, pair: tuple[str, str], shot: Shot
) -> Found:
    """Return the scores of one shot.

    Parameters
    ----------
    name : name of the filters, RGB or RGBW.
    filters : camera with its network and classical settings.
    road : stored scene.
    lux : illuminance on the sensor, lux.
    pair : versions of captures and reference picture.
    shot : captures and reference picture.
    """
    scores = found_of(name, filters, road, lux, shot)
    return Found(road.record.road, name, lux, pair, scores.network, scores.classical)


def rows_of(found: Sequence[Found]) -> list[dict[str, Any]]:
    """Return the rows of the study: differences with the stored radiance, and their changes. The
    scenes of a road are averaged, so that each road counts once.
    """
    known: dict[Any, list[Found]] = {}
    for one in found:
        known.setdefault((one.road, one.filters, one.lux, one.pair), []).append(one)
    roads = list(dict.fromkeys(one.road for one in found))
    levels = sorted({one.lux for one in found})
    rows = []
    for answer, (more, less) in ANSWERS.items():
        for lux in levels:
            for score in SIGNS:
                of = {
                    pair: [
                        _score(known, road, more, (lux, pair, score))
                        - _score(known, road, less, (lux, pair, score))
                        for road in roads
                    ]
                    for pair in PAIRS
                }
                stored = np.array(of[STORED, STORED])
                row: dict[str, Any] = {"answer": answer, "lux": lux, "score": score}
                row |= columns("stored", mean_over_roads(stored.tolist(), roads))
                for change, pairs in CHANGES.items():
                    moved = np.mean([of[pair] for pair in pairs], axis=0) - stored
                    row |= columns(change, mean_over_roads(moved.tolist(), roads))
                rows.append(row | {"changes": changes(row)})
    return rows


# {answer: ((filters, development), (filters, development))}; an answer is the score of the first
# minus that of the second
ANSWERS = {
    "network less classical, RGB": ((RGB, NETWORK), (RGB, CLASSICAL)),
    "network less classical, RGBW": ((RGBW, NETWORK), (RGBW, CLASSICAL)),
    "RGBW less RGB, networks": ((RGBW, NETWORK), (RGB, NETWORK)),
    "RGBW less RGB, classical": ((RGBW, CLASSICAL), (RGB, CLASSICAL)),
}


def _score(
    known: dict[Any, list[Found]],
    road: str,
    of: tuple[str, str],
    at: tuple[float, tuple[str, str], str],
) -> float:
    filters, development = of
    lux, pair, score = at
    values = [
        (one.network if development == NETWORK else one.classical)[score]
        for one in known[road, filters, lux, pair]
    ]
    return float(np.mean(values))


def changes(row: dict[str, Any]) -> str:
    """Return the names of the changes that differ from 0 with 95 % confidence and move the result
    beyond the 95 % limits of the stored one; `none` if there are none.
    """
    found = []
    for name in CHANGES:
        told = row[f"{name}_low"] > 0 or row[f"{name}_high"] < 0
        after = row["stored"] + row[name]
        if told and not row["stored_low"] <= after <= row["stored_high"]:
            found.append(name)
    return " ".join(found) or "none"

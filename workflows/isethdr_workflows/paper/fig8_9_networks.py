"""RGB against RGBW filters at low light, with networks and with classical developments, on roads
that were not used for training.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from isethdr_core.display.display_view import display, white_cd_m2
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build

from ..dataset.study.intervals import mean_over_roads
from ..detection.results.levels import crossing
from ..training.learned_picture import road_scores
from ..training.learned_picture.contest import Contest, Shot, scores_of
from ..training.learned_picture.road_scores import HeldOut
from ..training.learned_picture.settings import GRID_FILE, SIGNS, Scores, Setting, best_in
from ..training.learned_picture.study import SEED, together
from ..training.picture.camera import TrainingCamera, camera_of
from ..training.picture.roads import TRAIN, Road, lit, roads_of
from .rendered_scene import write_sheet

RGB = "RGB"
RGBW = "RGBW"
NETWORK = "network"
CLASSICAL = "classical"
COLOURS = {RGB: "#c0392b", RGBW: "#2c6fad"}
STYLES = {NETWORK: "-", CLASSICAL: "--"}
DRAWN = {"ssim": "SSIM", "ciede2000": "CIEDE2000"}
SHOWN_LUX = (0.1, 1.0)


class Filters(NamedTuple):
    """A camera with one kind of filters, its network and its best classical settings.

    Parameters
    ----------
    camera : camera with these filters.
    overrides : overrides of the config of the camera.
    network : isp with the network.
    best : best classical settings, {illuminance: {score: setting}}.
    known : scores from the study `learned_picture`, in the folder of the model, by illuminance and
        road.
    """

    camera: TrainingCamera
    overrides: list[str]
    network: Any
    best: dict[float, dict[str, Setting]]
    known: dict[tuple[float, str], HeldOut]


class Found(NamedTuple):
    """Scores of one road, one kind of filters and one illuminance."""

    filters: str
    lux: float
    road: str
    network: Scores
    classical: Scores


def paper_fig8_9_networks(
    *overrides: str,
    rgb: str = "",
    rgbw: str = "",
    sensors: str = "typical_bayer,typical_rgbw",
    dataset: str = "streets",
    part: str = "test",
    picture: str = "",
) -> list[dict]:
    """Repeat figures 8 and 9 of the ISETHDR paper: RGB and RGBW at low light, with networks.

    Parameters
    ----------
    overrides : overrides of the config of both cameras, such as the lens.
    rgb, rgbw : ONNX files of `isp=network`. The folder of each must hold `classical_grid.csv` of
        the study `learned_picture`, which states the illuminances. If it also holds
        `held_out_scores.csv` of the same model, camera and roads, these scores are not computed
        again.
    sensors : sensors of the two models, separated by a comma.
    dataset : name of a dataset in the home folder, or the folder of a dataset in another one.
    part : part of the dataset: test, or validation.
    picture : file for pictures of the first road at night and the curves (png or jpg); empty
        writes none.

    Returns
    -------
    rows with lux, score, development (network, classical), the means of rgb and rgbw, difference
    (rgbw minus rgb) with low and high (95 % over roads), roads, and crossing_lux with crossing_low
    and crossing_high (illuminance above which RGB is better; NaN if there is none).

    Raises
    ------
    ConfigError : a model or its table is missing, or the part has no stored road.
    """
    cameras = filters_of(rgb, rgbw, sensors, overrides)
    roads = roads_of(dataset)
    held_out = roads.of(part)
    if not held_out or part == TRAIN:
        raise ConfigError(
            f"the part {part!r} of {roads.name} has {len(held_out)} scenes; expected a"
            " part with scenes that is not used for training; type for example part=test"
        )
    at_night = next((road for road in held_out if is_at_night(road)), held_out[0])
    found: list[Found] = []
    sheet: list[list[Any]] = []
    for road in held_out:
        for name, filters in cameras.items():
            kept = known_of(name, filters, road)
            found += kept
            drawn = bool(picture) and road is at_night
            if kept and not drawn:
                continue
            view = lit(road, filters.camera, filters.overrides)
            shots = {lux: Contest(filters.camera, lux).shot(view, SEED) for lux in filters.best}
            if not kept:
                found += together(found_of, [(name, filters, road, *one) for one in shots.items()])
            if drawn:
                sheet.append([shown(filters, shots[lux]) for lux in shown_lux(shots)])
    rows = rows_of(found)
    if picture:
        names = [
            [f"{name}, network, {lux:g} lux" for lux in shown_lux(filters.best)]
            for name, filters in cameras.items()
        ]
        write_sheet(picture, sheet, names, lambda axes: curves(axes, rows))
    return rows


def filters_of(rgb: str, rgbw: str, sensors: str, overrides: Sequence[str]) -> dict[str, Filters]:
    """Return the cameras with RGB and with RGBW filters, by name.

    Parameters
    ----------
    rgb, rgbw : files of the two networks.
    sensors : names of the two sensors, RGB first, separated by a comma.
    overrides : overrides of the config, as typed.

    Raises
    ------
    ConfigError : a model, its table or a sensor is missing.
    """
    names = sensors.split(",")
    if not (rgb and rgbw and len(names) == 2):
        raise ConfigError(
            f"rgb is {rgb!r}, rgbw {rgbw!r} and sensors {sensors!r}; expected two models and two"
            " sensors; type rgb=FILE.onnx rgbw=FILE.onnx sensors=typical_bayer,typical_rgbw"
        )
    found = {}
    for name, model, sensor in zip((RGB, RGBW), (rgb, rgbw), names, strict=True):
        settings = [f"sensor={sensor}", *overrides]
        camera = camera_of(settings)
        network = build("isp", "network", model=model)
        network.check_shot(camera.sensor.shot_form())
        beside = Path(model).resolve().parent
        made_with = road_scores.made_with(Path(model), settings)
        known = road_scores.read(beside / road_scores.FILE, made_with)
        found[name] = Filters(camera, settings, network, best_in(beside / GRID_FILE), known)
    levels = [sorted(filters.best) for filters in found.values()]
    if levels[0] != levels[1]:
        raise ConfigError(
            f"the classical settings of the two models are for {levels[0]} and {levels[1]} lux;"
            " expected the same illuminances; type isethdr study learned_picture for both models"
            " with the same lux=..."
        )
    return found


def known_of(name: str, filters: Filters, road: Road) -> list[Found]:
    """Return the stored scores of a road; none unless there are scores for all illuminances.

    Parameters
    ----------
    name : name of the filters, RGB or RGBW.
    filters : camera with its network and classical settings.
    road : stored scene.
    """
    of_road = road.record.road
    kept = [filters.known.get((lux, of_road)) for lux in filters.best]
    return [
        Found(name, one.lux, of_road, one.network, one.classical)
        for one in kept
        if one is not None and None not in kept
    ]


def found_of(name: str, filters: Filters, road: Road, lux: float, shot: Shot) -> Found:
    """Return the scores of one shot: those of the network, and each score of the classical setting
    that is best for it.

    Parameters
    ----------
    name : name of the filters, RGB or RGBW.
    filters : camera with its network and classical settings.
    road : stored scene.
    lux : illuminance on the sensor, lux.
    shot : captures of the road and its reference picture.
    """
    classical = {
        score: scores_of(build("isp", "merge", **best.fields())(shot.captures), shot.reference)
        for score, best in filters.best[lux].items()
    }
    return Found(
        name,
        lux,
        road.record.road,
        scores_of(filters.network(shot.captures), shot.reference),
        {score: scores[score] for score, scores in classical.items()},
    )


def rows_of(found: Sequence[Found]) -> list[dict]:
    """Return the rows of the table. Both kinds of filters are compared on the same roads."""
    levels = sorted({one.lux for one in found})
    roads = list(dict.fromkeys(one.road for one in found))
    rows = []
    for score, sign in SIGNS.items():
        for development in (NETWORK, CLASSICAL):
            tables = {
                name: np.array(
                    [
                        [_mean(found, name, lux, road, development, score) for lux in levels]
                        for road in roads
                    ]
                )
                for name in (RGB, RGBW)
            }
            less = tables[RGBW] - tables[RGB]
            at = crossing(levels, -sign * less, roads, 0.0)
            for k, lux in enumerate(levels):
                mean = mean_over_roads(less[:, k].tolist(), roads)
                rows.append(
                    {
                        "lux": lux,
                        "score": score,
                        "development": development,
                        "rgb": float(tables[RGB][:, k].mean()),
                        "rgbw": float(tables[RGBW][:, k].mean()),
                        "difference": mean.value,
                        "low": mean.low,
                        "high": mean.high,
                        "roads": mean.roads,
                        "crossing_lux": at.level,
                        "crossing_low": at.low,
                        "crossing_high": at.high,
                    }
                )
    return rows


def _mean(
    found: Sequence[Found], name: str, lux: float, road: str, development: str, score: str
) -> float:
    values = [
        getattr(one, development)[score]
        for one in found
        if (one.filters, one.lux, one.road) == (name, lux, road)
    ]
    return float(np.mean(values))


def is_at_night(road: Road) -> bool:
    """Return whether a road is lit by its lamps alone."""
    return any(override.startswith("lighting=night") for override in road.record.overrides)


def shown_lux(levels: Any) -> list[float]:
    """Return the illuminances for which pictures are shown: those of `SHOWN_LUX`, or the two lowest
    ones if none of these was measured.
    """
    return [lux for lux in levels if lux in SHOWN_LUX] or sorted(levels)[:2]


def shown(filters: Filters, shot: Shot) -> np.ndarray:
    """Return the network's picture in bytes, with the white of the reference picture.

    Parameters
    ----------
    filters : camera with its network.
    shot : captures of a road and its reference picture.
    """
    return display(filters.network(shot.captures), white_cd_m2(shot.reference))


def curves(axes: Any, rows: Sequence[dict]) -> None:
    """Draw SSIM and CIEDE2000 against illuminance."""
    right = axes.twinx()
    for key, colour in (("rgb", COLOURS[RGB]), ("rgbw", COLOURS[RGBW])):
        for development, style in STYLES.items():
            for score, on, alpha in (("ssim", axes, 1.0), ("ciede2000", right, 0.35)):
                of = [
                    row
                    for row in rows
                    if (row["score"], row["development"]) == (score, development)
                ]
                on.semilogx(
                    [row["lux"] for row in of],
                    [row[key] for row in of],
                    style,
                    color=colour,
                    alpha=alpha,
                    marker="o",
                    ms=3,
                    label=f"{key.upper()}, {development}",
                )
    axes.set(xlabel="mean illuminance on the sensor, lux", ylabel="SSIM (strong)")
    right.set(ylabel="CIEDE2000 (faint)")
    axes.grid(True, color="#eee")
    axes.legend(fontsize=8, loc="lower center", ncols=2)

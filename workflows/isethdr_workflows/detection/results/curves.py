"""Curves: shares found and pairs told apart against the level of light, and their crossings."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...dataset.study.intervals import mean_over_roads
from .levels import LOST, LOST_APART, Crossing, at_levels, crossing
from .shares import Found, counted, few_roads
from .study_results import CurvePoint, Results


class Cells(NamedTuple):
    """Shares found at the levels of a question, for objects with values from all cameras."""

    values: dict[str, np.ndarray]  # (object, level) values by camera
    roads: list[str]  # road of each object


def with_curves(results: Results) -> Results:
    """Return results with the curves of both shares against the level of light, and crossings."""
    stated = _cells(results, results.rows)
    told_apart = _cells(results, counted(results.rows))
    return replace(
        results,
        curve=tuple(_curve(results, stated)),
        crossings=_crossings(results, stated, LOST),
        counted_curve=tuple(_curve(results, told_apart)),
        counted_crossings=_crossings(results, told_apart, LOST_APART),
    )


def _crossings(results: Results, cells: Cells, lost: float) -> dict[str, Crossing]:
    """Return the level at which each camera falls to the share `lost`, or at which the first camera
    overtakes each other camera.
    """
    asked = results.asked
    if asked.unit == "object_lux":
        return {
            camera: crossing(asked.levels, table, cells.roads, lost)
            for camera, table in cells.values.items()
        }
    first = results.cameras[0]
    return {
        f"{first} over {camera}": crossing(
            asked.levels, cells.values[first] - cells.values[camera], cells.roads, 0.0
        )
        for camera in results.cameras[1:]
    }


def _cells(results: Results, rows: Sequence[Found]) -> Cells:
    asked = results.asked
    objects: dict[tuple[int, int], dict[str, list[tuple[float, float]]]] = {}
    roads: dict[tuple[int, int], str] = {}
    for one in rows:
        level = one.illuminance_lx if asked.unit == "object_lux" else one.level
        if math.isfinite(one.found) and level > 0:
            key = one.scene, one.instance
            roads[key] = one.road
            objects.setdefault(key, {}).setdefault(one.camera, []).append((level, one.found))
    keys = [key for key, seen in objects.items() if len(seen) == len(results.cameras)]
    return Cells(
        {
            camera: np.array(
                [at_levels(objects[key][camera], asked.levels) for key in keys]
            ).reshape(len(keys), len(asked.levels))
            for camera in results.cameras
        },
        [roads[key] for key in keys],
    )


def _curve(results: Results, cells: Cells) -> list[CurvePoint]:
    points = []
    values, roads = cells
    first = results.cameras[0]
    for camera, table in values.items():
        for k, level in enumerate(results.asked.levels):
            mean = few_roads(mean_over_roads(table[:, k].tolist(), roads, (0.0, 1.0)))
            apart = (table[:, k] - values[first][:, k]).tolist()
            less = few_roads(mean_over_roads(apart, roads))
            point = CurvePoint(
                camera, level, mean.value, mean.low, mean.high, mean.count, mean.roads
            )
            if camera != first:
                point = replace(
                    point,
                    difference=less.value,
                    difference_low=less.low,
                    difference_high=less.high,
                )
            points.append(point)
    return points

"""Summary: the rows that the command prints and stores, and what limits the results."""

from __future__ import annotations

import math
from typing import Any

from isethdr_core.cli.terminal import number_of

from ...dataset.study.intervals import Mean
from ...questions.tables import columns
from ..observer.channels import count
from .shares import FEWEST_ROADS, counted, lines
from .study_results import Results

PRINTED = ("all", "class", "light", "light and distance")  # titles of the tables that are printed
NOTHING = Mean(math.nan, math.nan, math.nan, 0, 0)


def print_limitations(results: Results) -> None:
    """Print the limitations of the results: rows without a value, few roads, failed scenes."""
    known = sum(math.isfinite(one.d) for one in results.rows)
    channels = count(results.how.order)
    if known < len(results.rows):
        print(
            f"{len(results.rows) - known} of {len(results.rows)} rows have no value: the object"
            " fills the picture, or other roads show fewer windows without objects than twice the"
            f" {channels} channels of each colour; more roads, windows=96 or order=2 help"
        )
    if results.roads < FEWEST_ROADS:
        roads = number_of(results.roads, "road")
        print(f"no interval from {roads}; expected at least {FEWEST_ROADS}")
    for number, reason in results.failed:
        print(f"scene {number + 1} failed: {reason}")


def summary(results: Results) -> list[dict]:
    """Return the rows that the command prints and stores, one for each camera and class, or for
    each camera and level of light. The CSV file holds all tables.
    """
    if results.asked.levels:
        return _curve_rows(results)
    counted_tables = lines(counted(results.rows), results.cameras)
    told_apart = {(line.table, line.name): line for line in counted_tables}
    rows = []
    for line in lines(results.rows, results.cameras):
        if line.table not in PRINTED:
            continue
        pairs = told_apart.get((line.table, line.name))
        for k, camera in enumerate(results.cameras):
            row: dict[str, Any] = {
                "table": line.table,
                "row": line.name,
                "camera": camera,
                "objects": line.objects,
            }
            row |= columns("found", line.means[k])
            row |= columns("told_apart", pairs.means[k] if pairs else NOTHING)
            less = pairs.differences[k - 1] if pairs and k else NOTHING
            row |= columns("told_apart_less_first", less)
            row |= columns("noise_only_d", line.noise_only_d[k])
            row |= columns("contrast_transfer", line.transfer[k])
            rows.append(row | {"noise_only": line.noise_only[k], "median_d": line.median_d[k]})
    return rows


def _curve_rows(results: Results) -> list[dict]:
    """Return the rows of curves, with share found and pairs told apart at each level."""
    told_apart = {(one.camera, one.level): one for one in results.counted_curve}
    rows = []
    for one in results.curve:
        pairs = told_apart[one.camera, one.level]
        row: dict[str, Any] = {
            "camera": one.camera,
            "level": one.level,
            "objects": one.objects,
            "roads": one.roads,
        }
        row |= {"found": one.found, "found_low": one.low, "found_high": one.high}
        row |= {
            "told_apart": pairs.found,
            "told_apart_low": pairs.low,
            "told_apart_high": pairs.high,
        }
        rows.append(
            row
            | {
                "told_apart_less_first": pairs.difference,
                "told_apart_less_first_low": pairs.difference_low,
                "told_apart_less_first_high": pairs.difference_high,
            }
        )
    return rows

"""The tables of a study as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from isethdr_core.cli.terminal import number_of

from ...dataset.record import folder_of
from ...markdown_table import markdown_table
from ..observer.observing import CHECKED
from .checks import counted_lines
from .levels import Crossing
from .number_text import crossing_text, d_text, found_text, less_text, number, share_text
from .recall import FILE, Recall, recalls
from .shares import Line, compared_with
from .study_results import CurvePoint, Results

MOST_ABREAST = 4  # largest number of cameras that are columns of one Markdown table
# titles of the tables that are repeated for d' against noise, contrast transfer and recall
BESIDE_TABLES = ("all", "class", "light", "distance")


def markdown(results: Results, tables: Sequence[Line]) -> str:
    """Return the main table and the results of counting as Markdown. For many cameras, each camera
    and level of the curves is a row.

    Parameters
    ----------
    results : results of the study.
    tables : rows of the main tables.
    """
    if results.curve and len(results.cameras) > MOST_ABREAST:
        both = (_crossing_table(results), _level_table(results))
        return "\n".join(
            [markdown_table(*both[0]), counted_text(results), markdown_table(*both[1])]
        )
    if results.curve:
        main = _curve_table(results, results.curve, results.crossings)
        beside = _curve_table(results, results.counted_curve, results.counted_crossings)
    else:
        main = _lines_table(results, tables)
        beside = _lines_table(results, counted_lines(results))
    told = (
        "Counted: the share of pairs of windows on the same road, one with the object and one"
        " without it, in which the template, computed from other roads only, gives the larger"
        " answer to the window with the object (two-alternative forced choice); 0.5 is chance.\n"
    )
    parts = [markdown_table(*main), counted_text(results), told, markdown_table(*beside)]
    if not results.curve:
        known = recalls(folder_of(results.dataset) / FILE, results.rows)
        parts += [beside_text(known), markdown_table(*_beside_table(results, tables, known))]
    return "\n".join(parts)


def counted_text(results: Results) -> str:
    """Return one paragraph: number of roads, and counted and stated false alarms and hits."""
    alarms = [
        f"{name} {number(one.false_alarms / one.places)}"
        for name, one in results.checks.items()
        if one.places
    ]
    hits = [
        f"{name} {number(one.hits / one.trials)} where {number(one.expected / one.trials)}"
        for name, one in results.checks.items()
        if one.trials
    ]
    text = f"{number_of(results.roads, 'road')}."
    if alarms:
        text += f" False alarms counted where {CHECKED:g} are stated: {', '.join(alarms)}."
    if hits:
        text += f" Hits at that threshold counted where the observer states: {', '.join(hits)}."
    return text + "\n"


def beside_text(known: Sequence[Recall]) -> str:
    """Return a text about the columns of the table of d', contrast transfer and recall.

    Parameters
    ----------
    known : recall of detectors; none where no detector was scored.
    """
    text = (
        "The geometric mean of d' against noise alone, without clutter; the contrast transfer"
        " accuracy (IEEE P2020), of cameras with all captures"
    )
    if known:
        text += "; the recall of a trained detector at equal false alarms"
    return text + ".\n"


def _lines_table(results: Results, tables: Sequence[Line]) -> tuple[list[str], list[list[str]]]:
    head = ["", "objects", *results.cameras]
    head += [f"{name} less {compared_with(name, results.cameras)}" for name in results.cameras[1:]]
    rows = [
        [
            f"{line.table}: {line.name}",
            str(line.objects),
            *map(share_text, line.means),
            *map(share_text, line.differences),
        ]
        for line in tables
        if line.objects
    ]
    return head, rows


def _unit(results: Results) -> str:
    return "lux on the object" if results.asked.unit == "object_lux" else "lux on the sensor"


def _crossing_table(results: Results) -> tuple[list[str], list[list[str]]]:
    """Return the head and rows of a table: for each camera, the levels of its crossings, and its
    difference from the first camera in the pairs told apart. The difference is taken at the highest
    of the levels that the most objects reach.
    """
    first = results.cameras[0]
    counted_of = {(one.camera, one.level): one for one in results.counted_curve}
    most = max(one.objects for one in results.counted_curve)
    level = max(one.level for one in results.counted_curve if one.objects == most)
    rows = []
    for camera in results.cameras:
        key = camera if results.asked.unit == "object_lux" else f"{first} over {camera}"
        crossings = (results.crossings.get(key), results.counted_crossings.get(key))
        cells = ["–" if one is None else crossing_text(one) for one in crossings]
        rows.append([camera, *cells, less_text(counted_of[camera, level])])
    unit = _unit(results)
    head = ["camera", f"{unit}: half found", f"{unit}: three quarters of pairs told apart"]
    if results.asked.unit != "object_lux":
        head = ["camera", f"{unit}: found as often", f"{unit}: told apart as often"]
    return [*head, f"told apart at {level:g} lux, less {first}"], rows


def _level_table(results: Results) -> tuple[list[str], list[list[str]]]:
    """Return the head and rows of a table: share found and pairs told apart by each camera at each
    level.
    """
    counted_of = {(one.camera, one.level): one for one in results.counted_curve}
    rows = [
        [
            one.camera,
            f"{one.level:g}",
            str(one.objects),
            found_text(one),
            found_text(counted_of[one.camera, one.level]),
        ]
        for one in results.curve
    ]
    return ["camera", _unit(results), "objects", "found", "told apart"], rows


def _beside_table(
    results: Results, tables: Sequence[Line], known: Sequence[Recall]
) -> tuple[list[str], list[list[str]]]:
    recall = {(one.detector, one.camera, one.kind): one.detector_found for one in known}
    detectors = list(dict.fromkeys(one.detector for one in known))
    rows = []
    for line in tables:
        if line.table not in BESIDE_TABLES or not line.objects:
            continue
        kind = line.name if line.table == "class" else line.table  # `all` is a kind of recalls
        for k, camera in enumerate(results.cameras):
            row = [line.name, camera, d_text(line.noise_only_d[k]), share_text(line.transfer[k])]
            found = [recall.get((name, camera, kind)) for name in detectors]
            rows.append([*row, *("–" if one is None else share_text(one) for one in found)])
    head = ["", "camera", "d', noise alone", "contrast transfer"]
    return [*head, *(f"recall of detector {name}" for name in detectors)], rows


def _curve_table(
    results: Results, curve: Sequence[CurvePoint], crossings: Mapping[str, Crossing]
) -> tuple[list[str], list[list[str]]]:
    by_level: dict[float, list[CurvePoint]] = {}
    for point in curve:
        by_level.setdefault(point.level, []).append(point)
    rows = [
        [
            f"{level:g}",
            str(max(point.objects for point in points)),
            *map(found_text, points),
            *map(less_text, points[1:]),
        ]
        for level, points in by_level.items()
    ]
    rows += [
        [f"crossing, {name}", "", crossing_text(one)] + [""] * (2 * len(results.cameras) - 2)
        for name, one in crossings.items()
    ]
    less = [f"{name} less {results.cameras[0]}" for name in results.cameras[1:]]
    return [_unit(results), "objects", *results.cameras, *less], rows

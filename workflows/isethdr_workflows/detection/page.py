"""The page of a study as one HTML document that needs no network; its CSV and Markdown tables."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, fields
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from isethdr_core.cli.terminal import number_of
from isethdr_core.storage.atomic_write import write_text

from ..dataset.record import folder_of
from ..dataset.study.files import colour_of, shown
from ..dataset.study.intervals import Mean
from ..markdown_table import markdown_table
from .curve_picture import draw_curves
from .levels import Crossing
from .observer.channels import SCALE, count
from .observer.observing import CHECKED, Check
from .recall import FILE, Recall, recalls
from .results import CurvePoint, Results
from .tables import FEWEST_ROADS, Found, Line, compared_with, counted, lines

TEMPLATES = Path(__file__).parent / "templates"
WIDTH = 640.0  # width, height and margin of a drawing, pixels
HEIGHT = 260.0
MARGIN = 40.0
# counted false alarms over stated ones, above which the page warns that other roads did not show
# the clutter
TOO_MANY = 2.0
OVERSTATED = 0.05  # share of objects stated minus share counted, above which the page warns


MOST_ABREAST = 4  # largest number of cameras that are columns of one Markdown table
# titles of the tables that are repeated for counted pairs
COUNTED_TABLES = ("all", "class", "light", "light and distance")
# titles of the tables that are repeated for d' against noise, contrast transfer and recall
BESIDE_TABLES = ("all", "class", "light", "distance")


def write_files(results: Results) -> list[tuple[str, Path]]:
    """Write page, tables and objects into the folder of the dataset; return [(title, path)]."""
    stem = "detection" + (f"_{results.question}" if results.question else "")
    folder = folder_of(results.dataset)
    folder.mkdir(parents=True, exist_ok=True)
    tables = [] if results.curve else lines(results.rows)
    if results.curve and find_spec("matplotlib") is not None:
        draw_curves(results, folder / f"{stem}.png")
    texts = {
        "page": (f"{stem}.html", page(results, tables)),
        "table": (f"{stem}.md", markdown(results, tables)),
        "means": (f"{stem}.csv", means_csv(results, tables)),
        "objects": (f"{stem}_objects.csv", objects_csv(results.rows)),
    }
    for name, text in texts.values():
        write_text(folder / name, text)
    return [(title, folder / name) for title, (name, _) in texts.items()]


def page(results: Results, tables: Sequence[Line]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    results : results of the study.
    tables : rows of the main tables.
    """
    return _template().render(
        results=results,
        groups=grouped(tables),
        cameras=[(name, colour_of(k)) for k, name in enumerate(results.cameras)],
        channels=count(results.how.order),
        scale=SCALE,
        fewest=FEWEST_ROADS,
        known=sum(math.isfinite(row.d) for row in results.rows),
        drawing=drawing(results),
        scenes=len({row.scene for row in results.rows}),
        recalls=recalls(folder_of(results.dataset) / FILE, results.rows),
        too_many=any(too_many(check) for check in results.checks.values()),
        overstated=any(overstated(check) for check in results.checks.values()),
        counted_groups=grouped(counted_lines(results)),
        crossing_text=crossing_text,
        share_text=share_text,
        roads_text=roads_text,
        shown=shown,
        number=number,
        found_text=found_text,
        less_text=less_text,
        compared_with=compared_with,
    )


def grouped(tables: Sequence[Line]) -> dict[str, list[Line]]:
    """Return {title of the table: its rows}."""
    groups: dict[str, list[Line]] = {}
    for line in tables:
        groups.setdefault(line.table, []).append(line)
    return groups


def counted_lines(results: Results) -> list[Line]:
    """Return the tables of pairs told apart by counting; none if the study has curves."""
    if results.curve:
        return []
    return [line for line in lines(counted(results.rows)) if line.table in COUNTED_TABLES]


def told_apart(results: Results) -> list[Line]:
    """Return the rows of `counted_lines`, with other titles than the main tables."""
    return [line._replace(table=f"told apart: {line.table}") for line in counted_lines(results)]


def share_text(mean: Mean) -> str:
    """Return a share, or a difference of shares, as text: `0.787 (0.516 to 1.000)`."""
    if not math.isfinite(mean.value):
        return "–"
    if not math.isfinite(mean.low):
        return _thousandths(mean.value)
    low = _thousandths(mean.low)
    return f"{_thousandths(mean.value)} ({low} to {_thousandths(mean.high)})"


def _thousandths(value: float) -> str:
    return f"{round(value, 3) + 0.0:.3f}"  # adding zero turns -0.0 into 0.0


def roads_text(roads: float) -> str:
    """Return the number of roads needed as text. Numbers up to `FEWEST_ROADS` share one text."""
    if not math.isfinite(roads):
        return "–"
    if roads <= FEWEST_ROADS:
        return f"{FEWEST_ROADS} or fewer"
    return str(math.ceil(roads))


def too_many(check: Check) -> bool:
    """Return whether far more places without an object exceed the threshold than stated."""
    return check.false_alarms > TOO_MANY * CHECKED * check.places


def overstated(check: Check) -> bool:
    """Return whether counting finds far fewer objects than the observer states."""
    return check.expected - check.hits > OVERSTATED * check.trials


def number(value: float) -> str:
    """Return a number as text with three digits; a dash if it is not known."""
    return f"{value:.3g}" if math.isfinite(value) else "–"


def crossing_text(one: Crossing) -> str:
    """Return a crossing as text: `0.052 (0.031 to 0.083)`."""
    if not math.isfinite(one.level):
        return "none within the levels"
    if not math.isfinite(one.low):
        return f"{one.level:.3g} (no interval)"
    return f"{one.level:.3g} ({one.low:.3g} to {one.high:.3g})"


def drawing(results: Results) -> dict[str, object]:
    """Return lines, bands and ticks of the curves in a drawing of 640 x 260 pixels; empty if there
    are no curves.
    """
    if not results.curve:
        return {}
    logs = [math.log10(level) for level in results.asked.levels]
    span = (logs[-1] - logs[0]) or 1.0

    def across(level: float) -> float:
        return MARGIN + (math.log10(level) - logs[0]) / span * (WIDTH - 2 * MARGIN)

    def down(value: float) -> float:
        return HEIGHT - MARGIN / 2 - value * (HEIGHT - MARGIN)

    def points(own: Iterable[CurvePoint], name: str) -> str:
        known = [(one.level, float(getattr(one, name))) for one in own]
        return " ".join(f"{across(x):.1f},{down(y):.1f}" for x, y in known if math.isfinite(y))

    curves = []
    for k, camera in enumerate(results.cameras):
        own = [one for one in results.curve if one.camera == camera]
        band = f"{points(own, 'low')} {points(reversed(own), 'high')}"
        curves.append({"colour": colour_of(k), "line": points(own, "found"), "band": band})
    return {
        "curves": curves,
        "across": [(across(level), f"{level:g}") for level in results.asked.levels],
        "down": [(down(value), f"{value:g}") for value in (0.0, 0.5, 1.0)],
        "width": WIDTH,
        "height": HEIGHT,
        "margin": MARGIN,
    }


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
    return [*head, *(f"recall of {name}" for name in detectors)], rows


def d_text(mean: Mean) -> str:
    """Return d' with its interval as text: `12.4 (9.8 to 1206)`."""
    if not math.isfinite(mean.value):
        return "–"
    if not math.isfinite(mean.low):
        return _three_digits(mean.value)
    return f"{_three_digits(mean.value)} ({_three_digits(mean.low)} to {_three_digits(mean.high)})"


def _three_digits(value: float) -> str:
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"  # no powers of ten


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


def found_text(point: CurvePoint) -> str:
    """Return the share of a point of a curve with its interval as text."""
    return share_text(Mean(point.found, point.low, point.high, point.objects, point.roads))


def less_text(point: CurvePoint) -> str:
    """Return the difference from the first camera with its interval as text; a dash for the first
    camera itself.
    """
    low = point.difference_low
    high = point.difference_high
    return share_text(Mean(point.difference, low, high, point.objects, point.roads))


def means_csv(results: Results, tables: Sequence[Line]) -> str:
    """Return all means with their intervals as CSV text.

    Parameters
    ----------
    results : results of the study.
    tables : rows of the main tables.
    """
    head = ["table", "row", "camera", "objects", "roads", "found", "low", "high"]
    head += ["noise_only", "contrast_transfer", "median_d"]
    head += ["difference", "difference_low", "difference_high"]
    head += ["contrast_transfer_low", "contrast_transfer_high"]
    head += ["noise_only_d", "noise_only_d_low", "noise_only_d_high"]
    rows: list[list[object]] = []
    points = [("curve", one) for one in results.curve]
    points += [("told apart", one) for one in results.counted_curve]
    for table, point in points:
        rows.append(
            [table, point.level, point.camera, point.objects, point.roads]
            + [point.found, point.low, point.high, "", "", ""]
            + [point.difference, point.difference_low, point.difference_high]
        )
    crossings = [("crossing", *item) for item in results.crossings.items()]
    crossings += [("crossing, told apart", *item) for item in results.counted_crossings.items()]
    for table, name, one in crossings:
        rows.append([table, "level", name, "", "", one.level, one.low, one.high])
    for line in [*tables, *told_apart(results)]:
        for k, camera in enumerate(results.cameras):
            mean = line.means[k]
            own = [line.table, line.name, camera, line.objects, mean.roads]
            own += [mean.value, mean.low, mean.high]
            own += [line.noise_only[k], line.transfer[k].value, line.median_d[k]]
            apart = line.differences[k - 1] if k else None
            own += [apart.value, apart.low, apart.high] if apart else ["", "", ""]
            transfer = line.transfer[k]
            d = line.noise_only_d[k]
            rows.append([*own, transfer.low, transfer.high, d.value, d.low, d.high])
    return _csv(head, rows)


def objects_csv(rows: Sequence[Found]) -> str:
    """Return one row for each object, camera and level of light as CSV text."""
    return _csv([f.name for f in fields(Found)], (list(asdict(row).values()) for row in rows))


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    for row in rows:
        known = ["" if isinstance(v, float) and math.isnan(v) else v for v in row]
        writer.writerow([*known, *[""] * (len(head) - len(known))])
    return out.getvalue()


@cache
def _template() -> Template:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("detection.html")

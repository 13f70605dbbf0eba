"""The page of a study as one HTML document that needs no network."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from ...dataset.record import folder_of
from ...dataset.study.files import colour_of, shown
from ...html_template import html_template
from ..observer.channels import SCALE, count
from .checks import counted_lines, overstated, too_many
from .number_text import (
    crossing_text,
    found_text,
    less_text,
    number,
    roads_text,
    share_text,
)
from .recall import FILE, recalls
from .shares import FEWEST_ROADS, Line, compared_with
from .study_results import CurvePoint, Results

TEMPLATES = Path(__file__).parent / "templates"
WIDTH = 640.0  # width, height and margin of a drawing, pixels
HEIGHT = 260.0
MARGIN = 40.0


def page(results: Results, tables: Sequence[Line]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    results : results of the study.
    tables : rows of the main tables.
    """
    return html_template(TEMPLATES, "detection.html").render(
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

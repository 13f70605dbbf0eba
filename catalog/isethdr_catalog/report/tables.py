"""Tables of the report: scores, ledger, what was left out, versions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .templates import filled, number

if TYPE_CHECKING:
    from markupsafe import Markup

    from isethdr_core.ledger import Ledger
    from isethdr_core.runs.run import Result


@dataclass(frozen=True)
class Part:
    """A piece of text in a cell; a small one stands on a line of its own."""

    text: str
    small: bool = False
    strong: bool = False


Cell = str | list[Part]


def table(header: list[str], rows: list[list[Cell]], numeric: tuple[int, ...] = ()) -> Markup:
    """Return an HTML table of escaped cells; columns in `numeric` are right-aligned."""
    return filled("tables.html", header=header, rows=rows, numeric=numeric)


def scores(result: Result, of_objects: bool) -> Markup:
    """Return one row per metric (and object) and one column per camera.

    The 95 % interval stands beneath each value.
    """
    cells: dict[tuple[str, ...], dict[str, Cell]] = {}
    for score in result.scores:
        if bool(score["object"]) != of_objects:
            continue
        first = (score["object"],) if of_objects else ()
        row = cells.setdefault((*first, score["metric"], score["unit"]), {})
        row[score["camera"]] = _value(score)
    titles = ["object", "metric", "unit"] if of_objects else ["metric", "unit"]
    rows = [
        [*names, *(row.get(c, number(None)) for c in result.cameras)]
        for names, row in cells.items()
    ]
    numeric = tuple(range(len(titles), len(titles) + len(result.cameras)))
    return table([*titles, *result.cameras], rows, numeric)


def _value(score: dict) -> Cell:
    low, high = score["low"], score["high"]
    if low is None or high is None or not 0 < high - low < math.inf:  # NaN compares as unknown
        return number(score["value"])
    return [Part(number(score["value"])), Part(f"{number(low)} to {number(high)}", small=True)]


def ledger(rows: Ledger) -> Markup:
    """Return stage, seconds, peak memory and stated errors."""
    body: list[list[Cell]] = []
    for row in rows:
        errors: list[Part] = []
        for error in row.errors:
            errors.append(Part(f"{error.label} "))
            errors.append(Part(number(error.value), strong=True))
            errors.append(Part(f" {error.unit}"))
            acts_on = ", ".join(filter(None, (error.acts_on, error.part)))
            errors.append(Part(f"{error.how}, of {acts_on}", small=True))
        cells: list[Cell] = [row.stage, f"{row.seconds:.2f}", f"{row.peak_bytes / 1e6:,.0f}"]
        body.append([*cells, errors or number(None)])
    seconds = sum(row.seconds for row in rows)
    peak_bytes = max((row.peak_bytes for row in rows), default=0)
    total = [f"{seconds:.1f}", f"{peak_bytes / 1e6:,.0f}"]
    body.append([[Part("all", strong=True)], [Part(total[0], strong=True)], total[1], ""])
    return table(["stage", "seconds", "peak MB", "error"], body, (1, 2))


def left_out(rows: Ledger) -> Markup:
    """Return what was not computed, why, and the largest change that can make."""
    body: list[list[Cell]] = [
        [row.stage, omission.what, omission.why, f"{number(omission.bound)} {omission.unit}"]
        for row in rows
        for omission in row.left_out
    ]
    if not body:
        return table(["Nothing was left out."], [])
    return table(["stage", "what", "why", "bound on its effect"], body)


def key_values(data: dict) -> Markup:
    """Return a two-column table of a flat dictionary."""
    return table(["", ""], [[str(key), str(value)] for key, value in data.items()])

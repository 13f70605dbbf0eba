"""Tables of the report: cameras, scores, ledger, omissions, versions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from isethdr_core.cli.summary_tables import merged
from isethdr_core.sweeps.score_order import ROUNDING

from .templates import filled, number

if TYPE_CHECKING:
    from markupsafe import Markup

    from isethdr_core.ledger import Ledger
    from isethdr_core.runs.run import Result
    from isethdr_core.uncertainty.error_terms import ErrorTerm
    from isethdr_core.uncertainty.ledger import LeftOut

    from .viewer import Look


@dataclass(frozen=True)
class Part:
    """A piece of text in a cell; a small piece has a line of its own."""

    text: str
    small: bool = False
    strong: bool = False


Cell = str | list[Part]

# half width of an interval over its value below which the ends differ in the fifth digit only
NARROW = 1e-4


def table(
    header: list[str],
    rows: list[list[Cell]],
    numeric: tuple[int, ...] = (),
    of_sentences: bool = False,
) -> Markup:
    """Return an HTML table of escaped cells.

    Parameters
    ----------
    header : titles of the columns.
    rows : cells of each row, in the order of the columns.
    numeric : indices of the right-aligned columns, from 0.
    of_sentences : whether cells hold sentences. A narrow screen shows such a row as a paragraph,
        and scrolls other tables sideways.
    """
    return filled(
        "tables.html", header=header, rows=rows, numeric=numeric, of_sentences=of_sentences
    )


def cameras(all_looks: list[Look]) -> Markup:
    """Return one column per camera: pixels, optics; exposure, gain and noise of each capture."""
    rows: list[list[Cell]] = [
        ["pixels", *(_by(look.captures.raw.shape[1:][::-1]) for look in all_looks)],
        ["pitch, µm", *(number(look.captures.attrs.get("pitch_um")) for look in all_looks)],
        ["f-number", *(number(look.captures.attrs.get("f_number")) for look in all_looks)],
        ["filters", *(", ".join(_names(look, "channel")) for look in all_looks)],
        ["captures", *(", ".join(_names(look, "capture")) or "1" for look in all_looks)],
        ["exposure, ms", *(_each(look, "exposure_s", 1e3) for look in all_looks)],
        ["gain, DN/e", *(_each(look, "gain_dn_per_e") for look in all_looks)],
        ["read noise, e", *(_each(look, "read_noise_e") for look in all_looks)],
        ["largest signal, DN", *(_each(look, "top_dn") for look in all_looks)],
    ]
    names = [look.name for look in all_looks]
    return table(["", *names], rows, tuple(range(1, len(names) + 1)))


def _by(size: tuple[int, ...]) -> str:
    return " × ".join(str(n) for n in size)


def _names(look: Look, dimension: str) -> list[str]:
    return [str(name) for name in look.captures[dimension].values]


def _each(look: Look, field: str, factor: float = 1.0) -> str:
    """Return a number for every capture, or one number if all agree; a dash if none is stored."""
    if field not in look.captures:
        return number(None)
    values = [number(factor * float(value)) for value in look.captures[field].values]
    return values[0] if len(set(values)) == 1 else ", ".join(values)


def scores(result: Result, of_objects: bool) -> Markup:
    """Return one row per metric (and object) and one column per camera.

    The 95 % interval is below each value.
    """
    cells: dict[str, dict[tuple[str, ...], Cell]] = {camera: {} for camera in result.cameras}
    for score in result.scores:
        if bool(score["object"]) == of_objects and score["camera"] in cells:
            first = (score["object"],) if of_objects else ()
            names = (*first, score["metric"], shown_unit(score["unit"]))
            cells[score["camera"]][names] = _value(score)
    titles = ["object", "metric", "unit"] if of_objects else ["metric", "unit"]
    rows = [
        [*names, *(of_camera.get(names, number(None)) for of_camera in cells.values())]
        for names in merged(map(list, cells.values()))
    ]
    numeric = tuple(range(len(titles), len(titles) + len(result.cameras)))
    return table([*titles, *result.cameras], rows, numeric)


def shown_unit(unit: str) -> str:
    """Return a unit as in the captions of the pictures."""
    return "cd/m²" if unit == "cd m-2" else unit


def _value(score: dict) -> Cell:
    low = score["low"]
    high = score["high"]
    if low is None or high is None:
        return number(score["value"])
    half = (high - low) / 2
    if not abs(score["value"]) * ROUNDING < half < math.inf:  # NaN compares as unknown
        return number(score["value"])
    if half < NARROW * abs(score["value"]):
        return [Part(number(score["value"])), Part(f"± {half:.1g}", small=True)]
    value, low, high = (rounded(v, high - low) for v in (score["value"], low, high))
    return [Part(value), Part(f"{low} to {high}", small=True)]


def rounded(value: float, width: float) -> str:
    """Return a number with as many decimals as two significant digits of an interval `width`."""
    if value is None or not math.isfinite(value):
        return number(None)
    decimals = 1 - math.floor(math.log10(width))
    rounded_value = round(value, decimals) + 0.0  # no negative zero
    if decimals > 6 or abs(rounded_value) >= 1e6:
        return f"{value:.4g}"
    return f"{rounded_value:,.{max(decimals, 0)}f}"


def ledger(rows: Ledger) -> Markup:
    """Return the table of stages with seconds, peak memory and stated errors."""
    body: list[list[Cell]] = []
    for row in rows:
        errors: list[Part] = []
        for error in row.errors:
            errors.append(Part(f"{error.label}: " if error.label else ""))
            errors.append(Part(number(error.value), strong=True))
            errors.append(Part("" if error.unit == "1" else f" {error.unit}"))
            errors.append(Part(_kind(error), small=True))
        cells: list[Cell] = [
            row.stage,
            f"{row.seconds:.2f}{' kept' if row.reused else ''}",
            f"{row.peak_bytes / 1e6:,.0f}",
        ]
        body.append([*cells, errors or number(None)])
    seconds = sum(row.seconds for row in rows)
    peak_bytes = max((row.peak_bytes for row in rows), default=0)
    total = [f"{seconds:.1f}", f"{peak_bytes / 1e6:,.0f}"]
    body.append([[Part("all", strong=True)], [Part(total[0], strong=True)], total[1], ""])
    return table(["stage", "seconds", "peak MB", "error"], body, (1, 2), of_sentences=True)


def _kind(error: ErrorTerm) -> str:
    """Return how an error is known, and the quantity on which it acts."""
    quantity = "" if error.acts_on in ("other", "target") else f", on {error.acts_on}"
    return f"{error.how}{quantity}" + (f" ({error.part})" if error.part else "")


def left_out(rows: Ledger) -> Markup:
    """Return the omissions with their reasons and the largest change that each can cause."""
    body: list[list[Cell]] = [
        [row.stage, omission.what, omission.why, _bound(omission)]
        for row in rows
        for omission in row.left_out
    ]
    if not body:
        return table(["Nothing was left out."], [])
    return table(["stage", "what", "why", "bound on its effect"], body, of_sentences=True)


def _bound(omission: LeftOut) -> str:
    """Return the largest effect of an omission with its unit; a dash if it is unknown."""
    bound = number(omission.bound)
    return bound if bound == number(None) else f"{bound} {omission.unit}".rstrip()


def key_values(data: dict) -> Markup:
    """Return a two-column table of a flat dictionary."""
    return table(["", ""], [[str(key), str(value)] for key, value in data.items()])

"""Summary tables: the tables and warnings that the command line prints for a run."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from rich.table import Table

from ..data.scores import objects_remark, shares_remark, unlike_shares
from ..pipeline.runtime_estimate import elapsed_s
from ..runs.run_warnings import sentence
from ..storage.object_home.calls import kept_here
from ..sweeps.score_order import ROUNDING
from ..uncertainty.ledger import Row
from .terminal import console as open_console
from .terminal import duration, number_of, print_path, print_text, text_width

if TYPE_CHECKING:
    from ..pipeline.memory_estimate import Expected
    from ..runs.run import Result
    from ..uncertainty.error_terms import ErrorTerm
    from ..uncertainty.ledger import Ledger, LeftOut

Key = TypeVar("Key")


def print_result(result: Result) -> None:
    """Print the ledger, the scores of the cameras side by side, and the paths of store and
    report."""
    console = open_console()
    width = text_width()
    if not result.computed:
        print_text(f"already computed: {result.key}")
    expected = result.attributes.get("expected_s", {})
    console.print(ledger_table(result.ledger, expected=expected), width=width)
    if any(row.reused for row in result.ledger):
        print_text(
            "kept: result of an earlier run, with the seconds and memory of that run; type"
            " cache_gb=0 to compute everything again"
        )
    for row in result.ledger:
        if row.stage.startswith("picture ") and row.errors:
            print_text(
                f"{row.stage}: error at most {row.error:.3g} {row.error_unit}"
                f" {row.errors[0].label}",
                hanging="    ",
            )
    console.print(score_table(result), width=width)
    for remark in remarks(result):
        print_text(remark)
    for warning in result.warnings:
        console.print(f"warning: {sentence(warning)}", style="bold yellow", width=width)
    notes = result.attributes["lighting_notes"]
    for text in target_texts(notes.get("targets") or {}):
        print_text(f"lighting target {text}", hanging="    ")
    for name in notes.keys() - {"targets"}:
        print_text(f"lighting {name}: {notes[name]}", hanging="    ")
    report = result.path.with_suffix(".html")
    for label, path in (("store", result.path), (kept_here("report", report), report)):
        if path.exists():
            print_path(label, path)


def target_texts(targets: dict[str, Any]) -> list[str]:
    """Return each photometric target as text: what was wanted, and what was reached.

    Parameters
    ----------
    targets : {name: {wanted, reached}} as in the notes of a lighting: luminances in cd/m2, by light
        group or of the picture, and `dynamic_range`, a ratio. Other entries are left out.
    """
    texts = []
    for name, target in targets.items():
        if isinstance(target, dict):
            unit = "" if name == "dynamic_range" else " cd/m2"
            wanted, reached = (f"{target[key]:.4g}{unit}" for key in ("wanted", "reached"))
            texts.append(f"{name.removesuffix('_cd_m2')}: {wanted} wanted, {reached} reached")
    return texts


def remarks(result: Result) -> list[str]:
    """Return remarks on the scores: cameras whose shares of valid pixels differ."""
    unlike = unlike_shares(result.scores)
    frame = shares_remark(unlike[""]) if "" in unlike else ""
    return [remark for remark in (frame, objects_remark(unlike)) if remark]


def print_statements(ledger: Ledger) -> None:
    """Print every error and omission that the stages of a ledger state, one paragraph for each.

    A table with columns for both would need a terminal of 200 columns.
    """
    for row in ledger:
        for title, texts in (
            ("errors stated", [error_text(error) for error in row.errors]),
            ("left out", [omission_text(omission) for omission in row.left_out]),
        ):
            if texts:
                print_text(f"{row.stage}: {title}")
            for text in texts:
                print_text(text, indent="  ", hanging="      ")


def ledger_table(ledger: Ledger, expected: dict | None = None) -> Table:
    """Return stage, seconds, `expected` seconds, peak memory, the largest stated error and the
    number of omissions; all metrics of one camera are one row.
    """
    table = Table(title="ledger", title_justify="left", box=None, padding=(0, 1, 0, 0))
    expected = together(expected or {})
    any_known = any(seconds is not None for seconds in expected.values())
    for name, side in (
        ("stage", "left"),
        ("seconds", "right"),
        *([("expected", "right")] if any_known else []),
        ("peak MB", "right"),
        ("error", "left"),
        ("left out", "left"),
    ):
        table.add_column(name, justify=side, overflow="fold")
    for row in metrics_together(ledger):
        table.add_row(
            row.stage,
            f"{row.seconds:.2f}{' kept' if row.reused else ''}",
            *([seconds_text(expected.get(row.stage))] if any_known else []),
            f"{row.peak_bytes / 1e6:.0f}",
            worst_text(row.errors),
            f"{len(row.left_out)} noted" if row.left_out else "",
        )
    return table


def metrics_together(ledger: Ledger) -> list:
    """Return the rows with all metrics of one camera in one, so that the table of a run fits a
    screen.
    """
    rows: dict[str, Row] = {}
    for row in ledger:
        title = title_of(row.stage)
        whole = rows.setdefault(title, Row(title, reused=True))
        whole.reused &= row.reused
        whole.seconds += row.seconds
        whole.peak_bytes = max(whole.peak_bytes, row.peak_bytes)
        whole.errors += row.errors
        whole.left_out += row.left_out
    return list(rows.values())


def title_of(stage: str) -> str:
    """Return the row that a stage is shown in: all metrics of one camera share one."""
    kind, _, after_kind = stage.partition(" ")
    return f"metrics {after_kind.rpartition(' ')[2]}" if kind == "metric" else stage


def together(expected: dict) -> dict[str, float | None]:
    """Return the expected seconds of every displayed row; None if the seconds of one of its stages
    are not known.
    """
    by_title: dict[str, float | None] = {}
    for stage, seconds in expected.items():
        title = title_of(stage)
        known = by_title.get(title, 0.0)
        by_title[title] = None if None in (known, seconds) else known + seconds
    return by_title


def seconds_text(seconds: float | None) -> str:
    """Return seconds with two decimals, a question mark where they are not known."""
    return "?" if seconds is None else f"{seconds:.2f}"


def runtime_estimate_table(expected: dict, threads: int = 1) -> Table:
    """Return the stages of a planned run with their expected time, and the time of all.

    Parameters
    ----------
    expected : {stage: seconds, or None where they are not known}.
    threads : number of threads that compute the cameras.
    """
    table = Table("stage", title="will be computed", title_justify="left")
    table.add_column("expected", justify="right")
    rows = together(expected)
    for title, seconds in rows.items():
        table.add_row(title, "?" if seconds is None else duration(seconds))
    unknown = sum(s is None for s in rows.values())
    total = duration(elapsed_s(expected, threads))
    if unknown == len(rows):
        total = "?: no similar run is stored yet"
    elif unknown:
        total += f" + {number_of(unknown, 'stage')} without a stored example"
    table.add_row(f"all, with the cameras on {threads} threads" if threads > 1 else "all", total)
    return table


def memory_text(peak: Expected) -> str:
    """Return the expected peak memory of a run as text, with its parts, the largest first.

    Parameters
    ----------
    peak : `memory_estimate.Expected`.
    """
    parts = sorted(peak.parts.items(), key=lambda part: -part[1])
    listed = ", ".join(f"{what} {size / 1e6:.0f}" for what, size in parts if size >= 1e6)
    more = peak.more_bytes / 1e6
    stored = f"; a similar run took {abs(more):.0f} {'more' if more > 0 else 'less'}"
    return (
        f"memory        {peak.total_bytes / 1e6:.0f} MB expected at the peak: {listed}"
        f"{stored if abs(more) >= 1 else ''}"
    )


def worst_text(notes: Sequence[Any]) -> str:
    """Return the largest error that is comparable with the first one, and the number of other
    errors.
    """
    if not notes:
        return ""
    first = notes[0]
    comparable = [
        note
        for note in notes
        if (note.unit, note.acts_on, note.part) == (first.unit, first.acts_on, first.part)
    ]
    worst = max(comparable, key=lambda note: note.value)
    more = f" +{len(notes) - 1}" if len(notes) > 1 else ""
    return f"{worst.value:.3g}{_after_value(worst.unit)} ({worst.how}){more}"


def error_text(note: ErrorTerm) -> str:
    """Return one stated error as text: value, unit, how it is known, and its label."""
    label = f": {note.label}" if note.label else ""
    return f"{note.value:.3g}{_after_value(note.unit)} ({note.how}){label}"


def _after_value(unit: str) -> str:
    """Return what follows a value: its unit, or nothing where the unit is 1."""
    return "" if unit == "1" else f" {unit}"


def omission_text(omission: LeftOut) -> str:
    """Return one omission as text: what, why, and the largest change that it can make."""
    bound = f"{omission.bound:.3g} {omission.unit}".rstrip()
    return f"{omission.what}: {omission.why} (bound {bound})"


def score_table(result: Result) -> Table:
    """Return one row per metric of the whole picture and one column per camera. The report also has
    scores of objects.
    """
    table = Table(title="scores", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("metric", overflow="fold")
    table.add_column("unit", overflow="fold")
    for camera in result.cameras:
        table.add_column(camera, justify="right", overflow="fold")
    cells: dict[str, dict[tuple[str, str], str]] = {camera: {} for camera in result.cameras}
    for s in result.scores:
        if not s["object"] and s["camera"] in cells:
            cells[s["camera"]][s["metric"], s["unit"]] = score_text(s)
    rows = [
        [*names, *(of_camera.get(names, "") for of_camera in cells.values())]
        for names in merged(map(list, cells.values()))
    ]
    titles = ["metric", "unit", *result.cameras]
    widths = [max(map(len, column)) + 1 for column in zip(titles, *rows)]
    room = max(text_width() - sum(widths[1:]) - 1, len("metric"))
    for metric, *others in rows:
        table.add_row(broken(metric, room), *others)
    return table


def broken(name: str, width: int) -> str:
    """Return a name in lines of at most `width` letters where its underscores allow that."""
    lines = [""]
    for part in re.split("(?<=_)", name):
        if lines[-1] and len(lines[-1] + part) > width:
            lines.append("")
        lines[-1] += part
    return "\n".join(lines)


def merged(orders: Iterable[list[Key]]) -> list[Key]:
    """Return the keys of several lists in one list.

    A key that the earlier lists lack is placed after its predecessor in the later list. So the
    signal-to-noise ratios of all luminances stay together, although a saturated camera has fewer.
    """
    keys: list[Key] = []
    for order in orders:
        place = 0
        for key in order:
            if key not in keys:
                keys.insert(place, key)
            place = keys.index(key) + 1
    return keys


def score_text(score: dict) -> str:
    """Return the value, with half the width of its 95 % interval if it has one."""
    low = score["low"]
    high = score["high"]
    if low is None or high is None:
        return f"{score['value']:.4g}"
    half = (high - low) / 2
    visible = abs(score["value"]) * ROUNDING < half < math.inf  # false for NaN too
    return f"{score['value']:.4g}" + (f" ± {half:.1g}" if visible else "")

"""Output of a sweep after its jobs: one table, and the paths of page and CSV."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.table import Table

from ..plugins.component import Stage
from ..plugins.registry import plugin_manager
from ..storage.atomic_write import write_text
from ..storage.object_home.calls import kept_here
from ..sweeps.record import Sweep
from ..sweeps.score_order import ROUNDING
from ..sweeps.table import (
    PAGE,
    TABLE,
    Scored,
    SweepRow,
    SweepTable,
    as_csv,
    best_rows,
    short_names,
    sweep_table,
)
from .terminal import console, number_of, print_path, text_width

MOST_ROWS = 20  # largest number of table rows on a terminal; page and CSV hold all
MOST_BEST = 12  # largest number of scores in the table of best jobs
LINES = 2  # spaces between columns


def finish(sweep: Sweep) -> SweepTable:
    """Write the CSV of a sweep, let plugins write its page, and print table and paths."""
    table = sweep_table(sweep)
    write_text(sweep.folder / TABLE, as_csv(table))
    plugin_manager().hook.isethdr_after_stage(stage=Stage("sweep", sweep.name, sweep, result=table))
    print_sweep(table)
    return table


def print_sweep(table: SweepTable) -> None:
    """Print the jobs with the scores that fit, the best job by each score, and the paths of all
    results.
    """
    print(f"\n{_title(table)}")
    if table.rows:
        score_names = _fitting(table)
        console().print(_jobs(table, score_names))
        hidden = len(table.rows) - MOST_ROWS
        if hidden > 0:
            print(f"and {number_of(hidden, 'more row')}, in page and CSV")
        left_out = len(table.units) - len(score_names)
        if left_out > 0:
            print(f"in page and CSV: {number_of(left_out, 'more score')}")
        print()
        console().print(_best(table))
    if (table.sweep.folder / PAGE).exists():
        page = table.sweep.folder / PAGE
        print_path(kept_here("page", page), page)
    path = table.sweep.folder / TABLE
    print_path(kept_here("table", path), path)


def scored_text(score: Scored | None) -> str:
    """Return a value with half the width of its 95 % interval; "" if there is no value."""
    if score is None or math.isnan(score.value):
        return ""
    half = (score.high - score.low) / 2
    visible = abs(score.value) * ROUNDING < half < math.inf
    return f"{score.value:.4g}" + (f" ± {half:.1g}" if visible else "")


def _title(table: SweepTable) -> str:
    jobs = table.jobs
    failed = sum(bool(job.error) for job in table.jobs)
    computed = sum(job.computed for job in jobs)
    reused = len(jobs) - computed - failed
    parts = [f"{computed} computed"] if computed else []
    parts += [f"{reused} stored before"] if reused else []
    parts += [f"{failed} failed"] if failed else []
    return f"sweep {table.sweep.name}: {', '.join(parts) or 'no job is done'}"


def _lead(table: SweepTable, row: SweepRow) -> list[str]:
    """Return the cells that identify a row."""
    cells = [row.parameters[p] for p in table.parameters] or [str(row.job + 1)]
    return [*cells, row.camera] if table.several_cameras else cells


def _heads(table: SweepTable) -> list[str]:
    names = list(short_names(table.parameters).values()) or ["job"]
    return [*names, "camera"] if table.several_cameras else names


def _width(head: str, cells: Sequence[str]) -> int:
    return max([len(part) for part in (*head.split("\n"), *cells)]) + LINES


def _fitting(table: SweepTable) -> list[str]:
    """Return the scores with columns that fit the terminal, most telling first; at least one."""
    rows = table.rows[:MOST_ROWS]
    leads = [_lead(table, row) for row in rows]
    columns = zip(_heads(table), zip(*leads, strict=True), strict=True)
    free_columns = text_width() - sum(_width(head, cells) for head, cells in columns)
    shown: list[str] = []
    for score in table.units:
        free_columns -= _width(
            _score_head(table, score), [scored_text(r.scores.get(score)) for r in rows]
        )
        if free_columns < 0 and shown:
            break
        shown.append(score)
    return shown


def _score_head(table: SweepTable, score: str) -> str:
    unit = table.units[score]
    return f"{score}\n{unit}" if unit else score


def _jobs(table: SweepTable, score_names: Sequence[str]) -> Table:
    shown = Table(box=None, pad_edge=False, padding=(0, LINES, 0, 0))
    for head in _heads(table):
        shown.add_column(head, vertical="bottom")
    for score in score_names:
        shown.add_column(_score_head(table, score), justify="right")
    for row in table.rows[:MOST_ROWS]:
        shown.add_row(
            *_lead(table, row), *(scored_text(row.scores.get(score)) for score in score_names)
        )
    return shown


def _best(table: SweepTable) -> Table:
    shown = Table(box=None, pad_edge=False, padding=(0, LINES, 0, 0))
    shown.add_column("best by", vertical="bottom")
    shown.add_column("", justify="right", vertical="bottom")
    shown.add_column("job", vertical="bottom")
    shown.add_column("as good *", justify="right", vertical="bottom")
    for best in best_rows(table)[:MOST_BEST]:
        name = best.score if best.is_known else f"{best.score} ({best.end})"
        unit = table.units[best.score]
        value = scored_text(best.row.scores[best.score]) + (f" {unit}" if unit else "")
        shown.add_row(name, value, " ".join(_lead(table, best.row)), str(best.alike or ""))
    shown.caption = (
        "* number of other rows whose difference from the best is within its 95 % interval"
    )
    shown.caption_justify = "left"
    return shown

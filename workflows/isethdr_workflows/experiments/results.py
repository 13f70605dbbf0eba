"""The tables of all steps on one page, with the commands and the minutes that they took."""

from __future__ import annotations

import csv
import io
import math
import os
import textwrap
from collections.abc import Iterable, Iterator
from pathlib import Path

from isethdr_core.errors import CatalogError
from isethdr_core.runs.processor import kernels
from isethdr_core.runs.provenance import versions
from isethdr_core.storage.atomic_write import write_text
from isethdr_core.storage.home_folder import home

from ..markdown_table import markdown_table
from .records import folder, is_finished, read
from .steps import STEPS

PAGE = "results.md"
TABLES = (".md", ".csv")  # endings of the files of a step that the page includes
DIGITS = 3
WIDTH = 100  # columns of text


def page() -> str:
    """Return the page as Markdown: the steps that were run, the others, and each table."""
    used = ", ".join(f"{name} {number}" for name, number in sorted(versions().items()))
    lines = [
        "# Results of the experiments",
        "",
        "`isethdr experiments run` makes the tables in steps, at the times that the first table"
        " names. Intervals are 95 % over roads.",
        "",
        f"{os.cpu_count()} processors ({kernels()['processor']}); {used}.",
        "",
        "| step | commands | minutes | load at the end | finished |",
        "|---|---|---|---|---|",
    ]
    minutes = 0.0
    for step in STEPS:
        if step.makes[0].endswith(PAGE):
            continue  # the step that writes this page
        record = read(step)
        commands = "; ".join(f"`isethdr {command}`" for command in step.commands)
        if record is None or not is_finished(step):
            lines.append(f"| {step.name} | {commands} | | | not run to its end |")
            continue
        minutes += record.minutes
        numbers = f"{record.minutes:.1f} | {record.load:.1f}"
        lines.append(f"| {step.name} | {commands} | {numbers} | {record.finished} |")
    lines += ["", f"The finished steps took {minutes:.0f} minutes in all."]
    for step in STEPS:
        if not is_finished(step):
            continue
        tables = [p for p in step.makes if p.endswith(TABLES) and not p.endswith(PAGE)]
        for path in tables:
            text = (home() / path).read_text(encoding="utf-8").strip()
            text = table_of(text) if path.endswith(".csv") else _lower(text)
            about = f"{step.about[0].upper()}{step.about[1:]}."
            title = step.name if len(tables) == 1 else f"{step.name}: {Path(path).stem}"
            lines += ["", f"## {title}", "", about, "", *text.splitlines()]
    return "\n".join(_narrow(lines)) + "\n"


def table_of(text: str) -> str:
    """Return the rows of a CSV file as a table in Markdown, with three digits for numbers.

    If the file has several tables, named in its column `table`, only `all` is included.
    """
    head, *rows = csv.reader(io.StringIO(text))
    if "table" in head:
        rows = [row for row in rows if row[head.index("table")] == "all"]
    return markdown_table(head, [[_shown(cell) for cell in row] for row in rows]).strip()


def _shown(cell: str) -> str:
    try:
        value = float(cell)
    except ValueError:
        return cell
    return f"{value:.{DIGITS}g}" if math.isfinite(value) else "–"


def _narrow(lines: Iterable[str]) -> Iterator[str]:
    """Yield lines of at most 100 columns; rows of tables stay whole."""
    for line in lines:
        if line.startswith("|"):
            yield line
        else:
            yield from textwrap.wrap(line, WIDTH, break_on_hyphens=False) or [""]


def _lower(text: str) -> str:
    """Return Markdown with all headings one level lower."""
    return "\n".join(f"#{line}" if line.startswith("#") else line for line in text.splitlines())


def write_results() -> Path:
    """Write the page, and return its path.

    Raises
    ------
    CatalogError : the page cannot be written.
    """
    path = folder() / PAGE
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, page())
    except OSError as err:
        raise CatalogError(f"cannot write {path}: {err.strerror or err}; make room") from err
    return path

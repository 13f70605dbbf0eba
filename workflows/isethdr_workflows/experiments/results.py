"""The tables of all steps on one page, with the commands and the minutes that they took."""

from __future__ import annotations

import os
from pathlib import Path

from isethdr_core.errors import CatalogError
from isethdr_core.runs.provenance import versions
from isethdr_core.storage.atomic_write import write_text
from isethdr_core.storage.home_folder import home

from .records import folder, is_finished, read
from .steps import STEPS

PAGE = "results.md"
TABLES = (".md",)  # endings of what a step makes and the page takes in


def page() -> str:
    """Return the page: what was run, what was not, and each table."""
    used = ", ".join(f"{name} {number}" for name, number in sorted(versions().items()))
    lines = [
        "# Results of the experiments",
        "",
        "Made by `isethdr experiments run`. Intervals are 95 % over roads.",
        "",
        f"{os.cpu_count()} processors; {used}.",
        "",
        "| step | commands | minutes | load at the end | finished |",
        "|---|---|---|---|---|",
    ]
    for step in STEPS:
        record = read(step)
        commands = "; ".join(f"`isethdr {command}`" for command in step.commands)
        if record is None or not is_finished(step):
            lines.append(f"| {step.name} | {commands} | | | not run to its end |")
            continue
        numbers = f"{record.minutes:.1f} | {record.load:.1f}"
        lines.append(f"| {step.name} | {commands} | {numbers} | {record.finished} |")
    for step in STEPS:
        for path in step.makes:
            if path.endswith(TABLES) and not path.endswith(PAGE) and is_finished(step):
                text = (home() / path).read_text(encoding="utf-8").strip()
                lines += ["", f"## {step.name}: {step.about}", "", _lower(text)]
    return "\n".join(lines) + "\n"


def _lower(text: str) -> str:
    """Return Markdown whose headings are one level lower."""
    return "\n".join(f"#{line}" if line.startswith("#") else line for line in text.splitlines())


def write_results() -> Path:
    """Write the page, and return its path.

    Raises
    ------
    CatalogError : it cannot be written.
    """
    path = folder() / PAGE
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, page())
    except OSError as err:
        raise CatalogError(f"cannot write {path}: {err.strerror or err}; make room") from err
    return path

"""The page of a sweep: any score against any parameter, the best by each score, links to reports.

The page is one file that needs no network. It is in the folder of the sweep, and links to the
reports of its runs by relative paths.
"""

from __future__ import annotations

import math
import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Any

from isethdr_core.cli.sweep_summary import scored_text
from isethdr_core.sweeps.table import (
    PAGE as PAGE,
)
from isethdr_core.sweeps.table import (
    TABLE,
    Best,
    SweepTable,
    best_rows,
)

from . import tables
from .templates import filled, script

if TYPE_CHECKING:
    from markupsafe import Markup


def sweep_page(table: SweepTable) -> Markup:
    """Return the page of a sweep as one HTML document that needs no network."""
    sweep = table.sweep
    return filled(
        "sweep.html",
        title=sweep.name,
        summary=f"{len(table.jobs)} of {sweep.total} jobs are done.",
        tags=table.tags,
        errors=[f"{' '.join(job.overrides)}: {job.error}" for job in table.jobs if job.error],
        best=_best_table(table),
        csv=TABLE,
        command=_command(table),
        data=_data(table),
        script=script("sweep.js"),
    )


def _command(table: SweepTable) -> str:
    """Return the command that repeats the sweep, quoted for a shell, one override a line."""
    tags = [f"tags={','.join(table.tags)}"] if table.tags else []
    first = shlex.join(["isethdr", "run", "-m", f"name={table.sweep.name}", *tags])
    return " \\\n    ".join([first, *map(shlex.quote, table.sweep.overrides)])


def _best_table(table: SweepTable) -> Markup:
    """Return one row for each score that varies: the best value, its interval and its job."""
    return tables.table(
        ["score", "best", "unit", "job", "as good"],
        [_best_cells(table, best) for best in best_rows(table)],
        (1, 4),
    )


def _best_cells(table: SweepTable, best: Best) -> list[tables.Cell]:
    name = best.score if best.is_known else f"{best.score} ({best.end})"
    camera = f" {best.row.camera}" if table.several_cameras else ""
    return [
        name,
        scored_text(best.row.scores[best.score]),
        tables.shown_unit(table.units[best.score]),
        best.row.described() + camera,
        str(best.alike or ""),
    ]


def _data(table: SweepTable) -> dict[str, Any]:
    """Return the data that the script of the page draws; numbers that are not finite are null."""
    folder = table.sweep.folder
    return {
        "parameters": table.parameters,
        "cameras": table.several_cameras,
        "scores": [
            {"name": name, "unit": tables.shown_unit(unit)} for name, unit in table.units.items()
        ],
        "rows": [
            {
                "job": row.job + 1,
                "camera": row.camera,
                "parameters": row.parameters,
                "report": Path(os.path.relpath(row.report, folder)).as_posix()
                if row.report
                else "",
                "scores": {
                    name: [v if math.isfinite(v) else None for v in score]
                    for name, score in row.scores.items()
                },
            }
            for row in table.rows
        ],
    }

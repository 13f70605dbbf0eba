"""Catalog: find, query, check and index what is stored.

| module          | content                                                    |
|-----------------|------------------------------------------------------------|
| `record`        | the searchable properties of one store                     |
| `index`         | `refresh`: rebuild index.duckdb, a cache of all records   |
| `index_file`    | the index: records in typed columns of a DuckDB file       |
| `joined_index`  | the indices of several homes as one                        |
| `query/`        | `find`, `sql`, `show`                                      |
| `compare`       | the differences between two stored runs                    |
| `comparison_summary` | what `isethdr catalog compare` prints                 |
| `python_calls`  | `isethdr.find`, `show` and `compare`                       |
| `dataset`       | `isethdr.PictureDataset`: stored pictures for training     |
| `selection`     | the stored pictures that a run, a query or a sweep names   |
| `reproduce`     | repeat a stored run, and list the numbers that differ      |
| `stored_scores` | scores of a metric for the pictures of a stored run        |
| `space`         | disk space of each part of a home, and its removal         |
| `verify`        | read every file and name what is damaged                   |
| `adopt`         | give stores of format 1 a manifest                         |
| `commands`      | `isethdr catalog find`, `sql`, `show`, `report` and the others |
| `report`        | one self-contained page per run, and per sweep             |
"""

from __future__ import annotations

import logging
from importlib.util import find_spec
from typing import TYPE_CHECKING

from isethdr_core.hookspecs import hookimpl

from . import report

if TYPE_CHECKING:
    import typer

    from isethdr_core.plugins.component import Stage

log = logging.getLogger(__name__)
THREAD_SAFE = True  # the hook after a stage does nothing until the whole run is done


@hookimpl
def isethdr_commands(app: typer.Typer) -> None:
    """Add `isethdr catalog` and `isethdr reproduce`."""
    from .commands import REPRODUCE_HELP, catalog, reproduce_run

    app.add_typer(catalog, name="catalog")
    app.command("reproduce", help=REPRODUCE_HELP)(reproduce_run)


@hookimpl
def isethdr_after_stage(stage: Stage) -> None:
    """Write the report next to the store once a whole run is done, if the config asks for it and
    there is none yet. Write the page of a sweep once all of its jobs are done.
    """
    if stage.kind == "sweep":
        report.write_sweep_page(stage.result)
    elif (
        stage.kind == "run"
        and stage.result.attributes.get("config", {}).get("report", True)
        and not stage.result.path.with_suffix(".html").exists()
    ):
        if find_spec("matplotlib") is None:
            log.warning(
                "no report was written: its plots need matplotlib; "
                "type pip install 'isethdr[report]', or report=false to run without"
            )
            return
        report.write_report(stage.result)

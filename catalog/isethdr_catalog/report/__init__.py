"""The report of a run and the page of a sweep: one self-contained HTML file next to its store.

| module     | content                                                               |
|------------|-----------------------------------------------------------------------|
| `page`     | content of each section of the page                                   |
| `sweep_page` | any score of a sweep against any parameter, the best by each score  |
| `compare_page` | two runs: settings, scores and pictures side by side              |
| `named_report` | the report of a stored run, written if it is missing              |
| `templates` | the templates in `templates/`, filled in with every value escaped    |
| `viewer`   | values of every pixel, for the pictures that a reader zooms into      |
| `pictures` | display views, the false-colour scale and labels as embedded images   |
| `plots`    | line profile, signal-to-noise ratio, seconds by stage                 |
| `tables`   | cameras, scores, ledger, omissions, versions                          |
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from isethdr_core.storage.atomic_write import write_text

if TYPE_CHECKING:
    from isethdr_core.runs.run import Result
    from isethdr_core.sweeps.table import SweepTable


def write_report(result: Result) -> Path:
    """Write `<key>.html` next to the run's store and return its path. The file is complete or not
    written at all.
    """
    from .page import page

    path = result.path.with_suffix(".html")
    write_text(path, page(result))
    return path


def write_sweep_page(table: SweepTable) -> Path:
    """Write `index.html` into the folder of a sweep and return its path."""
    from .sweep_page import PAGE, sweep_page

    path = table.sweep.folder / PAGE
    write_text(path, sweep_page(table))
    return path

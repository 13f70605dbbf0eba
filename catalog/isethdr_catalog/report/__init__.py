"""The report of a run, and the page of a sweep: one self-contained HTML file beside its store.

| module     | content                                                               |
|------------|-----------------------------------------------------------------------|
| `page`     | what each section of the page shows                                   |
| `sweep_page` | any score of a sweep against any parameter, the best by each score  |
| `compare_page` | two runs: settings, scores and pictures side by side              |
| `named_report` | the report of a stored run, written where it is not there        |
| `templates` | the templates in `templates/`, filled in with every value escaped    |
| `viewer`   | numbers of every pixel, for the pictures that a reader zooms into     |
| `pictures` | display views, the false-colour scale and labels as embedded images   |
| `plots`    | line profile, signal-to-noise ratio, error beside seconds             |
| `tables`   | cameras, scores, ledger, what was left out, config and versions                |
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from isethdr_core.storage.atomic_write import write_text

if TYPE_CHECKING:
    from isethdr_core.runs.run import Result
    from isethdr_core.sweeps.table import SweepTable


def write_report(result: Result) -> Path:
    """Write `<key>.html` beside the run's store and return its path; written whole or not at
    all.
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

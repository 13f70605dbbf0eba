"""The report of a run: one self-contained HTML file beside its store.

| module     | what                                                                  |
|------------|-----------------------------------------------------------------------|
| `page`     | what each section of the page shows                                   |
| `templates` | the templates in `templates/`, filled in with every value escaped    |
| `viewer`   | numbers of every pixel, for the pictures that a reader zooms into     |
| `pictures` | display views, the false-colour scale and labels as embedded images   |
| `plots`    | line profile, signal-to-noise ratio, error beside seconds             |
| `tables`   | cameras, scores, ledger, what was left out, config and versions                |
"""

from __future__ import annotations

from pathlib import Path

from isethdr_core.storage.atomic_write import write_text


def write_report(result) -> Path:
    """Write `<key>.html` beside the run's store and return its path; written whole or not at
    all.
    """
    from .page import page

    path = result.path.with_suffix(".html")
    write_text(path, page(result))
    return path

"""Files: the page, the tables and the objects of a study in the folder of its dataset."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from isethdr_core.storage.atomic_write import write_text

from ...dataset.record import folder_of
from .csv_tables import means_csv, objects_csv
from .curve_picture import draw_curves
from .markdown import markdown
from .page import page
from .recall import FILE, sought_objects
from .recall_picture import draw_recalls
from .shares import lines
from .study_results import Results


def write_files(results: Results) -> list[tuple[str, Path]]:
    """Write page, tables and objects into the folder of the dataset; return [(title, path)]."""
    stem = "detection" + (f"_{results.question}" if results.question else "")
    folder = folder_of(results.dataset)
    folder.mkdir(parents=True, exist_ok=True)
    tables = [] if results.curve else lines(results.rows, results.cameras)
    if find_spec("matplotlib") is not None:
        common = [] if results.curve else sought_objects(folder / FILE, results.rows)
        if results.curve:
            draw_curves(results, folder / f"{stem}.png")
        elif common:
            draw_recalls(common, folder / f"{stem}_recall.png")
    texts = {
        "page": (f"{stem}.html", page(results, tables)),
        "table": (f"{stem}.md", markdown(results, tables)),
        "means": (f"{stem}.csv", means_csv(results, tables)),
        "objects": (f"{stem}_objects.csv", objects_csv(results.rows)),
    }
    for name, text in texts.values():
        write_text(folder / name, text)
    return [(title, folder / name) for title, (name, _) in texts.items()]

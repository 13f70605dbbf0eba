"""The page of a comparison: settings that differ, scores with intervals, pictures side by side."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from isethdr_core.cli.sweep_summary import scored_text
from isethdr_core.storage.atomic_write import write_text

from ..compare import VERDICT
from . import pictures, tables
from .templates import filled, number, script
from .viewer import finest_look, looks, viewer

if TYPE_CHECKING:
    from markupsafe import Markup

    from ..compare import Comparison, ScorePair, Setting


def write_compare_page(comparison: Comparison, folder: Path) -> Path:
    """Write the page of a comparison into `folder` and return its path."""
    path = folder / f"{comparison.a.path.stem}-{comparison.b.path.stem}.html"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, compare_page(comparison, folder))
    return path


def compare_page(comparison: Comparison, folder: Path) -> Markup:
    """Return the comparison as one HTML document that needs no network.

    Parameters
    ----------
    comparison : two runs and their differences.
    folder : folder of the page, for links to the reports of the runs.
    """
    runs = {"A": comparison.a, "B": comparison.b}
    cameras = [
        replace(look, name=f"{letter} {look.name}")
        for letter, run in runs.items()
        for look in looks(run)
    ]
    reference = finest_look(cameras).truth
    white = pictures.shown_white_cd_m2(reference, [look.picture for look in cameras])
    compressed = pictures.compression(reference, white)
    named = [("Reference", reference), *((look.name, look.picture) for look in cameras)]
    views = [pictures.shown(view, white, name, compressed) for name, view in named]
    shown = viewer(cameras, views, None)
    return filled(
        "compare.html",
        runs=[(letter, run.path.stem, _link(run.path, folder)) for letter, run in runs.items()],
        viewer=shown,
        views=[*enumerate(views)][1:] + [(0, views[0])],  # the reference stands last
        settings=_settings(comparison.settings),
        scores=_scores(comparison.scores),
        versions=_settings(comparison.versions) if comparison.versions else None,
        script=script("viewer.js"),
    )


def _link(store: Path, folder: Path) -> str:
    report = store.with_suffix(".html")
    return Path(os.path.relpath(report, folder)).as_posix() if report.exists() else ""


def _settings(settings: list[Setting]) -> Markup:
    return tables.table(["setting", "A", "B"], [[s.name, s.a, s.b] for s in settings])


def _scores(pairs: list[ScorePair]) -> Markup:
    several = len({pair.cameras for pair in pairs}) > 1
    rows: list[list[tables.Cell]] = [
        [
            pair.score,
            tables.shown_unit(pair.unit),
            *([pair.cameras] if several else []),
            scored_text(pair.a),
            scored_text(pair.b),
            number(pair.difference),
            VERDICT[pair.differs],
        ]
        for pair in pairs
    ]
    head = ["score", "unit", *(["camera"] if several else []), "A", "B", "B − A", "differ"]
    return tables.table(head, rows, tuple(range(2 + several, 5 + several)))

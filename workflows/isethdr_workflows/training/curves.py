"""Curves of a training: a table as CSV, and a drawing if Matplotlib is installed."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from .files import write_file


def write_curves(folder: Path, history: Sequence[dict[str, Any]], titles: dict[str, str]) -> None:
    """Write `curves.csv`, and `curves.png` if Matplotlib is installed.

    Parameters
    ----------
    folder : folder of the training.
    history : rows with `step`, `minutes` and further numbers, which may be missing in a row.
    titles : {name of a number that is drawn: title of its axis}.

    Raises
    ------
    CatalogError : a file cannot be written, for example because the disk is full.
    """
    columns = list(dict.fromkeys(key for row in history for key in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(history)
    write_file(folder / "curves.csv", [text.getvalue().encode()])
    if find_spec("matplotlib") is None or not history:
        return
    draw(folder / "curves.png", history, titles)


def draw(path: Path, history: Sequence[dict[str, Any]], titles: dict[str, str]) -> None:
    """Draw numbers against the step, with one panel for each number.

    Parameters
    ----------
    path : file of the drawing, PNG.
    history : rows of numbers, each with its `step`.
    titles : {name of a number: title of its panel}.
    """
    figure_class = import_module("matplotlib.figure").Figure  # a slow import
    figure = figure_class(figsize=(7, 2.4 * len(titles)), layout="constrained")
    panels = figure.subplots(len(titles), 1, sharex=True, squeeze=False)[:, 0]
    for panel, (key, title) in zip(panels, titles.items(), strict=True):
        known = [(row["step"], row[key]) for row in history if row.get(key) is not None]
        panel.plot(*zip(*known), marker=".") if known else None
        panel.set_ylabel(title)
        panel.grid(True, color="#eee")
    panels[-1].set_xlabel("steps")
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=90)
    write_file(path, [buffer.getbuffer()])

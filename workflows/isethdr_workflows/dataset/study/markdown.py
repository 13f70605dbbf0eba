"""The tables of a study as a page in Markdown, for notes and documentation."""

from __future__ import annotations

import math
import shlex
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ...markdown_table import markdown_table

if TYPE_CHECKING:
    from ..generate import Generated
    from .cameras import Imaged
    from .intervals import Mean
    from .tables import FrameRow, Row, Tables

COLUMNS = 100


def markdown_page(
    dataset: Generated, imaged: Imaged, tables: Tables, overrides: Sequence[str]
) -> str:
    """Return the page as Markdown.

    Parameters
    ----------
    dataset : definition and records of the dataset.
    imaged : scores of the scenes by camera.
    tables : tables of these scores.
    overrides : overrides of all runs.
    """
    name = dataset.definition.name
    roads = len({shot.road for shot in imaged.shots})
    scored = shlex.join(["isethdr", "dataset", "score", name, *overrides])
    about = (
        f"{len(imaged.shots)} scenes of {roads} roads, made by `{dataset.definition.command}`"
        f" and scored by `{scored}`. In brackets:"
        " the 95 % interval of the mean for new roads of the same recipe; scenes of one road count"
        " together. Each scene has one noise realisation unless the command says otherwise. The"
        " detection probability of an object, 0 to 1, is the probability that the measured contrast"
        " between the object and its surround differs from the true contrast by at most half of"
        " the true one (the score `contrast_detection`), the median over its pairs of pixels."
    )
    parts = [f"# Scores of dataset {name}", textwrap.fill(about, COLUMNS)]
    for title, rows in tables.objects.items():
        seen = [row for row in rows if row.objects]
        if seen:
            parts += [f"## Detection probability of objects by {title}", _objects(tables, seen)]
    if tables.frame:
        parts += ["## Whole pictures", _frame(tables)]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _objects(tables: Tables, rows: Sequence[Row]) -> str:
    """Return the table of the objects of some classes.

    Parameters
    ----------
    tables : tables of the study, for the names of the cameras.
    rows : rows of the classes.
    """
    cells = [(row.name, str(row.objects), *map(with_interval, row.means)) for row in rows]
    return markdown_table(["", "objects", *tables.cameras], cells)


def _frame(tables: Tables) -> str:
    """Return the table of the scores of whole pictures, with differences from the first camera."""
    first, *others = tables.cameras
    compared = [f"{name} against {first}" for name in others]
    rows = [_frame_row(row) for row in tables.frame]
    return markdown_table(["score", *tables.cameras, *compared], rows)


def _frame_row(row: FrameRow) -> list[str]:
    """Return the cells of a score: means, then differences or ratios."""
    sign = "× " if row.geometric else ""
    name = f"{row.metric}, {row.unit}" if row.unit not in ("", "1") else row.metric
    differences = [sign + with_interval(mean) for mean in row.differences]
    return [name, *map(with_interval, row.means), *differences]


def with_interval(mean: Mean) -> str:
    """Return a value as text, with its interval if it is known: `0.52 (0.41 to 0.63)`."""
    return f"{shown(mean)} ({interval(mean)})" if interval(mean) else shown(mean)


def shown(mean: Mean) -> str:
    """Return a value as text with three digits; a dash if it is not known."""
    return "–" if math.isnan(mean.value) else f"{mean.value:.3g}"


def interval(mean: Mean) -> str:
    """Return an interval as text, `0.41 to 0.63`; "" if it is not known."""
    return "" if math.isnan(mean.low) else f"{mean.low:.3g} to {mean.high:.3g}"

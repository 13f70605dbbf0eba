"""The page of a study as one HTML document that needs no network, and its tables in Markdown and
CSV.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from isethdr_core.storage.atomic_write import write_text

from ...html_template import html_template
from ..generate import Generated
from ..record import folder_of
from .cameras import Imaged
from .intervals import Mean
from .markdown import interval, markdown_page, shown
from .tables import Row, Seen, Tables, tables_of

PAGE = "scores.html"
TEXT = "scores.md"
TABLE = "scores.csv"
OBJECTS = "objects.csv"
TEMPLATES = Path(__file__).parents[1] / "templates"
COLOURS = ("#2563eb", "#d97706", "#059669", "#9333ea", "#dc2626", "#0891b2")
HEAD = ("table", "row", "camera", "value", "low", "high", "values", "roads")


@dataclass(frozen=True)
class Bar:
    """A mean and its interval on an axis from 0 to 1, in percent of the width of the axis."""

    colour: str
    value: float
    low: float
    width: float


def write_files(dataset: Generated, imaged: Imaged, overrides: Sequence[str]) -> list[Path]:
    """Write page and tables into the folder of a dataset, and return their paths.

    Parameters
    ----------
    dataset : definition and records of the dataset.
    imaged : scores of the scenes by camera.
    overrides : overrides of the command, for the page.
    """
    folder = folder_of(dataset.definition.name)
    tables = tables_of(imaged)
    written = {
        PAGE: page(dataset, imaged, tables, overrides),
        TEXT: markdown_page(dataset, imaged, tables, overrides),
        TABLE: csv_text(HEAD, summary_rows(tables)),
        OBJECTS: csv_text(
            [field.name for field in fields(Seen)], (asdict(one).values() for one in tables.seen)
        ),
    }
    for name, text in written.items():
        write_text(folder / name, text)
    return [folder / name for name in written]


def page(dataset: Generated, imaged: Imaged, tables: Tables, overrides: Sequence[str]) -> str:
    """Return the page as HTML.

    Parameters
    ----------
    dataset : definition and records of the dataset.
    imaged : scores of the scenes by camera.
    tables : tables of these scores.
    overrides : overrides of the command.
    """
    return html_template(TEMPLATES, "scores.html").render(
        definition=dataset.definition,
        scenes=len(imaged.shots),
        roads=len({shot.road for shot in imaged.shots}),
        made=len(dataset.made),
        overrides=overrides,
        failed=[(number + 1, reason) for number, reason in imaged.failed],
        cameras=[(name, colour_of(k)) for k, name in enumerate(tables.cameras)],
        frame=tables.frame,
        tables={
            title: [(row, bars(row)) for row in rows if row.objects]
            for title, rows in tables.objects.items()
        },
        empty={
            title: [row.name for row in rows if not row.objects]
            for title, rows in tables.objects.items()
        },
        shown=shown,
        interval=interval,
    )


def bars(row: Row) -> list[Bar]:
    """Return the bar of each camera, except of cameras without a known mean."""
    found = []
    for k, mean in enumerate(row.means):
        if math.isnan(mean.value):
            continue
        low = mean.value if math.isnan(mean.low) else mean.low
        high = mean.value if math.isnan(mean.high) else mean.high
        found.append(Bar(colour_of(k), 100 * mean.value, 100 * low, 100 * (high - low)))
    return found


def colour_of(place: int) -> str:
    """Return the colour of a camera by its place in the list of cameras."""
    return COLOURS[place % len(COLOURS)]


def summary_rows(tables: Tables) -> list[tuple[object, ...]]:
    """Return one row for each mean, with the columns of `HEAD`."""
    rows: list[tuple[object, ...]] = []
    for frame in tables.frame:
        rows += _rows("frame", frame.metric, tables.cameras, frame.means)
        first = tables.cameras[0]
        compared = f"{'ratio to' if frame.geometric else 'difference from'} {first}"
        rows += _rows(compared, frame.metric, tables.cameras[1:], frame.differences)
    for title, of_objects in tables.objects.items():
        for row in of_objects:
            rows += _rows(f"detection by {title}", row.name, tables.cameras, row.means)
    return rows


def _rows(
    table: str, name: str, cameras: Sequence[str], means: Sequence[Mean]
) -> list[tuple[object, ...]]:
    return [
        (table, name, camera, mean.value, mean.low, mean.high, mean.count, mean.roads)
        for camera, mean in zip(cameras, means, strict=True)
    ]


def csv_text(head: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    """Return rows as CSV text. The cell of an unknown number is empty.

    Parameters
    ----------
    head : names of the columns.
    rows : cells of each row; NaN is an unknown number.
    """
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    for row in rows:
        writer.writerow("" if isinstance(v, float) and math.isnan(v) else v for v in row)
    return out.getvalue()

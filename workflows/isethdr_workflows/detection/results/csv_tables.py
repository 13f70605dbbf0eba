"""The tables of a study as CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields

from .checks import counted_lines
from .shares import Found, Line
from .study_results import Results


def means_csv(results: Results, tables: Sequence[Line]) -> str:
    """Return all means with their intervals as CSV text.

    Parameters
    ----------
    results : results of the study.
    tables : rows of the main tables.
    """
    head = ["table", "row", "camera", "objects", "roads", "found", "low", "high"]
    head += ["noise_only", "contrast_transfer", "median_d"]
    head += ["difference", "difference_low", "difference_high"]
    head += ["contrast_transfer_low", "contrast_transfer_high"]
    head += ["noise_only_d", "noise_only_d_low", "noise_only_d_high"]
    rows: list[list[object]] = []
    points = [("curve", one) for one in results.curve]
    points += [("told apart", one) for one in results.counted_curve]
    for table, point in points:
        rows.append(
            [table, point.level, point.camera, point.objects, point.roads]
            + [point.found, point.low, point.high, "", "", ""]
            + [point.difference, point.difference_low, point.difference_high]
        )
    crossings = [("crossing", *item) for item in results.crossings.items()]
    crossings += [("crossing, told apart", *item) for item in results.counted_crossings.items()]
    for table, name, one in crossings:
        rows.append([table, "level", name, "", "", one.level, one.low, one.high])
    for line in [*tables, *told_apart(results)]:
        for k, camera in enumerate(results.cameras):
            mean = line.means[k]
            own = [line.table, line.name, camera, line.objects, mean.roads]
            own += [mean.value, mean.low, mean.high]
            own += [line.noise_only[k], line.transfer[k].value, line.median_d[k]]
            apart = line.differences[k - 1] if k else None
            own += [apart.value, apart.low, apart.high] if apart else ["", "", ""]
            transfer = line.transfer[k]
            d = line.noise_only_d[k]
            rows.append([*own, transfer.low, transfer.high, d.value, d.low, d.high])
    return _csv(head, rows)


def objects_csv(rows: Sequence[Found]) -> str:
    """Return one row for each object, camera and level of light as CSV text."""
    return _csv([f.name for f in fields(Found)], (list(asdict(row).values()) for row in rows))


def told_apart(results: Results) -> list[Line]:
    """Return the rows of `counted_lines`, with other titles than the main tables."""
    return [line._replace(table=f"told apart: {line.table}") for line in counted_lines(results)]


def _csv(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    for row in rows:
        known = ["" if isinstance(v, float) and math.isnan(v) else v for v in row]
        writer.writerow([*known, *[""] * (len(head) - len(known))])
    return out.getvalue()

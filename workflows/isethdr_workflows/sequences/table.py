"""Table: the exposure of each camera in each frame, printed and as CSV."""

from __future__ import annotations

import csv
import io
from math import log2
from typing import Any

from isethdr_core.cli.sweep_summary import finish
from isethdr_core.cli.terminal import print_path, print_table
from isethdr_core.sequence.exposure import Exposure
from isethdr_core.storage.atomic_write import write_text

from .frames import Made

FILE = "exposures.csv"
HEADS = (
    "frame",
    "time_s",
    "camera",
    "exposure_s",
    "gain",
    "settled_exposure_s",
    "settled_gain",
    "stops",
    "run",
)


def rows_of(made: Made) -> list[dict[str, Any]]:
    """Return one row for each frame and each camera with automatic exposure.

    `stops` is log2 of exposure x gain over the settled exposure x gain. Above 0 the frame is
    overexposed.
    """
    rows = []
    for frame in made.frames:
        for camera, record in frame.exposures.items():
            used, settled = (
                Exposure(one["exposure_s"], one["gain"])
                for one in (record["exposure"], record["settled"])
            )
            values = (
                frame.number,
                frame.time_s,
                camera,
                used.exposure_s,
                used.gain,
                settled.exposure_s,
                settled.gain,
                log2(used.product_s / settled.product_s),
                frame.result.key,
            )
            rows.append(dict(zip(HEADS, values, strict=True)))
    return rows


def show(made: Made) -> None:
    """Print scores and exposures of a sequence, and write the exposures as CSV."""
    finish(made.sweep)
    rows = rows_of(made)
    if not rows:
        print("no camera has automatic exposure")
        return
    shown = [head for head in HEADS if head != "run"]
    cells = [[_short(row[head]) for head in shown] for row in rows]
    print_table(shown, cells, "exposure of each frame")
    out = io.StringIO()
    writer = csv.DictWriter(out, HEADS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    path = made.sweep.folder / FILE
    write_text(path, out.getvalue())
    print_path("exposures", path)


def _short(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)

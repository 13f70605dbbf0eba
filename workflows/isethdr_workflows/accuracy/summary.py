"""Summary: one row for each knob, for a terminal."""

from __future__ import annotations

import math
from itertools import groupby

MOST_KNOBS = 12  # most rows that a terminal shows; the file holds all


def by_knob(rows: list[dict]) -> list[dict]:
    """Return one row per knob: the present setting, and the cheapest one within the error allowed.

    Parameters
    ----------
    rows : rows of the study, as `isethdr_workflows.accuracy.accuracy` returns them.
    """
    summary = []
    for knob, group in groupby(rows, key=lambda row: row["knob"]):
        settings = list(group)
        present = next((row for row in settings if row["now"]), None)
        allowed = settings[0]["allowed"]
        within = [row for row in settings if row["error_of_noise"] <= allowed]
        cheapest = min(within, key=lambda row: row["cpu_s"], default=None)
        summary.append(
            {
                "knob": knob,
                "now": present["value"] if present else "-",
                "error / noise": _short(present and present["error_of_noise"]),
                "CPU s": _short(present and present["cpu_s"]),
                f"cheapest within {allowed:g}": cheapest["value"] if cheapest else "none",
                "its CPU s": _short(cheapest and cheapest["cpu_s"]),
                "tried": len(settings),
            }
        )
    return summary[:MOST_KNOBS]


def _short(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else f"{value:.3g}"

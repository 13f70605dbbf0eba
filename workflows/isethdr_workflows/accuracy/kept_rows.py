"""Kept rows: settings that an earlier call of the same study has measured, so that a study that was
stopped goes on where it stopped.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path

from isethdr_core.runs.run import run_key
from isethdr_core.storage import store
from isethdr_core.storage.atomic_write import write_text

from .configured_knobs import Setting

TABLE = "accuracy.csv"
KEPT = "measured.json"


def row_key(base: Setting, reference: Setting, setting: Setting, knob: str, value: object) -> str:
    """Return the hash of all that can change a row, except for the load of the machine.

    Parameters
    ----------
    base : the configuration as it is, whose noise is the unit of the errors.
    reference : the configuration that the error is measured against.
    setting : the configuration that is measured.
    knob : name of the knob, for example `lens.speckle_error`.
    value : value of the knob.
    """
    keys = [run_key(one.config, one.parts) for one in (base, reference, setting)]
    return store.content_hash([*keys, knob, repr(value)])


def read_rows(folder: Path) -> dict[str, dict]:
    """Return {key: row} of the settings measured so far; a damaged file counts as none."""
    try:
        kept = json.loads((folder / KEPT).read_text())
    except (OSError, ValueError):
        return {}
    return kept if isinstance(kept, dict) else {}


def write_rows(folder: Path, kept: dict[str, dict], rows: Sequence[dict]) -> None:
    """Write the rows for the next call, and the table for people.

    Parameters
    ----------
    folder : folder of the study.
    kept : {key: row} of all settings measured so far, also by other calls with this folder.
    rows : rows of this call in the order of the table.
    """
    write_text(folder / KEPT, json.dumps(kept, indent=1))
    text = io.StringIO(newline="")
    if rows:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    write_text(folder / TABLE, text.getvalue())

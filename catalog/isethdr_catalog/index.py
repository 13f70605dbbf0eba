"""Index: `index.parquet`, a cache of all records, rebuilt from the stores in seconds and replaced by rename.

The truth is in the stores. No writer touches the index, so there is no lock to fight over; delete it at will.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

from isethdr_core.errors import CatalogError

from .record import COLUMNS, records

LARGEST_RECORD_BYTES = 64_000_000


@dataclass(frozen=True)
class Refreshed:
    """What a refresh found: how many records, and every store that was skipped, with the reason."""

    path: Path
    records: int
    skipped: dict[str, str]


def stores(folder) -> list[Path]:
    """Return the paths of all stores of a home folder, complete or not."""
    return [path for part in ("scenes", "runs", "studies") for path in sorted(Path(folder).glob(f"{part}/*.zarr"))]


def refresh(folder) -> Refreshed:
    """Rebuild `<folder>/index.parquet` from the root attributes of all stores; damaged ones are named and skipped."""
    import duckdb

    folder, found, skipped = Path(folder), [], {}
    for path in stores(folder):
        try:
            found += records(path, folder)
        except (CatalogError, AttributeError, TypeError, KeyError, ValueError) as error:    # readable JSON of an unexpected shape
            skipped[str(path)] = str(error) or type(error).__name__
    _pass_on_lighting(found)
    columns = ", ".join(f"{name}: '{kind}'" for name, kind in COLUMNS.items())
    index = folder / "index.parquet"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".index-") as scratch:
            lines, fresh = Path(scratch) / "records.ndjson", Path(scratch) / "index.parquet"
            # DuckDB refuses an empty file, so one blank record is written and filtered out again
            rows = [*found, dict.fromkeys(COLUMNS)]
            lines.write_text("\n".join(json.dumps(_finite(row), allow_nan=False) for row in rows), encoding="utf-8")
            with duckdb.connect() as base:
                base.execute(f"COPY (SELECT * FROM read_json('{_quoted(lines)}', format='newline_delimited', columns={{{columns}}}, "
                             f"maximum_object_size={LARGEST_RECORD_BYTES}) WHERE id IS NOT NULL) TO '{_quoted(fresh)}' (FORMAT parquet)")
            os.replace(fresh, index)
    except OSError as error:
        raise CatalogError(f"cannot write {index}: {error}; choose a folder you may write with ISETHDR_HOME=/path") from error
    return Refreshed(index, len(found), skipped)


def _pass_on_lighting(found: list[dict]) -> None:
    """Give each scene the lightings its runs used: night and day are versions of one stored scene."""
    used: dict[str, set] = {}
    for record in found:
        for scene in record["properties"].get("scene_ids") or [record["derived_from"]]:
            used.setdefault(scene, set()).add(record["properties"].get("lighting"))
    for record in found:
        if record["kind"] == "scene":
            record["properties"]["lighting"] = sorted(used.get(record["id"], set()) - {None})


def _finite(value):
    """Return `value` with NaN as null, which SQL knows how to skip, and infinity as a number beyond all others."""
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else math.copysign(1e308, value)
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    return [_finite(v) for v in value] if isinstance(value, list) else value


def _quoted(path) -> str:
    return str(path).replace("'", "''")

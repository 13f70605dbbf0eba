"""Index file: a DuckDB file with the records of stores in typed columns, so that a query reads only
the columns that it names.

| table      | one row for each                                                                   |
|------------|------------------------------------------------------------------------------------|
| `about`    | file: the version of this layout                                                   |
| `store`    | store that was read: its number, its path, and the state of its root metadata      |
| `property` | property: its name, its column of `shots`, its type, and whether it is a score     |
| `shots`    | store and camera                                                                   |
| `scores`, `object_scores` | score of the whole picture, or of an object                         |
| `objects`  | labelled object                                                                    |

One process changes a file under a temporary name and renames it. After that it never changes.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from isethdr_core.extras import needed

from .record import SCHEMA

if TYPE_CHECKING:
    import duckdb

ALIAS = "idx"  # name of the attached file in SQL
BATCH_BYTES = 1_000_000  # size of the records that are passed to DuckDB at once
ROW_GROUP = 16_384  # number of rows that DuckDB compresses together
MEMORY = "400MB"  # limit of DuckDB's memory while a file is written; the rest is on disk
MOST_COLUMNS = 4000  # greatest number of columns; other properties are read from JSON
# types of a property; LIST: at least one of its values is a list
NUMBER = "number"
TEXT = "text"
LIST = "list"
RECORD = {
    "store": "BIGINT",
    "id": "VARCHAR",
    "kind": "VARCHAR",
    "camera": "VARCHAR",
    "name": "VARCHAR",
    "path": "VARCHAR",
    "created": "VARCHAR",
    "derived_from": "VARCHAR",
    "properties": "JSON",
    "ledger": "JSON",
    "assets": "JSON",
}
SCORE = {
    "store": "BIGINT",
    "id": "VARCHAR",
    "camera": "VARCHAR",
    "sensor": "VARCHAR",
    "lighting": "VARCHAR",
    "metric": "VARCHAR",
    "object": "VARCHAR",
    "value": "DOUBLE",
    "unit": "VARCHAR",
    "low": "DOUBLE",
    "high": "DOUBLE",
}
OBJECT = {
    "store": "BIGINT",
    "id": "VARCHAR",
    "kind": "VARCHAR",
    "lighting": "VARCHAR",
    "instance": "BIGINT",
    "name": "VARCHAR",
    "category": "VARCHAR",
    "distance_m": "DOUBLE",
    "visible_fraction": "DOUBLE",
    "box": "JSON",
}
TABLES = {
    "about": {"schema": "INTEGER"},
    "store": {"number": "BIGINT", "path": "VARCHAR", "stamp": "VARCHAR"},
    "property": {"name": "VARCHAR", "place": "INTEGER", "type": "VARCHAR", "score": "BOOLEAN"},
    "shots": RECORD,
    "scores": SCORE,
    "object_scores": SCORE,
    "objects": OBJECT,
}
OF_STORES = ("shots", "scores", "object_scores", "objects")


def _library() -> Any:
    """Return the module of DuckDB, which takes long to import; name the extra if it is missing."""
    with needed("the index of the catalog", extra="catalog"):
        return import_module("duckdb")


@contextmanager
def connected() -> Iterator[duckdb.DuckDBPyConnection]:
    """Yield a database in memory, to which index files are attached."""
    with _library().connect() as base:
        yield base


@contextmanager
def errors_of_duckdb() -> Iterator[None]:
    """Raise OSError where DuckDB cannot write within the block, for example because the disk is
    full.

    Raises
    ------
    OSError : the block raised an error of DuckDB.
    """
    library = _library()
    try:
        yield
    except library.Error as error:
        raise OSError(" ".join(str(error).split())) from error


def attach(base: duckdb.DuckDBPyConnection, path: Path, alias: str = ALIAS) -> bool:
    """Attach an index file for reading; return False if it is missing, damaged or of another
    layout.

    Parameters
    ----------
    base : DuckDB connection.
    path : index file.
    alias : name of the attached database in SQL.
    """
    library = _library()
    if not path.is_file():
        return False
    try:
        base.execute(f"ATTACH '{quoted(path)}' AS {alias} (READ_ONLY, TYPE duckdb)")
    except library.Error:
        return False
    try:
        found = base.execute(f"SELECT schema FROM {alias}.about").fetchone()
    except library.Error:
        found = None
    if found == (SCHEMA,):
        return True
    detach(base, alias)
    return False


def detach(base: duckdb.DuckDBPyConnection, alias: str = ALIAS) -> None:
    """Detach the file."""
    base.execute(f"DETACH {alias}")


def known(base: duckdb.DuckDBPyConnection, alias: str = ALIAS) -> dict[str, str]:
    """Return {path: stamp} of the stores in the attached file."""
    return dict(base.execute(f"SELECT path, stamp FROM {alias}.store").fetchall())


def count(base: duckdb.DuckDBPyConnection, alias: str = ALIAS) -> int:
    """Return the number of records in the attached file."""
    found = base.execute(f"SELECT count(*) FROM {alias}.shots").fetchone()
    return int(found[0]) if found else 0


def properties(base: duckdb.DuckDBPyConnection, alias: str = ALIAS) -> dict[str, Property]:
    """Return the properties of the attached file by name."""
    rows = base.execute(f"SELECT name, place, type, score FROM {alias}.property").fetchall()
    return {row[0]: Property(*row) for row in rows}


@dataclass
class Property:
    """A property of records, and the place of its values."""

    name: str
    place: int | None  # number of its column; None: in the JSON `properties` only
    kind: str
    score: bool  # whether it is a score of the whole picture

    @property
    def column(self) -> str | None:
        """The column of `shots`; None if the property has none."""
        return None if self.place is None else f"p{self.place}"


def whole_properties(known: dict[str, Property]) -> str:
    """Return the SQL of the JSON of all properties; scenes also get the lightings of their runs."""
    lighting = known.get("lighting")
    if lighting is None or lighting.column is None:
        return "properties"
    return (
        f"CASE WHEN kind = 'scene' AND {lighting.column} IS NOT NULL THEN json_merge_patch("
        f"properties, json_object('lighting', {lighting.column}::JSON)) ELSE properties END"
    )


class Writer:
    """Writer of one index file, which no other process uses."""

    def __init__(self, base: duckdb.DuckDBPyConnection, path: Path) -> None:
        """Attach `path` for writing; make the file if it does not exist."""
        self.base = base
        fresh = not path.exists()
        base.execute("SET threads=1")  # leave the other cores to other processes
        base.execute(f"SET memory_limit='{MEMORY}'")
        base.execute(f"SET temp_directory='{quoted(path.parent)}'")
        base.execute("SET preserve_insertion_order=false")
        base.execute("SET wal_autocheckpoint='100MB'")  # each checkpoint writes blocks again
        base.execute(f"ATTACH '{quoted(path)}' AS {ALIAS} (ROW_GROUP_SIZE {ROW_GROUP})")
        if fresh:
            for table, columns in TABLES.items():
                base.execute(f"CREATE TABLE {ALIAS}.{table} ({_columns(columns)})")
            base.execute(f"INSERT INTO {ALIAS}.about VALUES ({SCHEMA})")
        self.properties = properties(base)
        highest = base.execute(f"SELECT max(number) FROM {ALIAS}.store").fetchone()
        self.next = 1 + ((highest and highest[0]) or 0)

    def remove(self, paths: Iterable[str]) -> None:
        """Remove the records of stores."""
        gone = list(paths)
        if not gone:
            return
        self.base.execute("CREATE OR REPLACE TEMP TABLE gone AS SELECT unnest(?) AS path", [gone])
        numbers = f"SELECT number FROM {ALIAS}.store SEMI JOIN gone USING (path)"
        for table in OF_STORES:
            self.base.execute(f"DELETE FROM {ALIAS}.{table} WHERE store IN ({numbers})")
        self.base.execute(f"DELETE FROM {ALIAS}.store WHERE path IN (SELECT path FROM gone)")

    def add(self, stores: Iterable[tuple[str, str, list[dict[str, Any]]]]) -> None:
        """Add stores, each with its path, its stamp and its records. They are written in batches,
        so that memory does not grow with their number.
        """
        batch = []
        size = 0
        read: list[tuple[int, str, str]] = []
        for path, stamp, rows in stores:
            read.append((self.next, path, stamp))
            for row in rows:
                self._note(row["properties"])
                text = json.dumps(finite(row | {"store": self.next}), allow_nan=False)
                batch.append(text)
                size += len(text)
            self.next += 1
            if size > BATCH_BYTES:
                self._insert(batch, read)
                batch = []
                read = []
                size = 0
        self._insert(batch, read)

    def close(self) -> int:
        """Give scenes the lightings of their runs and detach the file; return the number of its
        records.
        """
        self._pass_on_lighting()
        found = count(self.base)
        self.base.execute(f"CHECKPOINT {ALIAS}")
        detach(self.base)
        return found

    def _note(self, values: dict[str, Any]) -> None:
        """Record the names and types of properties; columns are made with the next batch."""
        for name, value in values.items():
            if value is None:
                continue
            kind = _kind(value)
            before = self.properties.get(name)
            if before is None:
                self.properties[name] = Property(name, None, kind, False)
            elif before.kind != kind and before.kind != LIST:
                before.kind = LIST if kind == LIST else TEXT
        for name in values.get("scores") or ():
            if name in self.properties:
                self.properties[name].score = True

    def _insert(self, batch: list[str], read: list[tuple[int, str, str]]) -> None:
        if not read:
            return
        self.base.execute("BEGIN")
        self._make_columns()
        self.base.execute(
            f"INSERT INTO {ALIAS}.store SELECT unnest(?), unnest(?), unnest(?)",
            [list(column) for column in zip(*read, strict=True)],
        )
        if batch:
            self._insert_records(f"[{','.join(batch)}]")
        self.base.execute("COMMIT")

    def _insert_records(self, batch: str) -> None:
        whole = json.dumps([RECORD | {"scores": "JSON", "objects": "JSON"}])
        self.base.execute(
            "CREATE OR REPLACE TEMP TABLE fresh AS"
            f" SELECT unnest(from_json(?, '{whole}'), recursive := true)",
            [batch],
        )
        placed = [p for p in self.properties.values() if p.column]
        types = {p.name: "DOUBLE" if p.kind == NUMBER else "VARCHAR" for p in placed}
        values = ", ".join(f"values_of.{identifier(p.name)} AS {p.column}" for p in placed)
        wide = (
            f"SELECT * EXCLUDE (values_of){', ' * bool(values)}{values} FROM"
            f" (SELECT {', '.join(RECORD)}, from_json(properties, '{quoted(json.dumps(types))}')"
            " AS values_of FROM fresh)"
        )
        self.base.execute(f"INSERT INTO {ALIAS}.shots BY NAME {wide}")
        self.base.execute("""
            CREATE OR REPLACE TEMP TABLE fresh_scores AS
            SELECT store, id, camera, sensor, lighting, s->>'metric' AS metric,
              coalesce(s->>'object', '') AS object, try_cast(s->>'value' AS DOUBLE) AS value,
              s->>'unit' AS unit, try_cast(s->>'low' AS DOUBLE) AS low,
              try_cast(s->>'high' AS DOUBLE) AS high
            FROM (SELECT store, id, camera, properties->>'sensor' AS sensor,
              properties->>'lighting' AS lighting,
              unnest(from_json(scores, '["JSON"]')) AS s FROM fresh)
        """)
        for table, condition in (("scores", "object = ''"), ("object_scores", "object <> ''")):
            self.base.execute(
                f"INSERT INTO {ALIAS}.{table} SELECT * FROM fresh_scores WHERE {condition}"
            )
        self.base.execute(f"""
            INSERT INTO {ALIAS}.objects
            SELECT store, id, kind, lighting, try_cast(o->>'instance' AS BIGINT), o->>'name',
              o->>'category', try_cast(o->>'distance_m' AS DOUBLE),
              try_cast(o->>'visible_fraction' AS DOUBLE), o->'box'
            FROM (SELECT store, any_value(id) AS id, any_value(kind) AS kind,
              any_value(properties->>'lighting') AS lighting,
              unnest(from_json(any_value(objects), '["JSON"]')) AS o FROM fresh GROUP BY store)
        """)

    def _make_columns(self) -> None:
        """Make columns for new properties, and turn number columns with other values into text."""
        stored = properties(self.base)
        places = [p.place for p in stored.values() if p.place is not None]
        free = 1 + max(places, default=-1)
        # names in a struct are not case-sensitive and must not be empty
        taken = {name.lower() for name in stored} | {""}
        for name, found in self.properties.items():
            before = stored.get(name)
            if before is None:
                if name.lower() not in taken and free < MOST_COLUMNS:
                    taken.add(name.lower())
                    found.place = free
                    free += 1
                    self.base.execute(
                        f"ALTER TABLE {ALIAS}.shots ADD COLUMN {found.column} {_type(found)}"
                    )
            elif before.kind == NUMBER and found.kind != NUMBER and found.column:
                self.base.execute(
                    f"ALTER TABLE {ALIAS}.shots ALTER COLUMN {found.column} TYPE VARCHAR"
                )
        self.base.execute(f"DELETE FROM {ALIAS}.property")
        self.base.execute(
            f"INSERT INTO {ALIAS}.property SELECT unnest(?), unnest(?), unnest(?), unnest(?)",
            [
                [p.name for p in self.properties.values()],
                [p.place for p in self.properties.values()],
                [p.kind for p in self.properties.values()],
                [p.score for p in self.properties.values()],
            ],
        )

    def _pass_on_lighting(self) -> None:
        """Give each scene the lightings of its runs, since night and day are versions of one stored
        scene. The JSON of its properties stays unchanged; `whole_properties` adds them.
        """
        if not self.base.execute(
            f"SELECT 1 FROM {ALIAS}.shots WHERE kind = 'scene' LIMIT 1"
        ).fetchall():
            return
        self._note({"lighting": []})
        self._make_columns()
        lighting = self.properties["lighting"].column
        several = self.properties.get("scene_ids")
        scenes = "[derived_from]"
        if several is not None and several.kind == LIST and several.column:
            scenes = (
                f"CASE WHEN {several.column} LIKE '[\"%' THEN"
                f" from_json({several.column}, '[\"VARCHAR\"]') ELSE {scenes} END"
            )
        self.base.execute(f"""
            CREATE OR REPLACE TEMP TABLE used AS
            SELECT scene, to_json(list_sort(list(DISTINCT lighting)))::VARCHAR AS lightings
            FROM (SELECT {lighting} AS lighting, unnest({scenes}) AS scene
              FROM {ALIAS}.shots WHERE kind = 'run')
            WHERE lighting IS NOT NULL GROUP BY scene
        """)
        self.base.execute(f"""
            CREATE OR REPLACE TEMP TABLE changed AS
            SELECT DISTINCT store, coalesce(lightings, '[]') AS lightings
            FROM {ALIAS}.shots LEFT JOIN used ON id = scene
            WHERE kind = 'scene' AND {lighting} IS DISTINCT FROM coalesce(lightings, '[]')
        """)
        self.base.execute(f"""
            UPDATE {ALIAS}.shots SET {lighting} = lightings
            FROM changed WHERE shots.store = changed.store
        """)
        self.base.execute(f"""
            UPDATE {ALIAS}.objects SET lighting = lightings
            FROM changed WHERE objects.store = changed.store
        """)


def finite(value: Any) -> Any:
    """Return `value` with NaN as null, which SQL skips, and infinity as 1e308."""
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else math.copysign(1e308, value)
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    return [finite(v) for v in value] if isinstance(value, list) else value


def quoted(text: object) -> str:
    """Return a text escaped for use between single quotes of SQL."""
    return str(text).replace("'", "''")


def identifier(name: str) -> str:
    """Return a name as a quoted identifier of SQL."""
    return '"' + name.replace('"', '""') + '"'


def pointer(name: str) -> str:
    """Return the JSON pointer of a flat property, as an SQL text. A JSON path would split a name at
    its dots.
    """
    return "'/" + quoted(name.replace("~", "~0").replace("/", "~1")) + "'"


def _kind(value: object) -> str:
    if isinstance(value, list):
        return LIST
    return NUMBER if isinstance(value, int | float) and not isinstance(value, bool) else TEXT


def _type(found: Property) -> str:
    return "DOUBLE" if found.kind == NUMBER else "VARCHAR"


def _columns(columns: dict[str, str]) -> str:
    return ", ".join(f"{name} {kind}" for name, kind in columns.items())

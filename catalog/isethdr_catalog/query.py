"""Queries: `find` by conditions, `sql` for everything else, `show` one store.

`find(folder, kind="run", sensor="rgbw", order_by="ssim")`; an operator follows the name after two
underscores: `__ge __le __gt __lt __ne __in`. In Python a dot of a name may be written as two
underscores: `person__distance_m__le=30`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from isethdr_core.errors import MOST_LISTED, CatalogError, did_you_mean
from isethdr_core.extras import needed
from isethdr_core.runs.labels import read_labels
from isethdr_core.storage.encoding import jsonable
from isethdr_core.store import read_attrs

from .index import load, stores

if TYPE_CHECKING:
    import duckdb

OPERATORS = {"ge": ">=", "le": "<=", "gt": ">", "lt": "<"}
PLAIN = ("id", "kind", "camera", "name", "path", "created", "derived_from")
# Set before a user's text runs. Records are in memory by then, so a query needs no file, network or
# extension. `lock_configuration` comes last: no statement can undo it.
SANDBOX = (
    "SET temp_directory=''",
    "SET python_enable_replacements=false",
    "SET autoinstall_known_extensions=false",
    "SET autoload_known_extensions=false",
    "SET enable_external_access=false",
    "SET lock_configuration=true",
)
VIEWS = """
CREATE VIEW stores AS SELECT id, kind, any_value(name) AS name, path,
  any_value(created) AS created, any_value(derived_from) AS derived_from,
  list(camera) AS cameras, any_value(properties) AS properties,
  any_value(ledger) AS ledger, any_value(assets) AS assets
  FROM shots GROUP BY id, kind, path;
CREATE VIEW objects AS SELECT id, kind, lighting, (o->>'instance')::BIGINT AS instance,
  o->>'name' AS name, o->>'category' AS category,
  (o->>'distance_m')::DOUBLE AS distance_m, (o->>'visible_fraction')::DOUBLE AS visible_fraction,
  o->'box' AS box
  FROM (SELECT id, kind, any_value(properties->>'lighting') AS lighting,
    unnest(from_json(any_value(objects), '["JSON"]')) AS o
        FROM shots GROUP BY id, kind);
CREATE VIEW all_scores AS SELECT id, camera, sensor, lighting, s->>'metric' AS metric,
  s->>'object' AS object, (s->>'value')::DOUBLE AS value,
  s->>'unit' AS unit, (s->>'low')::DOUBLE AS low, (s->>'high')::DOUBLE AS high
  FROM (SELECT id, camera, properties->>'sensor' AS sensor, properties->>'lighting' AS lighting,
        unnest(from_json(scores, '["JSON"]')) AS s FROM shots);
CREATE VIEW scores AS SELECT * FROM all_scores WHERE object = '';
CREATE VIEW object_scores AS SELECT * FROM all_scores WHERE object <> '';
"""


def find(folder, order_by: str | None = None, limit: int = 50, **conditions) -> list[dict]:
    """Return the scenes, and the runs (one row per camera), that meet all conditions.

    Parameters
    ----------
    folder : the home folder, with `scenes/` and `runs/`.
    order_by : a property; a leading `-` puts the largest first. Rows without it come last.
    conditions : property=value, or property__operator=value. A list property equals a value that it
        holds.

    Returns
    -------
    list of dict : id, kind, camera, path, and every property that was asked about. Beside a score
        stands `valid_share`, the share of valid pixels, where it is recorded.

    Raises
    ------
    CatalogError : a property that no record has.
    """
    tests = [_split(key) + (value,) for key, value in conditions.items()]
    ordered = (order_by or "").removeprefix("-").replace("__", ".")
    with _connect(folder, details=False) as base:
        properties = list(
            dict.fromkeys([name for name, _, _ in tests] + ([ordered] if ordered else []))
        )
        _check_known(base, properties)
        clauses, values = [], []
        for name, operator, value in tests:
            clause, bound = _clause(name, operator, value)
            clauses.append(clause)
            values += bound
        extra = _with_share(base, [name for name in properties if name not in PLAIN])
        columns = ", ".join(
            [
                "id",
                "kind",
                "camera",
                "path",
                *(
                    f"json_extract(properties, {_pointer(name)}) AS {_identifier(name)}"
                    for name in extra
                ),
            ]
        )
        order = "created DESC, id, camera"
        if ordered:
            direction = "DESC" if order_by.startswith("-") else "ASC"
            order = (
                f"try_cast({_text(ordered)} AS DOUBLE) {direction} NULLS LAST, {_text(ordered)}"
                f" {direction}"
                " NULLS LAST, id"
            )
        rows = base.execute(
            f"SELECT {columns} FROM shots {'WHERE ' if clauses else ''}{' AND '.join(clauses)} "
            f"ORDER BY {order} LIMIT {int(limit)}",
            values,
        )
        names = [d[0] for d in rows.description]
        return [
            {
                k: json.loads(v) if k in extra and v is not None else v
                for k, v in zip(names, row, strict=True)
            }
            for row in rows.fetchall()
        ]


def sql(folder, text: str) -> tuple[list[str], list[tuple]]:
    """Run a DuckDB query over the views `stores`, `shots`, `objects`, `scores` (of the whole
    picture) and `object_scores`.

    The query sees records in memory only. It cannot read, write or attach a file, load an
    extension, reach a network or change the configuration (see `SANDBOX`).

    Returns
    -------
    column names, and rows as tuples.

    Raises
    ------
    CatalogError : the text holds no statement, does not run, or asks for more than the records.
    """
    with needed("a query", extra="catalog"):
        import duckdb

    with _connect(folder) as base:
        try:
            if not base.extract_statements(text):
                raise CatalogError(
                    "the query is empty; expected SQL over the views stores, shots, objects,"
                    " scores, object_scores, for example: isethdr catalog sql"
                    ' "SELECT * FROM scores LIMIT 5"'
                )
            rows = base.execute(text)
            return [d[0] for d in rows.description or []], rows.fetchall()
        except (duckdb.Error, ValueError, OverflowError) as error:  # values that Python cannot hold
            raise CatalogError(
                f"the query does not run: {error}; views: stores, shots, objects, scores,"
                " object_scores; `DESCRIBE scores` lists the columns"
            ) from error


def show(folder, name: str) -> dict:
    """Return the root attributes of the store whose key begins with `name`, or of the run that is
    called so, with its `path`.

    Raises
    ------
    CatalogError : no store is called so, or several are.
    """
    found = [p for p in stores(folder) if p.stem.startswith(str(name).removesuffix(".zarr"))]
    found = found or [p for p in stores(folder) if read_labels(p).name == name]
    exact = [p for p in found if p.stem == name] or found
    if len(exact) != 1:
        some = ", ".join(p.stem for p in exact[:MOST_LISTED])
        more = f" and {len(exact) - MOST_LISTED} more" if len(exact) > MOST_LISTED else ""
        problem = (
            f"could be any of {some}{more}"
            if exact
            else "names no store" + did_you_mean(name, [p.stem for p in stores(folder)])
        )
        raise CatalogError(f"{name!r} {problem}; looked in {folder}")
    return {"path": str(exact[0]), **read_attrs(exact[0])}


def shown(folder: Path | str, name: str) -> str:
    """Return what `show` returns as indented JSON."""
    return json.dumps(jsonable(show(folder, name)), indent=2)


def _connect(folder: Path | str, details: bool = True) -> duckdb.DuckDBPyConnection:
    """Return a database in memory with the views, over the records of all stores."""
    with needed("a query", extra="catalog"):
        import duckdb

    base = duckdb.connect()
    load(base, folder, details)
    base.execute(VIEWS)
    for setting in SANDBOX:
        base.execute(setting)
    return base


def _split(key: str) -> tuple[str, str]:
    name, _, operator = key.rpartition("__")
    if name and operator in (*OPERATORS, "ne", "in"):
        return name.replace("__", "."), operator
    return key.replace("__", "."), "eq"


def _with_share(base: duckdb.DuckDBPyConnection, names: list[str]) -> list[str]:
    """Return the properties to show: with the share of valid pixels where one of them is a
    score.
    """
    scores_json = "from_json(properties->'scores', '[\"VARCHAR\"]')"
    scores = {
        name
        for (name,) in base.execute(f"SELECT DISTINCT unnest({scores_json}) FROM shots").fetchall()
    }
    if "valid_share" in scores and "valid_share" not in names and scores & set(names):
        return [*names, "valid_share"]
    return names


def _check_known(base, names) -> None:
    known = {
        key
        for (key,) in base.execute(
            "SELECT DISTINCT unnest(json_keys(properties)) FROM shots"
        ).fetchall()
    } | set(PLAIN)
    for name in names:
        if known > set(PLAIN) and name not in known:
            raise CatalogError(f"no record has the property {name!r}{did_you_mean(name, known)}")


def _clause(name: str, operator: str, value) -> tuple[str, list]:
    """Return the SQL of one condition and the values it binds."""
    text = _text(name)
    if operator in OPERATORS:
        try:
            return f"try_cast({text} AS DOUBLE) {OPERATORS[operator]} ?", [float(value)]
        except ValueError:
            return f"{text} {OPERATORS[operator]} ?", [
                str(value)
            ]  # dates, and other text that sorts
    alternatives = (
        value
        if isinstance(value, (list, tuple, set))
        else str(value).split(",")
        if operator == "in"
        else [value]
    )
    tests, values = [], []
    for alternative in alternatives:
        alternative = (
            str(alternative).lower() if isinstance(alternative, bool) else str(alternative)
        )
        tests.append(
            f"({text} = ? OR try_cast({text} AS DOUBLE) = try_cast(? AS DOUBLE)"
            + (
                ""
                if name in PLAIN
                else f" OR json_contains(json_extract(properties, {_pointer(name)}), to_json(?))"
            )
            + ")"
        )
        values += [alternative, alternative] + ([] if name in PLAIN else [alternative])
    joined = " OR ".join(tests) or "false"
    return (
        f"coalesce(NOT ({joined}), true)" if operator == "ne" else f"coalesce({joined}, false)"
    ), values


def _text(name: str) -> str:
    return name if name in PLAIN else f"json_extract_string(properties, {_pointer(name)})"


def _pointer(name: str) -> str:
    """Return the JSON pointer of a flat property, as an SQL text; names hold dots, so a path would
    not do.
    """
    return "'/" + name.replace("~", "~0").replace("/", "~1").replace("'", "''") + "'"


def _identifier(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'

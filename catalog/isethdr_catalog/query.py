"""Queries: `find` by conditions, `sql` for everything else, `show` one store.

`find(folder, kind="run", sensor="rgbw", order_by="ssim")`; an operator follows the name after two
underscores: `__ge __le __gt __lt __ne __in`. In Python a dot of a name may be written as two
underscores: `person__distance_m__le=30`.

All three functions read one home or several (`storage.home_folder.existing_homes`).
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from isethdr_core.errors import MOST_LISTED, CatalogError, did_you_mean
from isethdr_core.extras import needed
from isethdr_core.runs.labels import read_labels
from isethdr_core.storage.encoding import jsonable
from isethdr_core.storage.home_folder import StoredHome
from isethdr_core.store import read_attrs

from . import index_file
from .index import state, stores
from .joined_index import attach_all, home_column

if TYPE_CHECKING:
    import duckdb

Homes = Path | str | Sequence[StoredHome]  # folder of one home, or a sequence of existing homes
OPERATORS = {"ge": ">=", "le": "<=", "gt": ">", "lt": "<"}
PLAIN = ("id", "kind", "camera", "name", "path", "created", "derived_from")
HOME = "home"  # column with the home of a record
SHOWN = ("id", "kind", "camera", "path")  # columns of `find`; with several homes also the home
SHARE = "valid_share"
_KEPT: dict[
    tuple[int, tuple[StoredHome, ...]], tuple[duckdb.DuckDBPyConnection, list[dict[str, Any]]]
] = {}
# Set before a user's text runs. The index is open by then, so a query needs no file, network or
# extension. `lock_configuration` comes last: no statement can undo it.
SANDBOX = (
    "SET temp_directory=''",
    "SET python_enable_replacements=false",
    "SET autoinstall_known_extensions=false",
    "SET autoload_known_extensions=false",
    "SET enable_external_access=false",
    "SET lock_configuration=true",
)
# types of statements that a user may type: READING ones change nothing, MAKING ones make tables in
# memory; others (ATTACH, DETACH, COPY, SET, LOAD, ...) are refused
READING = ("SELECT", "EXPLAIN")
MAKING = ("CREATE", "INSERT", "UPDATE", "DELETE", "DROP", "ALTER", "MULTI")
VIEW_NAMES = ("stores", "shots", "properties", "objects", "scores", "object_scores")
VIEWS = """
CREATE VIEW shots AS SELECT id, kind, camera, name, path, created, derived_from,
  {properties} AS properties, ledger, assets, {home} AS home FROM idx.shots;
CREATE VIEW stores AS SELECT id, kind, any_value(name) AS name, path,
  any_value(created) AS created, any_value(derived_from) AS derived_from,
  list(camera) AS cameras, any_value(properties) AS properties,
  any_value(ledger) AS ledger, any_value(assets) AS assets, home
  FROM shots GROUP BY id, kind, path, home;
CREATE VIEW objects AS SELECT {rest}, {home} AS home FROM idx.objects;
CREATE VIEW scores AS SELECT {rest}, {home} AS home FROM idx.scores;
CREATE VIEW object_scores AS SELECT {rest}, {home} AS home FROM idx.object_scores;
CREATE VIEW all_scores AS SELECT * FROM scores UNION ALL SELECT * FROM object_scores;
"""


def find(
    homes: Homes,
    order_by: str | None = None,
    limit: int = 50,
    also: Sequence[str] = (),
    **conditions: Any,
) -> list[dict[str, Any]]:
    """Return the scenes, and the runs (one row per camera), that meet all conditions.

    Parameters
    ----------
    homes : home folder, with `scenes/` and `runs/`, or several homes.
    order_by : a property; a leading `-` puts the largest first. Rows without it come last.
    limit : largest number of rows.
    also : further properties to return, if any record has them.
    conditions : property=value, or property__operator=value. A list property equals every value
        that it holds.

    Returns
    -------
    list of dict : id, kind, camera, path, and every property in `conditions` and `order_by`. If one
        of them is a score, also `valid_share`, the share of valid pixels, if it is recorded. With
        several homes also `home`; a store in two homes has a row for each.

    Raises
    ------
    CatalogError : no record has a property.
    """
    tests = [(*_split(key), value) for key, value in conditions.items()]
    ordered = (order_by or "").removeprefix("-").replace("__", ".")
    places = _homes(homes)
    with _reading(places) as base:
        known = index_file.properties(base)
        asked = list(dict.fromkeys([n for n, _, _ in tests] + ([ordered] if ordered else [])))
        _check_known(base, known, asked)
        clauses = []
        values = []
        for name, operator, value in tests:
            clause, bound = _clause(_column(known, name, places), operator, value)
            clauses.append(clause)
            values += bound
        where = f"WHERE {' AND '.join(clauses)}" if clauses else ""
        order = "created DESC, id, camera"
        if ordered:
            direction = "DESC" if str(order_by).startswith("-") else "ASC"
            order = f"{_order(_column(known, ordered, places), direction)}, id"
        order += f", {HOME}" if len(places) > 1 else ""
        chosen = base.execute(
            f"SELECT rowid FROM idx.shots {where} ORDER BY {order} LIMIT {int(limit)}", values
        ).fetchall()
        shown = dict.fromkeys([*(name for name in also if name in known), *asked])
        extra = _with_share(known, [name for name in shown if name not in (*PLAIN, HOME)])
        whole = index_file.whole_properties(known)
        fixed = (*SHOWN, HOME) if len(places) > 1 else SHOWN
        return _rows(base, [row for (row,) in chosen], fixed, extra, whole)


def path_of(row: Mapping[str, Any], homes: Sequence[StoredHome]) -> Path:
    """Return the path of the store of a row that `find` returned for these homes."""
    folders = {home.name: home.folder for home in homes}
    return folders[row.get(HOME, homes[0].name)] / str(row["path"])


def sql(homes: Homes, text: str) -> tuple[list[str], list[tuple[Any, ...]]]:
    """Run a DuckDB query over the views `stores`, `shots`, `objects`, `scores` (of the whole
    picture) and `object_scores`.

    The query sees the records only. It cannot read, write or attach a file, load an extension,
    reach a network or change the configuration (see `SANDBOX`, `READING` and
    `MAKING`).

    Returns
    -------
    column names, and rows as tuples.

    Raises
    ------
    CatalogError : the text holds no statement, does not run, or asks for more than the records.
    """
    with needed("a query", extra="catalog"):
        import duckdb

    try:
        with _reading(_homes(homes)) as base:
            statements = _checked(base, text)
            if all(statement.type.name in READING for statement in statements):
                return _result(base, text)
        with _own_database(_homes(homes)) as base:  # closed with the tables that the query makes
            return _result(base, text)
    except (duckdb.Error, ValueError, OverflowError) as error:  # values that Python cannot hold
        # keep one line: after an empty line DuckDB repeats the query with a mark
        reason = " ".join(str(error).partition("\n\n")[0].split())
        raise CatalogError(
            f"the query does not run: {reason}; views: {', '.join(VIEW_NAMES)};"
            " `DESCRIBE scores` lists the columns"
        ) from error


def _checked(base: duckdb.DuckDBPyConnection, text: str) -> list[duckdb.Statement]:
    """Return the statements of a text.

    Raises
    ------
    CatalogError : the text has no statement, or one that may do more than work on the records.
    """
    statements = base.extract_statements(text)
    if not statements:
        raise CatalogError(
            f"the query is empty; expected SQL over the views {', '.join(VIEW_NAMES)}, for example:"
            ' isethdr catalog sql "SELECT * FROM scores LIMIT 5"'
        )
    for statement in statements:
        if statement.type.name not in READING + MAKING:
            raise CatalogError(
                f"the query does not run: {statement.type.name} is not allowed; expected a query"
                " of the records, which begins with SELECT"
            )
    return statements


def _result(base: duckdb.DuckDBPyConnection, text: str) -> tuple[list[str], list[tuple[Any, ...]]]:
    rows = base.execute(text)
    return [d[0] for d in rows.description or []], rows.fetchall()


def show(homes: Homes, name: str) -> dict[str, Any]:
    """Return the root attributes of a store, with its `path`.

    `name` is the beginning of its key, or the name of a run. If several homes hold the store, the
    attributes are those in the first home, and `homes` lists all of them.

    Raises
    ------
    CatalogError : no store matches the name, or several do.
    """
    places = _homes(homes)
    known = [(path, home.name) for home in places for path in stores(home.folder)]
    found = [entry for entry in known if entry[0].stem.startswith(str(name).removesuffix(".zarr"))]
    found = found or [entry for entry in known if read_labels(entry[0]).name == name]
    exact = [entry for entry in found if entry[0].stem == name] or found
    keys = list(dict.fromkeys(path.stem for path, _ in exact))
    if len(keys) != 1:
        some = ", ".join(keys[:MOST_LISTED])
        more = f" and {len(keys) - MOST_LISTED} more" if len(keys) > MOST_LISTED else ""
        problem = (
            f"could be any of {some}{more}"
            if keys
            else "names no store" + did_you_mean(name, {path.stem for path, _ in known})
        )
        looked = ", ".join(home.name for home in places)
        raise CatalogError(f"{name!r} {problem}; looked in {looked}")
    path = exact[0][0]
    found_in = {"homes": [home for _, home in exact]} if len(places) > 1 else {}
    return {"path": str(path), **found_in, **read_attrs(path)}


def shown(homes: Homes, name: str) -> str:
    """Return the result of `show` as indented JSON."""
    return json.dumps(jsonable(show(homes, name)), indent=2)


def _homes(homes: Homes) -> tuple[StoredHome, ...]:
    if isinstance(homes, str | Path):
        folder = Path(homes).absolute()
        return (StoredHome(str(folder), folder),)
    return tuple(homes)


@contextmanager
def _reading(homes: tuple[StoredHome, ...]) -> Iterator[duckdb.DuckDBPyConnection]:
    """Yield a connection to the attached index, for queries that change nothing. It is kept open
    for the next query of this process as long as no home changes, because opening takes 40 ms.
    """
    key = (os.getpid(), homes)
    now = [state(home.folder) for home in homes]
    base, since = _KEPT.get(key, (None, None))
    if base is None or since != now:
        with needed("a query", extra="catalog"):
            import duckdb

        _KEPT.clear()
        base = duckdb.connect()
        since = _open(base, homes)
        if since is not None:
            _KEPT[key] = (base, since)
    with base.cursor() as cursor:
        yield cursor


@contextmanager
def _own_database(homes: tuple[StoredHome, ...]) -> Iterator[duckdb.DuckDBPyConnection]:
    """Yield a database that is closed after use, for queries that make tables."""
    with index_file.connected() as base:
        _open(base, homes)
        yield base


def _open(
    base: duckdb.DuckDBPyConnection, homes: tuple[StoredHome, ...]
) -> list[dict[str, Any]] | None:
    """Attach the indices, make their views, and lock the database; return the result of
    `attach_all`.
    """
    since = attach_all(base, homes)
    known = index_file.properties(base)
    home = home_column(homes)
    rest = f"* EXCLUDE (store{', home' if len(homes) > 1 else ''})"
    whole = index_file.whole_properties(known)
    base.execute(VIEWS.format(properties=whole, home=home, rest=rest))
    base.execute(_view_of_properties(known, home))
    for setting in SANDBOX:
        base.execute(setting)
    return since


def _view_of_properties(known: dict[str, index_file.Property], home: str) -> str:
    """Return the SQL of a view with a column for each property; columns of `shots` keep their
    names.
    """
    columns = [
        f"{found.column} AS {index_file.identifier(name)}"
        for name, found in sorted(known.items())
        if found.column and name.lower() not in (*PLAIN, HOME)
    ]
    shown_columns = ", ".join([*PLAIN, f"{home} AS {HOME}", *columns])
    return f"CREATE VIEW properties AS SELECT {shown_columns} FROM idx.shots"


def _rows(
    base: duckdb.DuckDBPyConnection,
    chosen: list[int],
    fixed: tuple[str, ...],
    extra: list[str],
    whole: str,
) -> list[dict[str, Any]]:
    """Return the rows of a result: the columns `fixed`, and the properties `extra`.

    `whole` is the SQL of the JSON of all properties.
    """
    places = ", ".join(index_file.pointer(name) for name in extra)
    found = base.execute(
        f"SELECT rowid, {', '.join(fixed)}{', ' * bool(extra)}"
        f"{f'json_extract({whole}, [{places}])' if extra else ''}"
        " FROM idx.shots WHERE rowid IN (SELECT unnest(?::BIGINT[]))",
        [chosen],
    ).fetchall()
    by_row = {}
    for row, *cells in found:
        texts = cells[len(fixed)] if extra else []
        read = [None if text is None else json.loads(text) for text in texts]
        whole_row = dict(zip(fixed, cells[: len(fixed)], strict=True))
        by_row[row] = whole_row | dict(zip(extra, read, strict=True))
    return [by_row[row] for row in chosen]


def _with_share(known: dict[str, index_file.Property], names: list[str]) -> list[str]:
    """Return the properties to show; if one of them is a score, with the share of valid pixels."""
    shown = any(known[name].score for name in names if name in known)
    if shown and SHARE in known and SHARE not in names:
        return [*names, SHARE]
    return names


def _check_known(
    base: duckdb.DuckDBPyConnection, known: dict[str, index_file.Property], names: list[str]
) -> None:
    """Raise CatalogError if no record has a property; an empty home accepts every name."""
    for name in names:
        if name in (*PLAIN, HOME) or not known:
            continue
        if name not in known or not _has_values(base, known[name]):
            others = [n for n, found in known.items() if _has_values(base, found)]
            if not others:
                return
            raise CatalogError(
                f"no record has the property {name!r}{did_you_mean(name, [*others, *PLAIN])}"
            )


def _has_values(base: duckdb.DuckDBPyConnection, found: index_file.Property) -> bool:
    """Return whether a record has a property; a column may outlast the records of its stores."""
    if found.column is None:
        return True
    return bool(
        base.execute(f"SELECT 1 FROM idx.shots WHERE {found.column} IS NOT NULL LIMIT 1").fetchall()
    )


class _Column(NamedTuple):
    """The SQL expression of a property, and the type of its values."""

    text: str
    kind: str


def _column(
    known: dict[str, index_file.Property], name: str, homes: tuple[StoredHome, ...]
) -> _Column:
    if name == HOME:
        return _Column(home_column(homes), index_file.TEXT)
    if name in PLAIN:
        return _Column(name, index_file.TEXT)
    found = known.get(name)
    if found is not None and found.column is not None:
        return _Column(found.column, found.kind)
    return _Column(f"json_extract_string(properties, {index_file.pointer(name)})", index_file.LIST)


def _order(column: _Column, direction: str) -> str:
    """Return the SQL that sorts numbers by value, and other text after them."""
    if column.kind == index_file.NUMBER:
        return f"{column.text} {direction} NULLS LAST"
    return (
        f"try_cast({column.text} AS DOUBLE) {direction} NULLS LAST,"
        f" {column.text} {direction} NULLS LAST"
    )


def _clause(column: _Column, operator: str, value: Any) -> tuple[str, list[Any]]:
    """Return the SQL of one condition and the values that it binds."""
    if operator in OPERATORS:
        number = _number(value)
        if number is None:  # dates and other text are compared as text
            return f"CAST({column.text} AS VARCHAR) {OPERATORS[operator]} ?", [str(value)]
        as_number = f"try_cast({column.text} AS DOUBLE)"
        if column.kind == index_file.NUMBER:
            as_number = column.text
        return f"{as_number} {OPERATORS[operator]} ?", [number]
    tests = []
    values = []
    for alternative in _alternatives(operator, value):
        test, bound = _equal(column, alternative)
        tests.append(test)
        values += bound
    joined = " OR ".join(tests) or "false"
    if operator == "ne":
        return f"coalesce(NOT ({joined}), true)", values
    return f"coalesce({joined}, false)", values


def _alternatives(operator: str, value: Any) -> list[str]:
    if isinstance(value, list | tuple | set):
        several = list(value)
    else:
        several = str(value).split(",") if operator == "in" else [value]
    return [str(v).lower() if isinstance(v, bool) else str(v) for v in several]


def _equal(column: _Column, value: str) -> tuple[str, list[Any]]:
    """Return the SQL for "a property equals or holds a value", and the values that it binds."""
    number = _number(value)
    if column.kind == index_file.NUMBER:
        return ("false", []) if number is None else (f"{column.text} = ?", [number])
    tests = [f"{column.text} = ?"]
    values = [value]
    if number is not None:
        tests.append(f"try_cast({column.text} AS DOUBLE) = ?")
        values.append(number)
    if column.kind == index_file.LIST:
        as_list = (
            f"from_json(CASE WHEN {column.text} LIKE '[%' AND json_valid({column.text})"
            f" THEN {column.text} ELSE '[]' END, '[\"VARCHAR\"]')"
        )
        tests.append(f"list_contains({as_list}, ?)")
        values.append(value)
    equal = f"({' OR '.join(tests)})"
    if column.kind == index_file.LIST and number is None and _is_verbatim_in_json(value):
        # Reading JSON takes most of the time of such a query. Texts without the value are left out.
        return f"CASE WHEN contains({column.text}, ?) THEN {equal} ELSE false END", [value, *values]
    return equal, values


def _is_verbatim_in_json(text: str) -> bool:
    """Return whether JSON writes the characters of `text` unchanged."""
    return text.isascii() and text.isprintable() and not set(text) & set('"\\/')


def _number(value: Any) -> float | None:
    try:
        return float(value)
    except (TypeError, ValueError):
        return None


def _split(key: str) -> tuple[str, str]:
    name, _, operator = key.rpartition("__")
    if name and operator in (*OPERATORS, "ne", "in"):
        return name.replace("__", "."), operator
    return key.replace("__", "."), "eq"

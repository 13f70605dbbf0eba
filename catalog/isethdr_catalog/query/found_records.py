"""Records by conditions.

`find(folder, kind="run", sensor="rgbw", order_by="ssim")`; an operator follows the name after two
underscores: `__ge __le __gt __lt __ne __in`. In Python a dot of a name may be written as two
underscores: `person__distance_m__le=30`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from isethdr_core.errors import CatalogError, did_you_mean
from isethdr_core.storage.home_folder import StoredHome

from .. import index_file
from .conditions import (
    ALL_OPERATORS,
    Column,
    column_of,
    condition_sql,
    holds_numbers,
    listed,
    order_sql,
    property_and_operator,
    resolved,
    wrong_number,
)
from .connection import HOME, PLAIN, Homes, homes_of, reading

if TYPE_CHECKING:
    import duckdb

SHOWN = ("id", "kind", "camera", "path")  # columns of `find`; with several homes also the home
SHARE = "valid_share"


def find(
    homes: Homes,
    /,
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
        that it holds. `scene` is the component of the scene, and a setting of a run may be named
        without `config.`, as in `seed=2`. Several values are any iterable, as `seed__in=range(3)`.
        None and `null` stand for records without the property; a name may be the text `null`.

    Returns
    -------
    list of dict : id, kind, camera, path, and every property in `conditions` and `order_by`. If one
        of them is a score, also `valid_share`, the share of valid pixels, if it is recorded. With
        several homes also `home`; a store in two homes has a row for each.

    Raises
    ------
    CatalogError : no record has a property, a property that holds numbers is compared with other
        text, or `limit` is not a whole number from 0.
    """
    if not str(limit).isdecimal():
        raise CatalogError(
            f"limit is {limit!r}; expected a whole number of rows; type for example limit=50"
        )
    typed = [(*property_and_operator(key), listed(value)) for key, value in conditions.items()]
    typed_order = (order_by or "").removeprefix("-").replace("__", ".")
    places = homes_of(homes)
    with reading(places) as base:
        known = index_file.properties(base)
        tests = []
        for typed_name, operator, typed_value in typed:
            name, value = resolved(known, typed_name, typed_value)
            tests.append((name, typed_name, operator, value))
        ordered, _ = resolved(known, typed_order)
        asked = list(dict.fromkeys([n for n, *_ in tests] + ([ordered] if ordered else [])))
        _check_known(base, known, asked)
        clauses = []
        values = []
        for name, typed_name, operator, value in tests:
            column = column_of(known, name, places)
            if holds_numbers(known.get(name)):
                key = typed_name if operator == "eq" else f"{typed_name}__{operator}"
                _check_numbers(base, column, key, wrong_number(operator, value))
            clause, bound = condition_sql(column, operator, value)
            clauses.append(clause)
            values += bound
        where = f"WHERE {' AND '.join(clauses)}" if clauses else ""
        order = "created DESC, id, camera"
        if ordered:
            direction = "DESC" if str(order_by).startswith("-") else "ASC"
            order = f"{order_sql(column_of(known, ordered, places), direction)}, id"
        order += f", {HOME}" if len(places) > 1 else ""
        chosen = base.execute(
            f"SELECT rowid FROM idx.shots {where} ORDER BY {order} LIMIT {int(limit)}", values
        ).fetchall()
        shown = dict.fromkeys([*(name for name in also if name in known), *asked])
        extra = _with_share(known, [name for name in shown if name not in (*PLAIN, HOME)])
        whole = index_file.whole_properties(known)
        fixed = (*SHOWN, HOME) if len(places) > 1 else SHOWN
        return _rows(base, [row for (row,) in chosen], fixed, extra, whole)


def _check_numbers(
    base: duckdb.DuckDBPyConnection, column: Column, key: str, wrong: str | None
) -> None:
    """Raise CatalogError about the wrong value of a condition, with a stored value as example.

    Parameters
    ----------
    base : connection to the index.
    column : property that the condition is about.
    key : property and operator, as they are typed.
    wrong : the wrong value; None if all are right.
    """
    if wrong is None:
        return
    number = f"try_cast({column.text} AS DOUBLE)"
    stored = base.execute(
        f"SELECT {number} FROM idx.shots WHERE isfinite({number}) ORDER BY ALL LIMIT 1"
    ).fetchone()
    example = f"; type for example {key}={_short_number(stored[0])}" if stored else ""
    raise CatalogError(
        f"{key} is {wrong!r}; expected a number, as all stored values are, with a point for"
        f" decimals{example}"
    )


def _short_number(value: float) -> str:
    """Return a number as text; whole numbers without `.0`."""
    return repr(value).removesuffix(".0")


def path_of(row: Mapping[str, Any], homes: Sequence[StoredHome]) -> Path:
    """Return the path of the store of a row that `find` returned for these homes."""
    folders = {home.name: home.folder for home in homes}
    return folders[row.get(HOME, homes[0].name)] / str(row["path"])


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
            shorter, _, ending = name.rpartition(".")
            if shorter in (*others, *PLAIN):
                raise CatalogError(
                    f"no record has the property {name!r}, and {ending!r} is no operator; type for"
                    f" example {shorter}=VALUE, or {shorter}__OPERATOR=VALUE with one of the"
                    f" operators {', '.join(ALL_OPERATORS)}"
                )
            raise CatalogError(
                f"no record has the property {name!r}{did_you_mean(name, {*others, *PLAIN, HOME})}"
            )


def _has_values(base: duckdb.DuckDBPyConnection, found: index_file.Property) -> bool:
    """Return whether a record has a property; a column may outlast the records of its stores."""
    if found.column is None:
        return True
    return bool(
        base.execute(f"SELECT 1 FROM idx.shots WHERE {found.column} IS NOT NULL LIMIT 1").fetchall()
    )

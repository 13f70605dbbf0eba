"""Joined index: the indices of several homes as one, so that a query sees the records of all.

One database attaches the index file of each home. A schema replaces the single index file. It holds
views over all files: the same tables, with an additional column `home`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from isethdr_core.storage.home_folder import StoredHome

from . import index_file
from .index import attach
from .index_file import ALIAS, LIST, NUMBER, TEXT, Property, quoted

if TYPE_CHECKING:
    import duckdb

Known = dict[str, Property]


def attach_all(
    base: duckdb.DuckDBPyConnection, homes: Sequence[StoredHome]
) -> list[dict[str, Any]] | None:
    """Attach the indices of all homes, each brought up to date first.

    Returns
    -------
    The states of the homes for which the attached files are valid; None if one of them is valid at
    this moment only (`index.attach`).

    Raises
    ------
    CatalogError : neither a home nor the folder of temporary files can be written.
    """
    if len(homes) == 1:
        state = attach(base, homes[0].folder)
        return None if state is None else [state]
    aliases = [f"home{number}" for number in range(len(homes))]
    states = [attach(base, home.folder, alias) for home, alias in zip(homes, aliases, strict=True)]
    _join(base, [home.name for home in homes], aliases)
    return [state for state in states if state is not None] if all(states) else None


def home_column(homes: Sequence[StoredHome]) -> str:
    """Return the SQL expression of the home of a record."""
    return "home" if len(homes) > 1 else f"'{quoted(homes[0].name)}'"


def _join(base: duckdb.DuckDBPyConnection, names: Sequence[str], aliases: Sequence[str]) -> None:
    own = [index_file.properties(base, alias) for alias in aliases]
    together = joined_properties(own)
    base.execute(f"CREATE SCHEMA {ALIAS}")
    base.execute(
        f"CREATE TABLE {ALIAS}.property (name VARCHAR, place INTEGER, type VARCHAR, score BOOLEAN)"
    )
    rows = [(p.name, p.place, p.kind, p.score) for p in together.values()]
    if rows:
        base.executemany(f"INSERT INTO {ALIAS}.property VALUES (?, ?, ?, ?)", rows)
    shots = [
        f"SELECT '{quoted(name)}' AS home, rowid * {len(aliases)} + {place} AS rowid,"
        f" {', '.join([*index_file.RECORD, *_columns(together, known)])} FROM {alias}.shots"
        for place, (name, alias, known) in enumerate(zip(names, aliases, own, strict=True))
    ]
    base.execute(f"CREATE VIEW {ALIAS}.shots AS {' UNION ALL '.join(shots)}")
    for table in ("scores", "object_scores", "objects"):
        parts = [
            f"SELECT *, '{quoted(name)}' AS home FROM {alias}.{table}"
            for name, alias in zip(names, aliases, strict=True)
        ]
        base.execute(f"CREATE VIEW {ALIAS}.{table} AS {' UNION ALL '.join(parts)}")


def joined_properties(own: Sequence[Known]) -> Known:
    """Return the properties of all homes, each with its place among the joined columns.

    A property that holds numbers in one home and text in another holds text.
    """
    together: Known = {}
    taken: set[str] = set()  # names of columns are not case-sensitive
    for known in own:
        for name, found in known.items():
            joined = together.setdefault(name, Property(name, None, found.kind, False))
            joined.score = joined.score or found.score
            if found.kind != joined.kind:
                joined.kind = LIST if LIST in (found.kind, joined.kind) else TEXT
            if joined.place is None and found.column and name.lower() not in taken:
                joined.place = len(taken)
                taken.add(name.lower())
    return together


def _columns(together: Known, known: Known) -> list[str]:
    """Return the SQL expression of each joined column for the table of one home."""
    return [
        f"{_value(joined, known.get(joined.name))} AS {joined.column}"
        for joined in together.values()
        if joined.column
    ]


def _value(joined: Property, own: Property | None) -> str:
    wanted = "DOUBLE" if joined.kind == NUMBER else "VARCHAR"
    if own is None:
        return f"NULL::{wanted}"
    if own.column is None:
        return f"try_cast(properties->>{index_file.pointer(own.name)} AS {wanted})"
    return own.column if own.kind == joined.kind else f"CAST({own.column} AS {wanted})"

"""Connections to a database with the records of some homes as views. It can reach no file, no
network and no extension.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from isethdr_core.extras import needed
from isethdr_core.storage.home_folder import StoredHome

from .. import index_file
from ..index import state
from ..joined_index import attach_all, home_column

if TYPE_CHECKING:
    import duckdb

Homes = Path | str | Sequence[StoredHome]  # folder of one home, or a sequence of existing homes
PLAIN = ("id", "kind", "camera", "name", "path", "created", "derived_from")
HOME = "home"  # column with the home of a record
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
_KEPT: dict[
    tuple[int, tuple[StoredHome, ...]], tuple[duckdb.DuckDBPyConnection, list[dict[str, Any]]]
] = {}


def homes_of(homes: Homes) -> tuple[StoredHome, ...]:
    """Return the homes of a query; a folder is a home of its own, with the folder as its name."""
    if isinstance(homes, str | Path):
        folder = Path(homes).absolute()
        return (StoredHome(str(folder), folder),)
    return tuple(homes)


@contextmanager
def reading(homes: tuple[StoredHome, ...]) -> Iterator[duckdb.DuckDBPyConnection]:
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
def own_database(homes: tuple[StoredHome, ...]) -> Iterator[duckdb.DuckDBPyConnection]:
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

"""SQL of the user over the records of homes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from isethdr_core.errors import CatalogError
from isethdr_core.extras import needed

from .connection import Homes, homes_of, own_database, reading

if TYPE_CHECKING:
    import duckdb

# Types of statements that a user may type. Those of READING change nothing, those of MAKING make or
# change tables in memory. All others (ATTACH, DETACH, COPY, SET, LOAD, ...) are refused.
READING = ("SELECT", "EXPLAIN")
MAKING = ("CREATE", "INSERT", "UPDATE", "DELETE", "DROP", "ALTER", "MULTI")
VIEW_NAMES = ("stores", "shots", "properties", "objects", "scores", "object_scores")


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
        with reading(homes_of(homes)) as base:
            statements = _checked(base, text)
            if all(statement.type.name in READING for statement in statements):
                return _result(base, text)
        with own_database(homes_of(homes)) as base:  # closed with the tables that the query makes
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

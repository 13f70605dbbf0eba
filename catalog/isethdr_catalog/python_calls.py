"""Python calls: `isethdr.find`, `show` and `compare`, with HTML for notebooks."""

from __future__ import annotations

from typing import Any

from isethdr_core.results.html import table
from isethdr_core.storage.home_folder import existing_home

from . import query
from .compare import Comparison
from .compare import compare as compare_runs


class Rows(list[dict[str, Any]]):
    """Rows of a query; a notebook shows them as a table."""

    def _repr_html_(self) -> str:
        """Return the rows as an HTML table."""
        head = list(self[0]) if self else ["nothing found"]
        return table(head, [[row[name] for name in head] for row in self])


def find(order_by: str | None = None, limit: int = 50, **conditions: Any) -> Rows:
    """Return the stored scenes and runs (one row per camera) that meet all conditions.

    Parameters
    ----------
    order_by : a property; a leading `-` puts the largest first.
    limit : the most rows.
    conditions : `property=value`, or `property__operator=value` with ge, le, gt, lt, ne or in. A
        dot of a name is written as two underscores: `person__distance_m__le=30`.

    Raises
    ------
    CatalogError : a property that no record has, or a home folder that is not there.
    """
    return Rows(query.find(existing_home(), order_by=order_by, limit=limit, **conditions))


def show(name: str) -> dict[str, Any]:
    """Return all that is recorded about one store, with its `path`.

    Raises
    ------
    CatalogError : no store is called so, or several are.
    """
    return query.show(existing_home(), name)


def compare(a: str, b: str) -> Comparison:
    """Return how two stored runs differ: in settings, versions, and scores with intervals.

    Parameters
    ----------
    a, b : the first digits of two runs, or their names.

    Raises
    ------
    CatalogError : one of them is no run, or several are called so.
    """
    return compare_runs(existing_home(), a, b)

"""Python calls: `isethdr.find`, `show` and `compare`, with HTML for notebooks."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

from isethdr_core.results.html import table
from isethdr_core.storage.home_folder import existing_homes

from . import query
from .compare import Comparison
from .compare import compare as compare_runs

Home = str | os.PathLike[str] | Iterable[object]


class Rows(list[dict[str, Any]]):
    """Rows of a query; a notebook shows them as a table."""

    def _repr_html_(self) -> str:
        """Return the rows as an HTML table."""
        head = list(self[0]) if self else ["nothing found"]
        return table(head, [[row[name] for name in head] for row in self])


def find(order_by: str | None = None, limit: int = 50, home: Home = (), **conditions: Any) -> Rows:
    """Return the stored scenes and runs (one row per camera) that meet all conditions.

    Parameters
    ----------
    order_by : a property; a leading `-` puts the largest first.
    limit : largest number of rows.
    home : a home or several: folders, and addresses such as s3://bucket/lab. With several homes
        each row states its `home`. Without any, the home folder is that of the variable
        ISETHDR_HOME.
    conditions : `property=value`, or `property__operator=value` with ge, le, gt, lt, ne or in. A
        dot of a name is written as two underscores: `person__distance_m__le=30`.

    Raises
    ------
    CatalogError : no record has a property, or a home folder does not exist.
    """
    return Rows(query.find(existing_homes(home), order_by=order_by, limit=limit, **conditions))


def show(name: str, home: Home = ()) -> dict[str, Any]:
    """Return the record of one store (its root attributes), with its `path`.

    Parameters
    ----------
    name : first digits of the key of a store, or the name of a run.
    home : a home or several: folders, and addresses such as s3://bucket/lab. Without any, the home
        folder is that of the variable ISETHDR_HOME.

    Raises
    ------
    CatalogError : no store matches the name, or several do.
    """
    return query.show(existing_homes(home), name)


def compare(a: str, b: str, home: Home = ()) -> Comparison:
    """Return the differences between two stored runs: settings, versions, and scores with
    intervals.

    Parameters
    ----------
    a, b : first digits of the keys of two runs, or their names; they may be in different homes.
    home : a home or several: folders, and addresses such as s3://bucket/lab. Without any, the home
        folder is that of the variable ISETHDR_HOME.

    Raises
    ------
    CatalogError : one of them is no run, or several stores match.
    """
    return compare_runs(existing_homes(home), a, b)

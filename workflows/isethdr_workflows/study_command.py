"""The command `isethdr study NAME key=value ...`: run a study, print its rows, keep them in the
catalog.
"""

from __future__ import annotations

import csv
import inspect
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from isethdr_core.cli.terminal import print_path, print_table
from isethdr_core.errors import ConfigError, did_you_mean

from . import STUDIES

NUMBERS = {"int": int, "float": float}


def study(
    name: Annotated[str, typer.Argument(help="name of a study; none lists them")] = "",
    settings: Annotated[
        list[str] | None, typer.Argument(help="key=value, as the study's function takes them")
    ] = None,
    csv_file: Annotated[str, typer.Option("--csv", help="also write the rows to this file")] = "",
) -> None:
    """Run a study: a table of results that needs no scene. Without a name: list the studies."""
    if not name:
        for known in STUDIES:
            typer.echo(f"{known}: {(inspect.getdoc(function_of(known)) or '').splitlines()[0]}")
        return
    if csv_file and not Path(csv_file).resolve().parent.is_dir():
        raise ConfigError(
            f"--csv is {csv_file}; expected a file in a folder that exists; make the folder first"
        )
    rows = run_study(name, settings or [])
    show(rows, name)
    print_path("stored", keep(name, settings or [], rows))
    if csv_file:
        with open(csv_file, "w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]) if rows else [])
            writer.writeheader()
            writer.writerows(rows)


def function_of(name: str):
    """Return the function of a study."""
    if name not in STUDIES:
        raise ConfigError(f"no study {name!r}{did_you_mean(name, STUDIES)}")
    module, function = STUDIES[name].split(":")
    return getattr(import_module(f".{module}", __package__), function)


def run_study(name: str, settings: list[str]) -> list[dict]:
    """Return the rows of a study; `settings` are key=value, converted to the number that the
    function's parameter names.
    """
    function = function_of(name)
    known = inspect.signature(function).parameters
    values = {}
    for text in settings:
        key, equals, value = text.partition("=")
        if not equals or key not in known:
            raise ConfigError(
                f"study {name} has no setting {text!r}{did_you_mean(key, known)}; type key=value"
            )
        try:
            values[key] = NUMBERS.get(known[key].annotation, str)(value)
        except ValueError:
            raise ConfigError(
                f"study {name}: {key}={value!r} is no number; type for example"
                f" {key}={known[key].default}"
            ) from None
    return function(**values)


def keep(name: str, settings: list[str], rows: list[dict]):
    """Return the path of the store that keeps the rows for the catalog: `isethdr catalog find
    kind=study name=accuracy`.
    """
    import xarray as xr

    from isethdr_core import store
    from isethdr_core.runs.provenance import versions

    columns = {key: ("row", [row.get(key) for row in rows]) for key in (rows[0] if rows else ())}
    created = datetime.now(UTC).isoformat(timespec="seconds")
    attributes = {
        "kind": "study",
        "name": name,
        "settings": settings,
        "rows": len(rows),
        "versions": versions(),
        "created": created,
    }
    table = xr.Dataset(
        {
            key: (
                dim,
                (
                    values
                    if all(isinstance(v, (int, float, bool)) for v in values)
                    else [str(v) for v in values]
                ),
            )
            for key, (dim, values) in columns.items()
        }
    )
    # seconds differ from one time to the next: each time is a result of its own
    return store.write_store(
        store.home() / "studies",
        f"{name}-{store.content_hash([name, settings, created])[:8]}",
        {"": table},
        attributes,
    )


def show(rows: list[dict], title: str) -> None:
    """Print rows as one table; numbers with four digits."""
    cells = [[f"{v:.4g}" if isinstance(v, float) else v for v in row.values()] for row in rows]
    print_table(rows[0] if rows else ["no rows"], cells, title)

"""The command `isethdr study NAME key=value ...`: run a study, print its rows, keep them in the
catalog.
"""

from __future__ import annotations

import csv
import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from textwrap import TextWrapper
from typing import Annotated

import typer

from isethdr_core.cli.terminal import print_path, print_table
from isethdr_core.errors import ConfigError, did_you_mean

from . import SHOWN, STUDIES

INTERRUPTED = 130  # exit code after Ctrl-C: 128 + SIGINT
NUMBERS = {"int": int, "float": float}
PICTURE = "picture"  # setting of the studies that draw
RASTERS = (".png", ".jpg", ".jpeg", ".pdf")  # of a study that draws pixels
DRAWINGS = (*RASTERS, ".svg")


@dataclass(frozen=True)
class Studies:
    """The studies of one package.

    Parameters
    ----------
    table : {name: "module:function" in the package}; a function returns rows, list[dict].
    package : name of the package.
    shown : {name: "module:function"} of functions that make a summary for the terminal from all
        rows.
    """

    table: Mapping[str, str]
    package: str
    shown: Mapping[str, str] = field(default_factory=dict)

    def function_of(self, name: str) -> Callable[..., list[dict]]:
        """Return the function of a study; raise ConfigError if there is none of that name."""
        if name not in self.table:
            raise ConfigError(f"no study {name!r}{did_you_mean(name, self.table)}")
        return self._function(self.table[name])

    def for_people(self, name: str, rows: list[dict]) -> list[dict]:
        """Return the rows that a terminal shows.

        Parameters
        ----------
        name : name of the study.
        rows : all rows of the study.
        """
        return self._function(self.shown[name])(rows) if name in self.shown else rows

    def _function(self, target: str) -> Callable[..., list[dict]]:
        module, function = target.split(":")
        return getattr(import_module(f".{module}", self.package), function)


OF_USERS = Studies(STUDIES, __package__, SHOWN)
fill = TextWrapper(80, initial_indent="  ", subsequent_indent="  ").fill


def summary_of(function: Callable[..., object]) -> str:
    """Return the first paragraph of a docstring as one line."""
    return " ".join((inspect.getdoc(function) or "").partition("\n\n")[0].split())


def settings_of(function: Callable[..., object]) -> str:
    """Return the settings of a study with their defaults, in the form in which they are typed."""
    words = [
        "overrides ..." if one.kind is one.VAR_POSITIONAL else f"{one.name}={one.default}"
        for one in inspect.signature(function).parameters.values()
    ]
    return "settings: " + " ".join(words)


def help_of(name: str, function: Callable[..., object]) -> str:
    """Return the help of a study: its summary, and each setting with its default and meaning.

    Parameters
    ----------
    name : name of the study.
    function : function of the study, with the section `Parameters` in its docstring.
    """
    defaults = {
        one.name: f"{one.name}={one.default}"
        for one in inspect.signature(function).parameters.values()
        if one.kind is not one.VAR_POSITIONAL
    }
    blocks = [f"isethdr study {name} key=value ...", fill(summary_of(function))]
    for names, meaning in parameters_of(function):
        typed = " ".join(defaults.get(one, f"{one} ...") for one in names)
        blocks.append(f"{typed}\n{fill(meaning)}")
    return "\n\n".join(blocks)


def parameters_of(function: Callable[..., object]) -> list[tuple[list[str], str]]:
    """Return the names and the meaning of each entry of the section `Parameters` of a docstring."""
    text = inspect.getdoc(function) or ""
    section = text.partition("Parameters\n----------\n")[2].partition("\n\n")[0]
    entries: list[tuple[list[str], str]] = []
    for line in section.splitlines():
        if line.startswith(" "):
            names, meaning = entries.pop()
            entries.append((names, f"{meaning} {line.strip()}"))
            continue
        names_text, _, meaning = line.partition(" : ")
        entries.append((names_text.split(", "), meaning))
    return entries


def study_of(studies: Studies) -> Callable[..., None]:
    """Return the command that runs the studies of a package."""

    def study(
        context: typer.Context,
        name: Annotated[
            str, typer.Argument(help="name of a study; without a name, all studies are listed")
        ] = "",
        settings: Annotated[
            list[str] | None,
            typer.Argument(help="settings of the study as key=value, and overrides of the config"),
        ] = None,
        csv_file: Annotated[
            str, typer.Option("--csv", help="also write the rows to this file")
        ] = "",
        shows_help: Annotated[
            bool, typer.Option("--help", help="show this message, or the settings of a study")
        ] = False,
    ) -> None:
        """Run a study and print its table. Without a name: list all studies."""
        if shows_help:
            print(help_of(name, studies.function_of(name)) if name else context.get_help())
            return
        if not name:
            for known in studies.table:
                function = studies.function_of(known)
                print(f"{known}\n{fill(summary_of(function))}\n{fill(settings_of(function))}")
            return
        rows_file = Path(csv_file).resolve()
        if csv_file and (rows_file.is_dir() or not rows_file.parent.is_dir()):
            raise ConfigError(
                f"--csv is {csv_file}; expected a file in a folder that exists; make the folder"
                " first, or type for example --csv rows.csv"
            )
        studies.function_of(name)  # an unknown name is an error before the home folder is made
        check_home()
        try:
            rows = run_study(name, settings or [], studies)
        except KeyboardInterrupt:
            print("interrupted", file=sys.stderr)
            raise typer.Exit(INTERRUPTED) from None
        show(studies.for_people(name, rows), name)
        print_path("stored", keep(name, settings or [], rows))
        if csv_file:
            with open(csv_file, "w", newline="") as file:
                writer = csv.DictWriter(file, list(rows[0]) if rows else [])
                writer.writeheader()
                writer.writerows(rows)

    return study


study = study_of(OF_USERS)


def function_of(name: str) -> Callable[..., list[dict]]:
    """Return the function of a study that users run."""
    return OF_USERS.function_of(name)


def run_study(name: str, settings: list[str], studies: Studies = OF_USERS) -> list[dict]:
    """Return the rows of a study.

    Parameters
    ----------
    name : name of the study.
    settings : settings as typed, key=value, converted to the type of the function's parameter. A
        function with `*overrides` gets all other settings unchanged, as overrides of a config.
    studies : studies to choose from.

    Raises
    ------
    ConfigError : the study or a setting is unknown, or a value is not a number.
    """
    function = studies.function_of(name)
    known = inspect.signature(function).parameters
    kinds = {p.name: p.kind for p in known.values()}
    composes = inspect.Parameter.VAR_POSITIONAL in kinds.values()
    named = [key for key, kind in kinds.items() if kind is not inspect.Parameter.VAR_POSITIONAL]
    values = {}
    overrides = []
    for text in settings:
        key, equals, value = text.partition("=")
        if composes and key not in named:
            overrides.append(text)
            continue
        if not equals or key not in named:
            raise ConfigError(
                f"study {name} has no setting {text!r}{did_you_mean(key, named)}; type key=value"
            )
        try:
            values[key] = NUMBERS.get(known[key].annotation, str)(value)
        except ValueError:
            whole = "whole " if known[key].annotation == "int" else ""
            raise ConfigError(
                f"study {name}: {key}={value!r} is no {whole}number; type for example"
                f" {key}={known[key].default}"
            ) from None
    check_picture(str(values.get(PICTURE, "")))
    return function(*overrides, **values)


def check_picture(path: str, endings: Sequence[str] = DRAWINGS) -> None:
    """Check that the drawing of a study can be written, before the work of the study.

    Parameters
    ----------
    path : file of the drawing; empty: none is written.
    endings : endings of the files that the study can write, in lower case.

    Raises
    ------
    ConfigError : the folder of the file does not exist, or its ending is that of no drawing.
    """
    if not path:
        return
    if Path(path).suffix.lower() not in endings or not Path(path).resolve().parent.is_dir():
        raise ConfigError(
            f"{PICTURE} is {path}; expected a file that ends in {', '.join(endings)}, in a folder"
            f" that exists; type for example {PICTURE}=figure.png"
        )


def check_home() -> None:
    """Raise CatalogError if the rows of a study could not be stored, before the work of the
    study.
    """
    from isethdr_core import store
    from isethdr_core.runs.run import check_writable

    check_writable(store.home() / "studies")


def keep(name: str, settings: list[str], rows: list[dict]) -> Path:
    """Store the rows of a study and return the path of the store. `isethdr catalog find kind=study
    name=accuracy` finds it.

    Parameters
    ----------
    name : name of the study.
    settings : settings as typed, key=value.
    rows : rows of the study, {column: value}.
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
    # measured seconds differ from run to run, so each run is stored as a result of its own
    return store.write_store(
        store.home() / "studies",
        f"{name}-{store.content_hash([name, settings, created])[:8]}",
        {"": table},
        attributes,
    )


def show(rows: list[dict], title: str) -> None:
    """Print rows as one table, with four digits for numbers.

    Parameters
    ----------
    rows : rows of a study, {column: value}.
    title : title of the table.
    """
    cells = [[f"{v:.4g}" if isinstance(v, float) else v for v in row.values()] for row in rows]
    print_table(rows[0] if rows else ["no rows"], cells, title)

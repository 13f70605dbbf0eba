"""The command `isethdr export`. It has no slow imports, because every command line loads it."""

from __future__ import annotations

from importlib import import_module

import typer

from .formats import listed

HELP = f"""Write stored runs as files of other programs.

isethdr export RUN... FOLDER --to png,exr takes keys, first digits or names of runs, and names of
sweeps. isethdr export sensor=bayer ssim__ge=0.9 FOLDER --to exr takes a query, as isethdr catalog
find does. The last argument is the folder to make.

Formats: {listed()}."""


def export(
    what: list[str] = typer.Argument(help="runs, sweeps, or conditions; the folder comes last"),
    to: list[str] = typer.Option([], help="formats, separated by commas"),
    force: bool = typer.Option(False, "--force", help="replace the folder of an earlier export"),
    licence: str = typer.Option("", help="licence of the files: an SPDX name or an address"),
    title: str = typer.Option("", help="title of the data set; by default the name of the folder"),
) -> None:
    """Write files of the chosen formats into a new folder, with a manifest."""
    import_module(f"{__package__}.exporting").run(what, to, force, licence, title)

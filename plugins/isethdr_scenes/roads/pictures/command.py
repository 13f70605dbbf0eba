"""`isethdr roads`: list the kinds of base road, and draw them from above.

Imports nothing that takes time: every command line loads this file.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import typer

roads_command = typer.Typer(help="Kinds of base road: list them, draw them from above.")


@roads_command.command("list")
def list_command() -> None:
    """List the kinds of base road."""
    for name in import_module(f"{__package__.rpartition('.')[0]}.kinds").names():
        typer.echo(name)


@roads_command.command("sheet")
def sheet_command(
    folder: Path = typer.Argument(help="where the pictures go"),
    seeds: int = typer.Option(1, help="number of sheets, each of another seed"),
    kinds: str = typer.Option("", help="names of kinds, separated by commas; all without"),
) -> None:
    """Draw kinds of base road from above, one PNG per seed."""
    chosen = [name for name in kinds.split(",") if name]
    for path in import_module(f"{__package__}.from_above").sheet(folder, range(seeds), chosen):
        typer.echo(str(path))

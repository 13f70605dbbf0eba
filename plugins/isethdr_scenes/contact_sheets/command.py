"""`isethdr things`: list the families of things, and draw contact sheets of them.

This module imports nothing slow, because every command line loads it.
"""

from __future__ import annotations

from importlib import import_module
from typing import Annotated

import typer

PACKS = f"{__package__.rpartition('.')[0]}.things.packs"
things_app = typer.Typer(
    help="Families of vehicles, people, animals and plants.", no_args_is_help=True
)


@things_app.command("list", help="List the groups of things and their families.")
def list_command() -> None:
    """Print one line per group."""
    import_module(f"{__package__}.choice").print_groups()


@things_app.command("check", help="Check an asset pack, and list its things.")
def check_command(
    folder: Annotated[str, typer.Argument(help="folder with pack.yaml")],
) -> None:
    """Print one row per thing, or all mistakes."""
    import_module(f"{PACKS}.report").report(folder)


@things_app.command("materials", help="List the materials that an asset pack may name.")
def materials_command() -> None:
    """Print the names."""
    import_module(f"{PACKS}.report").print_materials()


@things_app.command("sheet", help="Render a contact sheet of things.")
def sheet_command(  # noqa: PLR0913 - each parameter is an option of the command line
    what: Annotated[
        str,
        typer.Argument(
            help="vehicles, or groups separated by commas (isethdr things list), or the folder of"
            " an asset pack"
        ),
    ],
    out: Annotated[str, typer.Option(help="the picture to write; NAME_key.csv lists its tiles")],
    count: Annotated[int, typer.Option(help="number of things")] = 24,
    seed: Annotated[int, typer.Option(min=0, help="seed of the random choice of things")] = 0,
    night: Annotated[bool, typer.Option("--night", help="render by night, with lamps on")] = False,
    quiz: Annotated[
        bool, typer.Option("--quiz", help="shuffle the things, and show numbers in place of names")
    ] = False,
    tile: Annotated[int, typer.Option(min=1, help="width of a tile in pixels")] = 160,
    samples: Annotated[int, typer.Option(min=1, help="samples per pixel")] = 24,
) -> None:
    """Render the tiles and write the sheet."""
    sheet = import_module(f"{__package__}.sheet")
    chosen = import_module(f"{__package__}.choice").chosen(what, count, seed, quiz)
    sheet.write(chosen, sheet.Look(tile, samples, night, quiz), out)

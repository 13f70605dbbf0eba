"""`isethdr lens import`: make a prescription from a lens file of another program.

This file imports nothing that takes time, because every command loads it.
"""

from __future__ import annotations

from importlib import import_module

import typer

lens_app = typer.Typer(help="Import lens files of other programs.", no_args_is_help=True)


@lens_app.callback()
def lens_commands() -> None:
    """Import lens files of other programs."""


@lens_app.command("import", short_help="Write a lens file as a prescription.")
def import_command(
    file: str = typer.Argument(help="Zemax .zmx, CODE V .seq, or PBRT .dat."),
    glass: list[str] = typer.Option(
        [], help="A glass catalogue .agf, or NAME=nd/Vd, or NAME=index; may be given several times."
    ),
    out: str = typer.Option("", help="The prescription to write; by default <file>.yaml here."),
) -> None:
    """Write a lens file as a prescription, and print its focal length, back focus and spots."""
    import_module(f"{__package__}.importing").run(file, glass, out)

"""`isethdr import-iset`: store the scenes of a tree of the published ISETHDR deposit.

This module imports nothing slow, because every command line loads it.
"""

from __future__ import annotations

from importlib import import_module

import typer


def import_command(
    folder: str = typer.Argument(help="any folder of the deposit, with the folders below it"),
    field_deg: float = typer.Option(
        40.0,
        min=0.01,
        max=150.0,
        help="full horizontal field angle, which the files do not state, degrees",
    ),
    normalise_cd_m2: float = typer.Option(
        0.0, help="mean luminance to which each light group is scaled; 0 keeps the radiance"
    ),
    look: bool = typer.Option(False, "--list", help="list the scenes and files; store nothing"),
) -> None:
    """Import scenes of the published ISETHDR deposit.

    All scenes in the folder and below it are stored. A second call stores those that are missing.
    """
    if import_module(f"{__package__}.importing").run(folder, field_deg, normalise_cd_m2, look):
        raise typer.Exit(1)

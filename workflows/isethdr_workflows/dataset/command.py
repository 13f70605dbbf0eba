"""The command `isethdr dataset generate|score|pairs|report|verify|splits|describe|list`."""

from __future__ import annotations

from types import ModuleType
from typing import Annotated

import typer

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Make, check and describe datasets of rendered scenes.",
)

Name = Annotated[str, typer.Argument(help="name of the dataset")]


def _actions() -> ModuleType:
    """Return the module that does the work. It is imported late, because `isethdr --help` must not
    import NumPy.
    """
    from . import actions

    return actions


@app.command(
    "generate",
    short_help="Render the missing scenes of a dataset.",
    help="Render the missing scenes of a dataset; type it again to continue.",
)
def generate(
    name: Name,
    settings: Annotated[
        list[str] | None,
        typer.Argument(
            help="count, seed, recipe (a name or a .yaml file), sample (make the first scenes"
            " only), engine (here, processes, slurm, ray), workers, hours, cpus and partition (of"
            " jobs), each as key=value; and overrides of all scenes, for example renderer.width=320"
        ),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="show what would be made")] = False,
    price: Annotated[
        float | None, typer.Option(help="price of an hour of this machine, to estimate the cost")
    ] = None,
) -> None:
    """Make scenes, or show what would be made."""
    _actions().make(name, settings or [], dry_run, price)


@app.command("score", help="Compare cameras over all scenes: scores with 95 % intervals.")
def score(
    name: Name,
    settings: Annotated[
        list[str] | None,
        typer.Argument(
            help="engine (here, processes, slurm, ray), workers, hours, cpus and partition (of"
            " jobs), each as key=value; and overrides of all runs, for example lens=ideal or"
            " sensor=bayer"
        ),
    ] = None,
) -> None:
    """Write the page and the tables of the cameras."""
    _actions().score(name, settings or [])


@app.command("pairs", help="Write captures with and without flare, ghosts, noise, blur.")
def pairs(
    name: Annotated[str, typer.Argument(help="name of a dataset, or of one stored scene")],
    settings: Annotated[
        list[str] | None,
        typer.Argument(
            help="folder, format (numpy or exr), shots (noisy ones), scenes (the first ones only),"
            " blur (true: also without blur), each as key=value; and overrides of all scenes, for"
            " example lighting=night_rural, sensor=bayer or +flare@flare.ghosts=ghosts_broadband"
        ),
    ] = None,
) -> None:
    """Make the pairs that are missing. Type the command again to continue."""
    _actions().pair(name, settings or [])


@app.command("report", help="Write the page of a dataset: contact sheets, counts, outliers.")
def report(name: Name) -> None:
    """Write the page."""
    _actions().report(name)


@app.command("verify", help="Check every file of a dataset against checksum and recipe.")
def verify(name: Name) -> None:
    """Print the problems; exit code 1 if there are any."""
    _actions().check(name)


@app.command("splits", help="Write which scenes are for training, validation and test.")
def splits(name: Name) -> None:
    """Write the parts, which keep a road together."""
    _actions().split(name)


@app.command("describe", help="Write the card of a dataset: contents, units, how it was made.")
def describe(name: Name) -> None:
    """Write the card."""
    _actions().describe(name)


@app.command("list", help="List the datasets of the home.")
def list_datasets() -> None:
    """Print one row for each dataset."""
    _actions().list_all()

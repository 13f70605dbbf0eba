"""The command `isethdr train picture|detector`: networks trained on simulated data."""

from __future__ import annotations

from importlib import import_module
from typing import Annotated

import typer

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Train networks on simulated data. Needs pip install 'isethdr[train]'.",
)

OfPicture = Annotated[
    list[str] | None,
    typer.Argument(
        help="minutes or steps, size (small, large), network (unet, nafnet, restormer), captures"
        " (merged, apart), loss (electrons, view), dataset, seed, name and others"
        " (docs/how-to/train_picture.md), each as key=value; and overrides of the config, for"
        " example sensor=typical_bayer"
    ),
]
OfDetector = Annotated[
    list[str] | None,
    typer.Argument(
        help="dataset (required), minutes or steps, cameras, lightings, realisations, size (small,"
        " large), seed, name and others (docs/how-to/detectors.md), each as key=value; and"
        " overrides of all runs, for example lens=ideal"
    ),
]


@app.callback()
def about() -> None:
    """Keep the subcommands apart, even if there is one."""


@app.command("picture", help="Train a network that develops raw captures, for isp=network.")
def picture(settings: OfPicture = None) -> None:
    """Train, or continue the training with these settings."""
    # imported late, because `isethdr --help` must not import NumPy
    action = import_module(".picture.action", __package__)
    raise typer.Exit(action.train_picture(settings or []))


@app.command("detector", help="Train a small detector of road users, for study detector_scores.")
def detector(settings: OfDetector = None) -> None:
    """Train, or continue the training with these settings."""
    action = import_module(".detector.action", __package__)
    raise typer.Exit(action.train_detector(settings or []))

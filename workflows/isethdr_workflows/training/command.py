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

Typed = Annotated[
    list[str] | None,
    typer.Argument(help="settings as key=value; other keys are overrides of the config"),
]


@app.callback()
def about() -> None:
    """Keep the subcommands apart, even if there is one."""


@app.command("picture", help="Train a network that develops raw captures, for isp=network.")
def picture(settings: Typed = None) -> None:
    """Train, or continue the training with these settings.

    Settings: sensor, size (small, large), network (unet, nafnet, restormer), minutes or steps,
    dataset, loss (electrons, view), captures (merged, apart), seed, name;
    docs/how-to/train_picture.md.
    """
    # imported late, because `isethdr --help` must not import NumPy
    action = import_module(".picture.action", __package__)
    raise typer.Exit(action.train_picture(settings or []))


@app.command("detector", help="Train a small detector of road users, for study detector_scores.")
def detector(settings: Typed = None) -> None:
    """Train, or continue the training with these settings.

    Settings: dataset, cameras, lightings, realisations, size (small, large), minutes or steps,
    seed, name; docs/how-to/detectors.md.
    """
    action = import_module(".detector.action", __package__)
    raise typer.Exit(action.train_detector(settings or []))

"""The six hooks: all that a plugin may provide. A plugin implements any subset of them.

Hooks are listed in the order they are called: when the registry is built, when the command line
is built, then around each stage of a run.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import pluggy

if TYPE_CHECKING:
    import typer

    from .component import Component, Stage

PROJECT = "isethdr"
hookspec = pluggy.HookspecMarker(PROJECT)
hookimpl = pluggy.HookimplMarker(PROJECT)


# --- when the registry is built -------------------------------------------------------------------


@hookspec
def isethdr_components() -> Iterable[Component]:
    """Return the components this plugin offers.

    Called at most once per process, when a component is first looked up. `isethdr --help` imports
    the module of the plugin, and does not call this hook. A class whose module imports heavy
    libraries is registered by its place, `Component("lens", "acme", "acme.lenses:AcmeLens")`.
    """


@hookspec
def isethdr_config_paths() -> Iterable[str]:
    """Return Hydra search paths with presets and experiments, e.g. `["pkg://acme.conf"]`.

    A preset `conf/sensor/acme_night.yaml` is chosen by `sensor=acme_night`; its first line names
    the component it is based on: `defaults: [acme]`.
    """


# --- when the command line is built ---------------------------------------------------------------


@hookspec
def isethdr_commands(app: typer.Typer) -> None:
    """Add commands to `isethdr`: `app.command("name")(function)` or `app.add_typer(sub,
    name="name")`.
    """


# --- around each stage of a run -------------------------------------------------------------------


@hookspec
def isethdr_before_stage(stage: Stage) -> None:
    """Called before a stage runs. `stage` has `kind`, `name` and `component`. Later versions may
    add attributes, and never remove any.
    """


@hookspec
def isethdr_after_stage(stage: Stage) -> None:
    """Called after a stage has run; `stage.result` is its result, `stage.row` its ledger row.

    Called once more for the whole run, with the kind `run` and the finished `Result`, and after a
    sweep with the kind `sweep` and the table of its scores. `stage.row` is then None.
    """


@hookspec
def isethdr_on_stage_error(stage: Stage) -> None:
    """Called when a stage raises; `stage.error` is the exception, which is raised again
    afterwards. Called once more with the kind `run`.
    """

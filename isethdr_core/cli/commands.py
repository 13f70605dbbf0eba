"""The command line: `isethdr run|plan|study|plugins|doctor|catalog|...`; plugins add commands by a
hook.

`run` and `plan` take Hydra overrides: `isethdr run sensor=rgbw`, `isethdr run -m
sensor=bayer,rgbw`. Nothing heavy is imported here: `isethdr --help` stays quick.
"""

from __future__ import annotations

import codecs
import errno
import io
import logging
import sys
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.main import get_command

import isethdr_core

from ..errors import ConfigError, IsetHdrError, did_you_mean
from ..plugins.registry import plugin_manager
from ..storage.home_folder import working_folder
from .completion import SHELLS, complete, script
from .deferred_libraries import defer
from .home_option import command_of, use_homes, without_homes
from .run_help import print_run_help

if TYPE_CHECKING:
    from pluggy import PluginManager

log = logging.getLogger(__name__)
app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Simulate cameras in high dynamic range driving scenes, in physical units.",
)
PASS_OVERRIDES = {"allow_extra_args": True, "ignore_unknown_options": True}
# errors of a disk that is full, or of a file that may not be read or written
NO_ACCESS = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EPERM)
COMPLETE = ["complete", "--"]  # first arguments of a call from a completion script
# Python's own error handlers of standard output, which fail at a character such as ±; the second
# one is that of the locale C
FAILING = ("strict", "surrogateescape")
PASS = PASS_OVERRIDES | {"help_option_names": []}


def _print_version(requested: bool) -> None:
    if requested:
        print(f"isethdr {isethdr_core.__version__}")
        raise typer.Exit()


@app.callback()
def options(
    version: bool = typer.Option(
        False, "--version", is_eager=True, callback=_print_version, help="Show the version."
    ),
    home: str = typer.Option(
        "",
        help="Home folder of runs and scenes, in place of ISETHDR_HOME or ./runs. It may also"
        " follow the command. Queries accept it several times.",
    ),
) -> None:
    """Handle the options before the command name; `main` has already removed `--home`."""


@app.command(
    context_settings=PASS,
    help="Simulate cameras, from the scene to the scores; or a sweep.",
)
def run(context: typer.Context) -> None:
    """Hand the overrides to Hydra, which composes the config and calls one run, or one per job of a
    sweep.
    """
    if {"--help", "-h"} & set(context.args):
        print_run_help()
        return
    from ..config.hydra_app import run_with_hydra

    run_with_hydra(context.args)


@app.command(
    context_settings=PASS_OVERRIDES,
    short_help="Show what a run would compute, and for how long.",
    help="Show what a run would compute, and for how long: isethdr plan [override ...].",
)
def plan(context: typer.Context) -> None:
    """Print the demand, the stored results, and the omissions with their reasons."""
    if flags := [a for a in context.args if a.startswith("-")]:
        raise ConfigError(
            f"plan has no option {flags[0]!r}; expected overrides; "
            "type for example isethdr plan sensor=rgbw"
        )
    from .plan_summary import print_plan

    print_plan(context.args)


@app.command(help="List components and presets, or the fields of one of them.")
def plugins(
    kind: str = typer.Argument("", help="list only this kind, for example sensor"),
    name: str = typer.Argument(
        "", help="show all fields of this component or preset, for example bayer"
    ),
    strict: bool = typer.Option(False, help="exit with an error when a plugin is broken"),
) -> None:
    """Print names by kind, or all fields of one component; broken plugins come last, in red."""
    from .plugin_list import print_plugins

    if print_plugins(kind, name) and strict:
        raise typer.Exit(1)


@app.command("new-plugin", help="Make a package with a component of your own, and tests.")
def new_plugin(
    kind: str = typer.Argument(help="the kind of component, for example sensor"),
    name: str = typer.Argument(help="its name, for example acme_mono"),
    into: Path = typer.Option(Path("."), help="the folder that holds the new package's folder"),
) -> None:
    """Write the package, and print what to type next."""
    from .new_plugin import print_new_plugin  # Jinja2 is not needed by other commands

    print_new_plugin(kind, name, into)


@app.command(help="Print the script of tab completion for bash, zsh or fish.")
def completion(shell: str = typer.Argument(help="bash, zsh or fish")) -> None:
    """Print the completion script that a shell reads when it starts."""
    if shell not in SHELLS:
        raise ConfigError(
            f"no script for the shell {shell!r}{did_you_mean(shell, SHELLS)}; type for example"
            " isethdr completion bash"
        )
    print(script(shell), end="")


@cache
def _with_plugins(manager: PluginManager) -> Any:
    """Return the command line with the commands of all plugins. They are added only once."""
    add_commands(manager, app)
    return get_command(app)


def add_commands(manager: PluginManager, app: typer.Typer) -> None:
    """Add the commands of all plugins. A plugin that fails is logged as an error, and its commands
    are left out.

    Parameters
    ----------
    manager : plugins.
    app : command line.
    """
    plugins = manager.get_plugins()
    for impl in reversed(manager.hook.isethdr_commands.get_hookimpls()):  # the order of pluggy
        others = plugins - {impl.plugin}
        try:
            manager.subset_hook_caller("isethdr_commands", others)(app=app)
        except (Exception, SystemExit) as err:  # the code of a third party may raise anything
            said = " ".join(str(err).split())
            log.error(
                "plugin %r cannot add its commands, which are left out (%s: %s)",
                impl.plugin_name,
                type(err).__name__,
                said,
            )


def main() -> None:
    """Run the `isethdr` command. A user's mistake prints one line, without a traceback."""
    if sys.argv[1:3] == COMPLETE:  # called at each press of Tab, so no plugin is imported
        print("\n".join(complete(app, sys.argv[3:])))
        return
    defer()
    _print_any_character()
    try:
        sys.argv[1:], homes = without_homes(sys.argv[1:])
        use_homes(homes, command_of(sys.argv[1:]))
        _with_plugins(plugin_manager())()
    except IsetHdrError as err:
        print(f"error: {err}", file=sys.stderr)
        sys.exit(2)
    except OSError as err:
        _check_working_folder(err)
        if err.errno not in NO_ACCESS:
            raise
        print(
            f"error: cannot read or write {err.filename or 'a file'}: {err.strerror}; stored"
            " results are complete; make room, or choose another folder",
            file=sys.stderr,
        )
        sys.exit(2)


def _print_any_character() -> None:
    """Let the output write `?` in place of a character that its encoding lacks, such as ± in ASCII.
    Standard error writes an escape already. A way that PYTHONIOENCODING names remains.
    """
    out = sys.stdout
    if not isinstance(out, io.TextIOWrapper) or codecs.lookup(out.encoding).name == "utf-8":
        return
    if out.errors in FAILING:
        out.reconfigure(errors="replace")


def _check_working_folder(err: OSError) -> None:
    """End the process with one line if the working folder was deleted, which explains the error."""
    if not isinstance(err, FileNotFoundError):
        return
    try:
        working_folder()
    except ConfigError as gone:
        print(f"error: {gone}", file=sys.stderr)
        sys.exit(2)

"""Hydra application: single runs, sweeps (`-m`) and launchers. A failure prints one line and sets
an exit code for its kind.

A config is composed without xarray and SciPy, so that a mistake is reported quickly. The modules of
a run (`job`) and of a sweep (`sweeps`) are imported later.
"""

from __future__ import annotations

import logging
import os
import sys
import time
import traceback
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from typing import NoReturn

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import Override
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ..errors import ConfigError, IsetHdrError
from ..runs.parent_watch import end_with_parent, exit_on_sigterm
from ..storage.home_folder import home
from ..sweeps.record import Job, begin, write_job
from . import chunk_launcher
from .composition import (
    check_choices,
    register_with_hydra,
    user_mistakes,
    with_choices,
)
from .hydra_shortcuts import NO_MODE
from .kept_choices import CONFIG_MODULE
from .trust import check_arguments
from .typed_text import with_texts

# exit codes: an error that the user can mend, a crash of a component, Ctrl-C (128 + SIGINT)
MISTAKE = 2
CRASH = 1
INTERRUPTED = 130

OF_HYDRA = ("hydra", "hydra_plugins")  # loggers that announce each job


class JobsFailed(Exception):
    """A job of a sweep failed and printed its reason. Hydra raises this error after the
    other jobs.
    """


def run_with_hydra(arguments: list[str]) -> None:
    """Run once, or sweep with `-m`. Hydra reads `arguments` as its command line.

    Raises
    ------
    ConfigError : a mistake that is found before the run or the first job, in `arguments` or in the
        config.
    """
    register_with_hydra()
    chunk_launcher.register()
    with user_mistakes():
        arguments = with_texts(arguments)
        check_arguments(arguments)
        # argparse also accepts the beginning of an option, such as --multi
        options, others = get_args_parser().parse_known_args(arguments)
        typed = [*options.overrides, *(a for a in others if not a.startswith("-"))]
        overrides = OverridesParser.create().parse_overrides(typed)
        _check_settings_of_sweeps(overrides)
        if not any(a.startswith("-") for a in arguments):
            check_choices(overrides)
    sweep = None
    if options.multirun:
        from .sweeps import finish, prepared, watched  # imports as much as a run does

        with user_mistakes():
            ready = prepared(arguments)
        arguments = ready.arguments
        sweep = ready.sweep
    watching: AbstractContextManager[None] = nullcontext()
    if sweep is not None:
        begin(sweep)
        watching = watched(sweep)
        for logger in OF_HYDRA:  # the progress line replaces their line for each job
            logging.getLogger(logger).setLevel(logging.WARNING)
    sys.argv = ["isethdr run", *arguments]
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra raises errors unchanged; `explain` words them
    exit_on_sigterm()
    try:
        with user_mistakes(), watching:
            code = _start_hydra(sweep is not None)
    except KeyboardInterrupt:
        print(
            "interrupted: stored results are complete; type the same command again to continue",
            file=sys.stderr,
        )
        sys.exit(INTERRUPTED)
    if sweep is not None:
        finish(sweep)
    if code:
        sys.exit(code)


def _check_settings_of_sweeps(overrides: Sequence[Override]) -> None:
    """Refuse settings of Hydra with which a sweep would have no record.

    Raises
    ------
    ConfigError : an override sets the mode, which follows from `-m`, or the folder of a sweep.
    """
    for override in overrides:
        if override.key_or_group == "hydra.mode":
            raise ConfigError(
                f"{override.input_line} cannot be set by an override; expected -m for a sweep; type"
                " isethdr run -m, or isethdr run for a single run, and the same overrides without"
                " hydra.mode"
            )
        if override.key_or_group == "hydra.sweep.dir":
            raise ConfigError(
                f"{override.input_line} cannot be set by an override, because a sweep is stored in"
                " sweeps/NAME of the home; expected a name; type for example name=night"
            )


def _start_hydra(sweeping: bool) -> int:
    """Let Hydra start the jobs, and return the exit code.

    A launcher raises errors of its own if the process of a job was killed, or no cluster answers.
    """
    try:
        hydra.main(version_base="1.3", config_path=f"pkg://{CONFIG_MODULE}", config_name="config")(
            task
        )()
    except JobsFailed as failure:
        print(f"error: {failure}", file=sys.stderr)
        return CRASH
    except (IsetHdrError, HydraException, OmegaConfBaseException):
        raise
    except Exception as err:
        if not sweeping:
            raise
        reason = next((line for line in str(err).splitlines() if line.strip()), "no reason given")
        print(
            f"error: the launcher of the sweep stopped ({type(err).__name__}: {reason.strip()});"
            " stored results are complete; type the same command again to continue",
            file=sys.stderr,
        )
        return CRASH
    return 0


def task(config: DictConfig) -> None:
    """Compute one run of a composed config and print its summary; a failure prints one line.

    In a sweep the other jobs continue, and `JobsFailed` is raised after them.

    Raises
    ------
    ConfigError : a config file asks for a sweep, of which nobody has made a record.
    """
    end_with_parent()
    hydra_config = HydraConfig.get()
    sweeping = hydra_config.mode == RunMode.MULTIRUN
    if sweeping and not any(o.startswith(NO_MODE) for o in hydra_config.overrides.hydra):
        raise ConfigError(
            "hydra.mode is MULTIRUN in the config, which asks for a sweep without -m; such a sweep"
            " would have no table and no name; remove hydra.mode from the file and type isethdr run"
            " -m, and the same overrides"
        )
    started = time.monotonic()
    number = hydra_config.job.num if sweeping else 0
    folder = Path(hydra_config.sweep.dir)
    # as typed: an override may hold ${...}
    typed = OmegaConf.to_container(hydra_config.overrides.task, resolve=False)
    overrides = tuple(map(str, typed or ()))
    try:
        config = with_choices(config.copy(), hydra_config.runtime.choices)
        from . import job  # imports the chain with all its libraries

        if sweeping:
            job.run_in_sweep(config, folder, number, overrides)
        else:
            job.run_and_print(config)
    except Exception as err:  # the code of a plugin may raise anything
        if not sweeping and output_closed(err):
            _end_without_reader()
        keep_traceback(err)
        text, code = complaint(err)
        if sweeping:
            seconds = time.monotonic() - started
            write_job(folder, Job(number, overrides, seconds, error=text))
            print(
                f"error: job {' '.join(overrides)}: {text}",
                file=sys.stderr,
                flush=True,
            )
            raise JobsFailed(
                "a job failed, as printed above; the results of the other jobs are stored"
            ) from None
        print(f"error: {text}", file=sys.stderr)
        sys.exit(code)


def output_closed(err: Exception) -> bool:
    """Return whether the reader of the printed text has ended, as in `isethdr run | head`. A crash
    in a stage has a note with its traceback.
    """
    return isinstance(err, BrokenPipeError) and not getattr(err, "__notes__", [])


def _end_without_reader() -> NoReturn:
    """End the process without a message, as Typer ends other commands whose reader has ended."""
    # what is still buffered goes nowhere, so that Python does not complain at its end
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    sys.exit(CRASH)


def keep_traceback(err: Exception) -> None:
    """Write the traceback of a crash outside the stages of a run, and add a note with its path.

    Parameters
    ----------
    err : the exception. Nothing is written for a mistake of the user, nor for the crash of a stage,
        which has a traceback already.
    """
    if isinstance(err, IsetHdrError) or getattr(err, "__notes__", []):
        return
    path = home() / "failed" / f"{time.strftime('%Y%m%d_%H%M%S')}_{os.getpid()}.txt"
    with suppress(OSError):  # a full disk must not hide the error that it caused
        path.parent.mkdir(parents=True, exist_ok=True)
        text = "".join(traceback.format_exception(err))
        # a path in the text may hold bytes that are no UTF-8
        path.write_text(text, encoding="utf-8", errors="backslashreplace")
        err.add_note(f"traceback in {path}")


def complaint(err: Exception) -> tuple[str, int]:
    """Return one line about a failure, and the exit code. If a component crashed, the line names
    the stage and the path of the traceback.
    """
    if isinstance(err, IsetHdrError):
        return str(err), MISTAKE
    where = "; ".join(getattr(err, "__notes__", []))
    return f"{type(err).__name__}: {' '.join(str(err).split())}" + (
        f"; {where}" if where else ""
    ), CRASH

"""Hydra application: single runs, sweeps (`-m`) and launchers. A failure is one line with an exit
code for its kind.

A config is composed without xarray and SciPy, so that a mistake is reported quickly. The modules of
a run (`job`) and of a sweep (`sweeps`) are imported later.
"""

from __future__ import annotations

import os
import sys

import hydra
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode

from ..errors import IsetHdrError
from ..runs.parent_watch import end_with_parent, exit_on_sigterm
from .composition import (
    CONFIG_MODULE,
    check_choices,
    register_with_hydra,
    user_mistakes,
    with_choices,
)
from .trust import check_arguments

MISTAKE, CRASH, INTERRUPTED = (
    2,
    1,
    130,
)  # exit codes: the user's to fix, a component's, Ctrl-C (128 + SIGINT)


class JobsFailed(Exception):
    """A job of a sweep failed and printed its reason. Hydra raises this error after the
    other jobs.
    """


def run_with_hydra(arguments: list[str]) -> None:
    """Run once, or sweep with `-m`. Hydra reads `arguments` as its command line."""
    register_with_hydra()
    with user_mistakes():
        check_arguments(arguments)
        if not any(a.startswith("-") for a in arguments):
            check_choices(arguments)
    if {"-m", "--multirun"} & set(arguments):
        from .sweeps import prepared  # as heavy as a run

        arguments = prepared(arguments)
    sys.argv = ["isethdr run", *arguments]
    os.environ["HYDRA_FULL_ERROR"] = "1"  # Hydra raises errors as they are, and we explain them
    exit_on_sigterm()
    try:
        with user_mistakes():
            _start_hydra()
    except KeyboardInterrupt:
        print(
            "interrupted: stored results are complete; type the same command again to continue",
            file=sys.stderr,
        )
        sys.exit(INTERRUPTED)


def _start_hydra() -> None:
    try:
        hydra.main(version_base="1.3", config_path=f"pkg://{CONFIG_MODULE}", config_name="config")(
            task
        )()
    except JobsFailed as failure:
        print(f"error: {failure}", file=sys.stderr)
        sys.exit(CRASH)


def task(config) -> None:
    """Compute one run of a composed config and print its summary; a failure is one line.

    In a sweep the other jobs continue, and `JobsFailed` is raised after them.
    """
    end_with_parent()
    hydra_config = HydraConfig.get()
    sweeping = hydra_config.mode == RunMode.MULTIRUN
    try:
        config = with_choices(config.copy(), hydra_config.runtime.choices)
        from .job import run_and_print  # the chain with all its libraries

        run_and_print(config)
    except Exception as err:  # a plugin's code: anything may happen
        text, code = complaint(err)
        if sweeping:
            print(
                f"error: job {' '.join(hydra_config.overrides.task)}: {text}",
                file=sys.stderr,
                flush=True,
            )
            raise JobsFailed(
                "a job failed, as printed above; the results of the other jobs are stored"
            ) from None
        print(f"error: {text}", file=sys.stderr)
        sys.exit(code)


def complaint(err: Exception) -> tuple[str, int]:
    """Return one line about a failure, and the exit code: a component's crash names the stage and
    where the traceback is.
    """
    if isinstance(err, IsetHdrError):
        return str(err), MISTAKE
    where = "; ".join(getattr(err, "__notes__", []))
    return f"{type(err).__name__}: {' '.join(str(err).split())}" + (
        f"; {where}" if where else ""
    ), CRASH

"""Run steps: skip finished ones, stop at the time limit, pass Ctrl-C on."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.util import find_spec

from isethdr_core.errors import CatalogError
from isethdr_core.storage.home_folder import home

from .records import folder, is_finished, write
from .steps import LONGEST_MIN, Step

UNWIND_S = 15.0  # time for an interrupted command to remove incomplete files
Tell = Callable[[str], None]


class OutOfTime(Exception):
    """A step reached its time limit. The same command continues from there."""


def run_steps(steps: Sequence[Step], tell: Tell = print) -> list[str]:
    """Run the steps that are not finished, in order, and return the names of those left out.

    Parameters
    ----------
    steps : steps to run.
    tell : called with one line of text for each step.

    Raises
    ------
    CatalogError : a command failed; finished steps are kept.
    OutOfTime : a step reached its limit.
    KeyboardInterrupt : Ctrl-C, after the command has ended.
    """
    skipped = []
    for place, step in enumerate(steps, 1):
        line = f"step {place} of {len(steps)}, {step.name}: "
        library, extra = step.needs
        if is_finished(step):
            tell(line + "done before")
            continue
        if library and find_spec(library) is None:
            tell(line + f"left out, it needs pip install 'isethdr[{extra}]'")
            skipped.append(step.name)
            continue
        tell(line + f"{step.about}, about {step.minutes:g} min")
        folder().mkdir(parents=True, exist_ok=True)
        started = time.monotonic()
        ended = False
        try:
            for command in step.commands:
                tell(f"  {typed(command)}")
                run_command(command, LONGEST_MIN * 60 - (time.monotonic() - started))
            missing = [path for path in step.makes if not (home() / path).exists()]
            ended = not missing
        finally:
            minutes = (time.monotonic() - started) / 60
            write(step, minutes, ended, os.getloadavg()[0])
        if missing:
            raise CatalogError(
                f"step {step.name} ended without {missing[0]}; expected its commands to make it;"
                f" type isethdr experiments run {step.name} and read the messages of its commands"
            )
        tell(f"  done in {minutes:.1f} min")
    return skipped


def words_of(command: str) -> list[str]:
    """Return the words of a command; {home} in it stands for the home folder."""
    return [word.format(home=home()) for word in shlex.split(command)]


def typed(command: str) -> str:
    """Return a command as it is typed in a shell."""
    return shlex.join(["isethdr", *words_of(command)])


def run_command(command: str, seconds: float) -> None:
    """Run one command of isethdr in a process of its own, with the same home folder.

    Parameters
    ----------
    command : words of the command; {home} stands for the home folder.
    seconds : time limit, s.

    Raises
    ------
    CatalogError : the command failed.
    OutOfTime : the command took too long and was interrupted as by Ctrl-C.
    """
    module = f"{__package__}.child"
    child = subprocess.Popen([sys.executable, "-m", module, str(os.getpid()), *words_of(command)])
    try:
        code = child.wait(max(seconds, 0.0))
    except subprocess.TimeoutExpired:
        raise OutOfTime(command) from None
    except KeyboardInterrupt:
        # a terminal sends Ctrl-C to the command, too; a second signal would disturb its clean-up
        with suppress(subprocess.TimeoutExpired):
            child.wait(UNWIND_S)
        raise
    finally:
        ended(child)
    if code:
        raise CatalogError(
            f"isethdr {command} ended with code {code}; its own message is above; finished steps"
            " are kept; type the same command again to go on"
        )


def ended(child: subprocess.Popen[bytes]) -> None:
    """End a process if it still runs, first as by Ctrl-C, then by force."""
    if child.poll() is not None:
        return
    child.send_signal(signal.SIGINT)
    try:
        child.wait(UNWIND_S)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()

"""The option `--home PATH` of every command. It sets ISETHDR_HOME, also for the processes that a
sweep starts. Commands that only read the catalog accept it several times.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from ..errors import ConfigError
from ..storage.home_folder import (
    HOME,
    OTHER_HOMES,
    existing_home,
    existing_homes,
    is_home,
    readable,
    working_folder,
)
from ..storage.object_home.address import Address, is_address, scratch_folder
from ..storage.object_home.calls import prepare_writing

OPTION = "--home"
# commands that write into a home, and make it where it is missing
MAKES_HOMES = ("run", "sequence", "study", "dataset", "train", "experiments", "import-iset")
# subcommands of these commands that only read a home
READS_ONLY = tuple(f"dataset {name}" for name in ("report", "verify", "splits", "describe", "list"))
PLAN = "plan"  # it foretells what `run` would do, also in a home that is not there yet
READS_SEVERAL = ("catalog", "export", "reproduce")  # some of their subcommands read several homes


def without_homes(arguments: list[str]) -> tuple[list[str], list[str]]:
    """Return the arguments without each `--home PATH` or `--home=PATH`, and the paths.

    Raises
    ------
    ConfigError : a path is missing.
    """
    rest: list[str] = []
    homes: list[str] = []
    words = iter(arguments)
    for word in words:
        if word == OPTION:
            homes.append(next(words, ""))
        elif word.startswith(f"{OPTION}="):
            homes.append(word.removeprefix(f"{OPTION}="))
        else:
            rest.append(word)
    if "" in homes or any(home.startswith("-") for home in homes):
        raise ConfigError(
            f"{OPTION} has no path; expected a folder; type for example {OPTION} runs"
        )
    return rest, homes


def command_of(arguments: Sequence[str]) -> str:
    """Return the command of a command line without `--home`: the first word, or the first two of a
    subcommand that only reads; "" if there is no word.
    """
    subcommand = " ".join(arguments[:2])
    return subcommand if subcommand in READS_ONLY else next(iter(arguments), "")


def use_homes(paths: Sequence[str], command: str) -> None:
    """Make the first path the home of this process, and have queries read the others as well.

    Parameters
    ----------
    paths : folders, and addresses of object homes; none leaves the variables as they are.
    command : the command, as `command_of` returns it, for example `catalog`.

    Raises
    ------
    ConfigError : several paths for a command that works in one home; also as `use_home`.
    CatalogError : one of several paths is no home; also as `use_home`.
    """
    if not paths:
        return
    if len(paths) > 1 and command not in READS_SEVERAL:
        raise ConfigError(
            f"{OPTION} is typed {len(paths)} times, but isethdr {command} works in one home; type"
            f" for example isethdr {command} {OPTION} {paths[0]}"
        )
    os.environ.pop(OTHER_HOMES, None)
    use_home(paths[0], command)
    if len(paths) > 1:
        os.environ[OTHER_HOMES] = "\n".join(map(_named, paths[1:]))
        existing_homes()


def _named(path: str) -> str:
    if is_address(path):
        return path
    folder = Path(path).expanduser()
    return str(folder if folder.is_absolute() else working_folder() / folder)


def use_home(path: str, command: str) -> None:
    """Make `path` the home of this process and of those that it starts.

    A command that writes makes a new home, and says so on standard error.

    Parameters
    ----------
    path : a folder, or the address of an object home.
    command : the command, as `command_of` returns it, for example `run`.

    Raises
    ------
    ConfigError : the path is a file, or a folder of something else; or another kind of address.
    CatalogError : a command that only reads is given a path that is no home; no permission to read
        the folder; or the object home cannot be read, or written where the command writes.
    """
    if is_address(path):
        address = Address.parsed(path)
        os.environ[HOME] = address.url
        if command in MAKES_HOMES:
            prepare_writing(scratch_folder(address))
        return
    folder = Path(_named(path))
    os.environ[HOME] = str(folder)
    if command == PLAN and not folder.exists():
        return
    if command not in MAKES_HOMES:
        existing_home()
        return
    with readable(folder):
        exists = folder.exists()
        is_other = exists and not is_home(folder)
    if is_other:
        what = "a folder of other files" if folder.is_dir() else "no folder"
        raise ConfigError(
            f"{folder} is {what}; expected a home folder, which holds"
            " scenes/ or runs/, or a path that is free; type for example"
            f" {OPTION} {folder.parent / 'isethdr_home'}"
        )
    if not exists:
        print(f"new home folder:\n{folder}", file=sys.stderr)

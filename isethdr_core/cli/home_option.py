"""The option `--home PATH` of every command: it stands for ISETHDR_HOME, also in the processes that
a sweep starts.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from ..errors import ConfigError
from ..storage.home_folder import HOME, existing_home, is_home
from ..storage.object_home.address import Address, is_address, scratch_folder
from ..storage.object_home.calls import prepare_writing

OPTION = "--home"
MAKES_HOMES = ("run", "study", "dataset", "import-iset")  # commands that write stores


def without_home(arguments: list[str]) -> tuple[list[str], str | None]:
    """Return the arguments without `--home PATH` or `--home=PATH`, and the path.

    Raises
    ------
    ConfigError : the path is missing, or the option is typed twice.
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
    if len(homes) > 1:
        raise ConfigError(f"{OPTION} is typed {len(homes)} times; expected one home folder")
    return rest, homes[0] if homes else None


def use_home(path: str, command: str) -> None:
    """Make `path` the home of this process and of those that it starts.

    A command that writes makes a new home, and says so on standard error.

    Parameters
    ----------
    path : a folder, or the address of an object home.
    command : the first word, for example `run`.

    Raises
    ------
    ConfigError : the path is a file, or a folder of something else; or another kind of address.
    CatalogError : a command that only reads is given a path that is no home; or the object home
        cannot be read, or written where the command writes.
    """
    if is_address(path):
        address = Address.parsed(path)
        os.environ[HOME] = address.url
        if command in MAKES_HOMES:
            prepare_writing(scratch_folder(address))
        return
    folder = Path(path).expanduser().absolute()
    os.environ[HOME] = str(folder)
    if command not in MAKES_HOMES:
        existing_home()
    elif folder.exists() and not is_home(folder):
        what = "a folder of other files" if folder.is_dir() else "no folder"
        raise ConfigError(
            f"{folder} is {what}; expected a home folder, which holds"
            " scenes/ or runs/, or a path that is free; type for example"
            f" {OPTION} {folder.parent / 'isethdr_home'}"
        )
    elif not folder.exists():
        print(f"new home folder:\n{folder}", file=sys.stderr)

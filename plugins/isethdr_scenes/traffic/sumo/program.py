"""SUMO's programs: their path, their version, and their messages."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from functools import cache
from importlib import metadata
from pathlib import Path

from isethdr_core.errors import CatalogError, ConfigError

DISTRIBUTION = "eclipse-sumo"
TIMEOUT_S = 3600


@cache
def tool(name: str) -> Path:
    """Return the path of a program of SUMO: that of the installed wheel, else on the search path.

    Raises
    ------
    ConfigError : the program is not installed.
    """
    installed = of_wheel(name)
    if installed is not None:
        return installed
    found = shutil.which(name, path=str(Path(sys.executable).parent)) or shutil.which(name)
    if found is None:
        raise ConfigError(
            f"scene.traffic needs SUMO's {name}, which is not installed; type pip install"
            " 'isethdr[traffic]', or scene.traffic=placer"
        )
    return Path(found)


def of_wheel(name: str) -> Path | None:
    """Return the path of a program of SUMO's wheel, or None."""
    try:
        path = Path(str(metadata.distribution(DISTRIBUTION).locate_file(f"sumo/bin/{name}")))
    except metadata.PackageNotFoundError:
        return None
    return path if path.is_file() else None


def surroundings(path: Path) -> dict[str, str]:
    """Return the environment in which a program of SUMO finds SUMO's data."""
    found = dict(os.environ)
    home = path.parent.parent  # the wheel holds SUMO's data next to the folder of programs
    if (home / "data").is_dir():
        found["SUMO_HOME"] = str(home)
    return found


@cache
def version() -> str:
    """Return the version of SUMO.

    Raises
    ------
    ConfigError : SUMO is not installed.
    """
    done = subprocess.run([tool("sumo"), "--version"], capture_output=True, text=True, check=False)
    found = re.search(r"Version (\S+)|sumo (\d\S*)", done.stdout)
    return next(filter(None, found.groups())) if found else "unknown"


def call(name: str, arguments: Sequence[str], folder: Path) -> tuple[str, ...]:
    """Run a program of SUMO in a folder, and return its warnings.

    Parameters
    ----------
    name : name of the program: netconvert, sumo, ...
    arguments : arguments of its command line.
    folder : folder in which it runs.

    Raises
    ------
    ConfigError : the program is not installed.
    CatalogError : the program fails; the message holds the first error that it names.
    """
    path = tool(name)
    done = subprocess.run(
        [str(path), *arguments],
        cwd=folder,
        env=surroundings(path),
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    said = (done.stderr + done.stdout).splitlines()
    if done.returncode:
        errors = [line.removeprefix("Error:").strip() for line in said if line.startswith("Error")]
        first = errors[0] if errors else "no error message"
        raise CatalogError(f"SUMO's {name} ended with {done.returncode}: {first}")
    return tuple(x.removeprefix("Warning:").strip() for x in said if x.startswith("Warning"))

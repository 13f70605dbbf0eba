"""A user's configuration of SUMO: the values of its options, the files that it names, and a copy
that only reads, because it names no file that SUMO writes.
"""

from __future__ import annotations

import os
import re
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ...roads.opendrive.elements import Node, opened
from .program import call, surroundings, tool

COPY_OF_CONFIGURATION = "isethdr.sumocfg"
TEMPLATE = "template.xml"
# Sections of SUMO's options that determine the traffic. Options of all other sections (output,
# report, devices that only record, ...) are left out, so that no new kind of output is missed.
SECTIONS = frozenset(
    (
        "input",
        "time",
        "processing",
        "routing",
        "emissions",
        "battery",
        "toc_device",
        "driver_state_device",
        "bluelight_device",
        "elechybrid_device",
        "taxi_device",
        "glosa_device",
        "friction_device",
        "fcd_replay_device",
        "mesoscopic",
        "random_number",
    )
)
# options of these sections that name files; SUMO reads these files, and writes all others
READ = frozenset(
    (
        "net-file",
        "route-files",
        "additional-files",
        "weight-files",
        "load-state",
        "astar.all-distances",
        "astar.landmark-distances",
        "phemlight-path",
        "device.fcd-replay.files",
    )
)
FILE = "FILE"  # type of options that name files
WRITTEN = ("device.toc.file",)  # names a file that SUMO writes, but SUMO states it as a text
# first names of the options that isethdr reads itself, by their other names in SUMO
FIRST_NAMES = {
    "n": "net-file",
    "net": "net-file",
    "r": "route-files",
    "routes": "route-files",
    "a": "additional-files",
    "additional": "additional-files",
    "b": "begin",
    "e": "end",
}
VARIABLE = re.compile(r"\$\{(.+?)\}")  # SUMO replaces it by a variable of the environment
HOME_OF_SUMO = "SUMO_HOME"  # a variable that isethdr sets where SUMO runs
HOME = "~"  # SUMO replaces it at the start of a name by the home folder, also before a letter


class Option(NamedTuple):
    """Option of SUMO."""

    name: str  # first name
    section: str
    type: str  # type of its value as SUMO states it, such as BOOL


@cache
def options() -> dict[str, Option]:
    """Return all options of the installed SUMO, by each of their names.

    Raises
    ------
    ConfigError : SUMO is not installed.
    CatalogError : SUMO ends with an error.
    """
    with tempfile.TemporaryDirectory() as name:
        call("sumo", [f"--save-template={TEMPLATE}"], Path(name))
        top = ET.parse(Path(name) / TEMPLATE).getroot()
    found = {}
    for section in top:
        for node in section:
            option = Option(node.tag, section.tag, node.get("type", ""))
            for one in (node.tag, *node.get("synonymes", "").split()):
                found[one] = option
    return found


def value_of(top: Node, name: str) -> str:
    """Return the value of an option that a configuration states, or an empty text.

    Parameters
    ----------
    top : root element of the configuration.
    name : first name of the option; the configuration may use any other name in `FIRST_NAMES`.
    """
    values = (value for told, value in _told(top) if FIRST_NAMES.get(told, told) == name)
    return next(values, "")


def named_files(top: Node, name: str) -> tuple[Path, ...]:
    """Return the files that an option of a configuration names.

    Parameters
    ----------
    top : root element of the configuration.
    name : first name of the option.
    """
    return tuple(top.file.parent / one for one in _file_names(value_of(top, name)))


def _told(top: Node) -> Iterator[tuple[str, str]]:
    """Yield the name and the value of each option that a configuration states, as SUMO reads them:
    a value is an attribute or a text, and variables of the environment are replaced.
    """
    for node in top.element.iter():
        value = node.get("value", node.get("v")) or (node.text or "").strip()
        # a section has no value; an option with an empty value is as one that is not stated
        if value and not len(node):
            yield node.tag, VARIABLE.sub(lambda found: _variable(found[1]), value)


def _variable(name: str) -> str:
    """Return a variable of the environment in which SUMO runs; empty without such a variable."""
    known = surroundings(tool("sumo")) if name == HOME_OF_SUMO else os.environ
    return known.get(name, "")


def _file_names(value: str) -> list[str]:
    """Return the names of files in the value of an option."""
    names = [name.strip() for name in value.split(",") if name.strip()]
    home = os.path.expanduser(HOME)
    return [home + name.removeprefix(HOME) if name.startswith(HOME) else name for name in names]


def copy_that_reads(path: Path, folder: Path) -> str:
    """Write a copy of a configuration that names no file that SUMO writes, and return its name.

    The copy holds the options that determine the traffic. Names of files are absolute.

    Parameters
    ----------
    path : configuration of SUMO.
    folder : folder for the copy.

    Raises
    ------
    ConfigError : SUMO is not installed.
    CatalogError : the configuration is missing, or is no configuration.
    """
    known = options()
    top = ET.Element("configuration")
    for name, value in _told(opened(path, "configuration", "a configuration of SUMO (.sumocfg)")):
        option = known.get(name)
        if option is None:  # SUMO's own error names it
            ET.SubElement(top, name, value=value)
        elif _reads(option):
            told = _absolute(value, path) if option.type == FILE else value
            ET.SubElement(top, option.name, value=told)
    ET.ElementTree(top).write(folder / COPY_OF_CONFIGURATION, encoding="utf-8")
    return COPY_OF_CONFIGURATION


def _reads(option: Option) -> bool:
    """Return whether an option determines the traffic and names no file that SUMO writes."""
    if option.section not in SECTIONS or option.name in WRITTEN:
        return False
    return option.type != FILE or option.name in READ


def _absolute(value: str, path: Path) -> str:
    """Return the files that a configuration names, as absolute names."""
    # SUMO decodes `%20` in names to a space, so a `%` in the folder's own name is written as `%25`
    folder = path.resolve().parent.as_posix().replace("%", "%25")
    names = _file_names(value)
    return ",".join(name if Path(name).is_absolute() else f"{folder}/{name}" for name in names)

"""A copy of a user's configuration of SUMO that only reads: it names no file that SUMO writes."""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path
from typing import NamedTuple

from ...roads.opendrive.elements import opened
from .program import call

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
    for node in opened(path, "configuration", "a configuration of SUMO (.sumocfg)").element.iter():
        value = node.get("value", node.get("v", (node.text or "").strip() or None))
        if value is None or len(node):
            continue
        option = known.get(node.tag)
        if option is None:  # SUMO's own error names it
            ET.SubElement(top, node.tag, value=value)
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
    # SUMO reads %20 in a name as a space; the folder of the configuration is a plain name
    folder = path.resolve().parent.as_posix().replace("%", "%25")
    names = [name.strip() for name in value.split(",")]
    # SUMO puts variables of the environment into names that begin with ${
    return ",".join(
        name if Path(name).is_absolute() or name.startswith("${") else f"{folder}/{name}"
        for name in names
        if name
    )

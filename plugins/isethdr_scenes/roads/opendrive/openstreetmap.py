"""OpenStreetMap files as OpenDRIVE, by SUMO's netconvert (extra `traffic`)."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

from isethdr_core.errors import CatalogError, ConfigError

from ...traffic.sumo.program import of_wheel, surroundings
from .elements import Node, opened
from .road_file import RoadFile, read

KIND = "an OpenStreetMap file (.osm)"
TOOL = "netconvert"
# keep roads for cars only; no U-turns at dead ends, where lanes do not meet; bridges from layers
OPTIONS = (
    "--no-turnarounds",
    "--geometry.remove",
    "--junctions.join",
    "--keep-edges.by-vclass=passenger",
    "--osm.layer-elevation=5",
    "--sidewalks.guess",
    "--xml-validation=never",
)
# values of the tag highway that are no roads for cars
NO_ROADS = {
    "footway",
    "path",
    "steps",
    "cycleway",
    "bridleway",
    "pedestrian",
    "corridor",
    "platform",
    "proposed",
    "construction",
    "elevator",
    "via_ferrata",
    "raceway",
    "bus_stop",
}
TIMEOUT_S = 3600


def convert(osm: Path, out: Path) -> RoadFile:
    """Write the roads of an OpenStreetMap file as OpenDRIVE, and return the content written.

    Raises
    ------
    ConfigError : netconvert is not installed.
    CatalogError : the file is no OpenStreetMap file, or has no roads; netconvert fails.
    """
    top = opened(osm, "osm", KIND)
    _check_roads(top)
    tool = _tool()
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder) / "roads.xodr"
        command = [str(tool), "--osm-files", str(osm), "--opendrive-output", str(made), *OPTIONS]
        done = subprocess.run(
            command,
            env=surroundings(tool),
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )
        if done.returncode or not made.is_file():
            lines = [x for x in done.stderr.splitlines() if x.startswith("Error")] or ["no output"]
            raise CatalogError(f"{osm}: netconvert ended with {done.returncode}: {lines[0]}")
        _mend(made)
        found = read(made)
        try:
            shutil.copyfile(made, out)
        except OSError as error:
            reason = error.strerror or str(error)
            raise CatalogError(f"{out} cannot be written ({reason}); type another path") from None
    return found


def _check_roads(top: Node) -> None:
    ways = [
        tag.get("v", "")
        for way in top.element.iter("way")
        for tag in way.iter("tag")
        if tag.get("k") == "highway"
    ]
    if not set(ways) - NO_ROADS:
        count = sum(1 for _ in top.element.iter("way"))
        raise CatalogError(
            f"{top.file} holds no roads: of its {count} ways none has a tag highway for cars;"
            " expected an extract of a map with streets"
        )


def _tool() -> Path:
    """Return the path of netconvert: in the folder of this Python, on the search path, or that of
    SUMO's wheel, whose folder may be on the path of Python only.
    """
    found = shutil.which(TOOL, path=str(Path(sys.executable).parent)) or shutil.which(TOOL)
    path = Path(found) if found else of_wheel(TOOL)
    if path is None:
        raise ConfigError(
            "the import of OpenStreetMap needs SUMO's netconvert, which is not installed; type pip"
            " install 'isethdr[traffic]'"
        )
    return path


def _mend(path: Path) -> None:
    """Remove links to missing junctions, which netconvert writes at dead ends."""
    tree = ET.parse(path)
    held = {junction.get("id") for junction in tree.iter("junction")}
    for link in tree.iter("link"):
        for end in list(link):
            if end.get("elementType") == "junction" and end.get("elementId") not in held:
                link.remove(end)
    tree.write(path, encoding="utf-8", xml_declaration=True)

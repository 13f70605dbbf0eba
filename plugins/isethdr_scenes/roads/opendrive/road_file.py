"""Road files: read a network of roads from an OpenDRIVE file, and write it into one.

file = read(Path("town.xodr"))
file.network.lanes()
file.notes          # contents of the file that are changed or left out
write(RoadFile(kind("village", 3).network), Path("village.xodr"))
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError, did_you_mean

from ...materials import MATERIALS
from ..ground_height import Land
from ..network import Network
from ..road import Road, RoadType
from .elements import Node, child, opened
from .gaps import GAP_M, check_lanes, check_line
from .heights import (
    as_crossfall,
    read_crossfall,
    read_profile,
    read_shape,
    read_tilt,
    write_heights,
)
from .lanes import read_sections, write_lanes
from .links import (
    check_junctions,
    check_links,
    read_junction,
    read_link,
    write_junction,
    write_link,
)
from .objects import read_objects, read_structures, write_objects
from .plan_view import read_line, write_line
from .words import KMH, ROAD_TYPES, SPEED_LIMITS_KMH, SURFACES, URBAN

KIND = "an OpenDRIVE file (.xodr)"
OWN = "isethdr."  # prefix of the userData codes of properties that OpenDRIVE lacks
REVISION = (1, 7)
HIGHEST_M = 1e4  # greatest relief, and greatest depth of a ditch
# land of files that state none: in the country and in a town
LAND = Land(relief_m=0.8, ditch_m=0.0)
TOWN_LAND = Land(relief_m=0.0, ditch_m=0.0, material="concrete")


@dataclass(frozen=True)
class RoadFile:
    """Content of a road file."""

    network: Network
    name: str = ""
    geo_reference: str = ""  # text of the map projection, kept as it is
    own: Mapping[str, str] = field(default_factory=dict)  # entries of isethdr in the header
    notes: tuple[str, ...] = ()


def read(path: Path) -> RoadFile:
    """Return the content of an OpenDRIVE file, 1.4 to 1.8.

    Raises
    ------
    CatalogError : the file is missing or not well formed; it has a gap, a link to a missing road or
        junction, an unknown type of lane, or a negative width. The message names the file and the
        road.
    """
    top = opened(path, "OpenDRIVE", KIND)
    for node in top.all("include"):
        raise node.error(f"it includes {node.text('file', '?')}; expected one file with all roads")
    nodes: dict[str, Node] = {}
    for node in top.all("road"):
        name = node.text("id")
        if name in nodes:
            raise node.error(f"two roads have the id {name}; expected ids that differ")
        nodes[name] = node.named(f"road {name}")
    if not nodes:
        raise top.error("it holds no roads; expected one or more")
    roads = {name: (_road(node, name), node) for name, node in nodes.items()}
    junctions = {node.text("id"): (read_junction(node), node) for node in top.all("junction")}
    named = {key: node.named(f"junction {key}") for key, (_, node) in junctions.items()}
    check_links(roads, named)
    check_junctions({k: (j, named[k]) for k, (j, _) in junctions.items()}, roads)
    own = {
        node.text("code").removeprefix(OWN): node.text("value", "")
        for node in top.all("header/userData")
        if node.text("code", "").startswith(OWN)
    }
    made = tuple(road for road, _ in roads.values())
    network = Network(made, tuple(j for j, _ in junctions.values()), _land(top, own, made))
    check_lanes(network, nodes)
    header = top.first("header")
    reference = header.element.findtext("geoReference") if header else None
    title = header.text("name", "") if header else ""
    offset = header.first("offset") if header else None
    if offset is not None and offset.number("hdg", 0.0):  # its x, y and z change no picture
        offset.note("the turn of the header's <offset> is left out; azimuths are those of the file")
    return RoadFile(network, title, (reference or "").strip(), own, top.notes.lines)


def _road(node: Node, name: str) -> Road:
    line = read_line(node)
    length = line.length_m
    if abs(node.number("length", length) - length) > GAP_M:
        node.note("a road of another length than its <planView> has that of its <planView>")
    if node.first("surface/CRG") is not None:
        node.note("a road surface from a CRG file is left out")
    road_type, limit = _type(node)
    shape = read_shape(node)
    crossfall = read_crossfall(node)
    straight = as_crossfall(shape) if shape is not None else None
    if straight is not None:
        shape = None
        crossfall = straight
    junction = node.text("junction", "-1")
    road = Road(
        name,
        line,
        read_sections(node, length),
        road_type,
        limit,
        read_profile(node.all("elevationProfile/elevation")),
        read_tilt(node),
        crossfall,
        shape,
        read_profile(node.all("lanes/laneOffset")),
        "" if junction == "-1" else junction,
        read_link(node, "predecessor"),
        read_link(node, "successor"),
        read_structures(node, length),
        read_objects(node, length),
        node.text("rule", "RHT") != "LHT",
        _surface(node),
    )
    check_line(road, node)
    return road


def _type(node: Node) -> tuple[RoadType, float]:
    """Return the type of a road and its speed limit in km/h: those of its longest stretch."""
    chosen = _longest_type(node)
    word = chosen.text("type", "unknown") if chosen else "unknown"
    if word not in ROAD_TYPES and word != "unknown":
        node.note(f"the road type {word!r} is taken as 'rural'")
    road_type = ROAD_TYPES.get(word, "rural")
    speed = (chosen.first("speed") if chosen else None) or _fastest(node)
    if speed is None or speed.text("max", "undefined") in ("no limit", "undefined"):
        return road_type, SPEED_LIMITS_KMH[road_type]
    unit = speed.text("unit", "m/s")
    if unit not in KMH:
        raise node.error(f"the unit of its speed is {unit!r}; expected one of {', '.join(KMH)}")
    limit = speed.number("max") * KMH[unit]
    return road_type, limit if limit > 0 else SPEED_LIMITS_KMH[road_type]


def _longest_type(node: Node) -> Node | None:
    """Return the record of the type of a road that holds for the longest stretch."""
    told = sorted(node.all("type"), key=lambda n: n.number("s", 0.0))
    if not told:
        return None
    ends = [*(n.number("s", 0.0) for n in told[1:]), node.number("length", 0.0)]
    longest = int(np.argmax([end - n.number("s", 0.0) for n, end in zip(told, ends)]))
    if len({n.text("type", "") for n in told}) > 1:
        node.note("a road of several types has that of its longest stretch")
    return told[longest]


def _fastest(node: Node) -> Node | None:
    """Return the highest limit that a driving lane of the first section states."""
    section = node.first("lanes/laneSection")
    lanes = section.all("*/lane") if section else ()
    limits = [
        speed for lane in lanes if lane.text("type", "") == "driving" for speed in lane.all("speed")
    ]
    known = [x for x in limits if x.text("max", "undefined") not in ("no limit", "undefined")]
    return max(known, key=lambda x: x.number("max"), default=None)


def _surface(node: Node) -> str:
    """Return the surface of a road: that of its first lane which states one."""
    for material in node.all("lanes/laneSection/*/lane/material"):
        told = material.text("surface", "")
        if told in SURFACES:
            return told
    return "asphalt"


def _land(top: Node, own: Mapping[str, str], roads: tuple[Road, ...]) -> Land:
    """Return the land around the roads: that of the file, or else that of a town or the country."""
    if "land" not in own:
        town = np.mean([road.type in URBAN for road in roads]) > 0.5
        return TOWN_LAND if town else LAND
    try:
        relief, ditch, number, material = own["land"].split()
        heights = float(relief), float(ditch)
        seed = int(number)
    except ValueError:
        seed = -1
    if seed < 0 or not all(0 <= height <= HIGHEST_M for height in heights):
        raise top.error(
            f"the value of the userData isethdr.land is {own['land']!r}; expected relief and depth"
            " of the ditch in m, a whole number and a material, for example '1.0 0.5 3 meadow';"
            " correct it, or remove the element"
        )
    if material not in MATERIALS:
        raise top.error(
            f"the userData isethdr.land names the material {material!r}; expected one for the"
            f" land{did_you_mean(material, MATERIALS)}"
        )
    return Land(*heights, seed, material)


def numbered(network: Network) -> dict[tuple[str, str], int]:
    """Return the ids in a file by ("road" or "junction", name)."""
    ids = {("road", road.name): k for k, road in enumerate(network.roads, 1)}
    first = len(network.roads) + 1
    return ids | {("junction", item.name): k for k, item in enumerate(network.junctions, first)}


def write(file: RoadFile, path: Path) -> None:
    """Write a network as OpenDRIVE 1.7. The ids of roads and junctions are numbers; the names stay.

    Raises
    ------
    CatalogError : the file cannot be written.
    """
    network = file.network
    ids = numbered(network)
    top = ET.Element("OpenDRIVE")
    _write_header(top, file)
    for road in network.roads:
        _write_road(top, road, ids)
    for junction in network.junctions:
        write_junction(top, junction, ids)
    ET.indent(top)
    try:
        ET.ElementTree(top).write(path, encoding="utf-8", xml_declaration=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise CatalogError(f"{path} cannot be written ({reason}); type another path") from None


def _write_header(top: ET.Element, file: RoadFile) -> None:
    corners = np.concatenate(
        [r.line.points(np.linspace(0, r.length_m)) for r in file.network.roads]
    )
    west, south = corners.min(0)
    east, north = corners.max(0)
    header = child(
        top,
        "header",
        revMajor=REVISION[0],
        revMinor=REVISION[1],
        name=file.name,
        version="1",
        north=float(north),
        south=float(south),
        east=float(east),
        west=float(west),
        vendor="isethdr",
    )
    if file.geo_reference:
        child(header, "geoReference").text = file.geo_reference
    land = file.network.land
    told = {
        **file.own,
        "land": f"{land.relief_m!r} {land.ditch_m!r} {land.seed} {land.material}",
    }
    for code, value in told.items():
        child(header, "userData", code=OWN + code, value=value)


def _write_road(top: ET.Element, road: Road, ids: Mapping[tuple[str, str], int]) -> None:
    node = child(
        top,
        "road",
        name=road.name,
        length=float(road.length_m),
        id=ids["road", road.name],
        junction=ids["junction", road.junction] if road.junction else -1,
        rule="RHT" if road.right_hand else "LHT",
    )
    write_link(node, road, ids)
    told = child(node, "type", s=0.0, type=road.type)
    child(told, "speed", max=float(road.speed_limit_kmh), unit="km/h")
    write_line(node, road.line)
    write_heights(node, road)
    write_lanes(node, road)
    write_objects(node, road)

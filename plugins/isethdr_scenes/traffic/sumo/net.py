"""A network of roads as SUMO's net, made by netconvert; coordinates stay unchanged."""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...roads.lane_path import LaneKey
from ...roads.network import Network
from ...roads.opendrive.road_file import RoadFile, numbered, write
from ...roads.profile import Floats
from ...roads.road import Lane, Road
from .program import call, version

SIMULATED = ("driving", "biking")  # types of the lanes on which SUMO simulates traffic
USERS = frozenset({"passenger", "bicycle"})  # one class of each of these types
# SUMO's rules for types of lanes: motor vehicles use driving lanes, bicycles use cycle lanes. No
# vehicle may use other lanes; if these were left out, the lanes on both sides would move together
TYPES = """<types>
<type id="driving" priority="1" speed="13.89" width="3.65"
 allow="passenger truck trailer bus coach delivery taxi motorcycle moped emergency"/>
<type id="biking" priority="-1" speed="5.56" width="1.50" allow="bicycle"/>
<type id="none" priority="0" speed="1.39" width="1.0" disallow="all"/>
</types>"""
TYPES_FILE = "types.typ.xml"
OPTIONS = (
    "--offset.disable-normalization",
    "--opendrive.internal-shapes",
    "--opendrive.curve-resolution=1",
    "--opendrive.min-width=0.3",
    "--opendrive.position-ids",
    "--output.original-names",
    "--no-turnarounds",
    "--xml-validation=never",
)
XODR = "roads.xodr"
NET = "roads.net.xml"


class SumoLane(NamedTuple):
    """A lane of an edge."""

    index: int  # number of the lane from the right
    original: str  # road and lane of the OpenDRIVE file, for example "3_-1"
    length_m: float  # length in SUMO
    width_m: float
    speed_m_s: float  # speed limit
    shape_m: Floats  # (n, 2) plan points of its middle
    ways: tuple[str, ...]  # edges into which it leads
    # whether no vehicle may use it: the road has it elsewhere only, or it is no lane for driving
    closed: bool = False


@dataclass(frozen=True, eq=False)
class SumoEdge:
    """Lanes of one direction between two junctions."""

    name: str
    lanes: tuple[SumoLane, ...]

    @property
    def ways(self) -> tuple[str, ...]:
        """Return the edges into which the lanes lead, each once."""
        return tuple(dict.fromkeys(way for lane in self.lanes for way in lane.ways))


@dataclass(frozen=True, eq=False)
class SumoNet:
    """A net of SUMO, with its edges outside of junctions for the demand."""

    content: bytes
    edges: dict[str, SumoEdge]
    offset_m: Floats  # (2,) offset from the coordinates of the roads to those of SUMO


def net_of(network: Network, junctions: tuple[str, ...] = ()) -> SumoNet:
    """Return the net of driving and cycle lanes of a network. The same network is converted once.

    Parameters
    ----------
    network : network of roads.
    junctions : names of the junctions with traffic lights.

    Raises
    ------
    ConfigError : netconvert is not installed.
    CatalogError : netconvert fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / XODR
        write(RoadFile(_simulated(network)), path)
        _state_limits(path)
        numbers = numbered(network)
        lit = ",".join(str(numbers["junction", name]) for name in junctions)
        return _converted(path.read_bytes(), lit, version())


def _state_limits(path: Path) -> None:
    """Give each driving lane the limit of its road, since netconvert reads limits of lanes only."""
    tree = ET.parse(path)
    for road in tree.iter("road"):
        told = road.find("type/speed")
        limit = "50" if told is None else told.get("max", "50")
        for lane in road.iter("lane"):
            if lane.get("type") == "driving":
                ET.SubElement(lane, "speed", sOffset="0", max=limit, unit="km/h")
    tree.write(path)


@lru_cache(maxsize=8)
def _converted(xodr: bytes, lit: str, _version: str) -> SumoNet:
    """Return the net of an OpenDRIVE file's content, with traffic lights at junctions `lit`."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / XODR).write_bytes(xodr)
        (folder / TYPES_FILE).write_text(TYPES)
        files = [f"--opendrive-files={XODR}", f"--output-file={NET}", f"--type-files={TYPES_FILE}"]
        lights = [f"--tls.set={lit}"] if lit else []
        call("netconvert", [*files, *lights, *OPTIONS], folder)
        return read((folder / NET).read_bytes())


def read(content: bytes) -> SumoNet:
    """Return the net of a file's content."""
    top = ET.fromstring(content)
    ways: dict[tuple[str, int], list[str]] = {}
    for node in top.iter("connection"):
        if not node.get("from", "").startswith(":"):
            key = (node.get("from", ""), int(node.get("fromLane", "0")))
            ways.setdefault(key, []).append(node.get("to", ""))
    edges = {}
    for node in top.iter("edge"):
        if node.get("function", "normal") in ("normal", "connector"):
            name = node.get("id", "")
            edges[name] = SumoEdge(name, tuple(_lanes(node, ways)))
    place = top.find("location")
    offset = "0,0" if place is None else place.get("netOffset", "0,0")
    return SumoNet(content, edges, np.array([float(v) for v in offset.split(",")]))


def _lanes(edge: ET.Element, ways: dict[tuple[str, int], list[str]]) -> Iterable[SumoLane]:
    for node in edge.iter("lane"):
        index = int(node.get("index", "0"))
        told = {p.get("key"): p.get("value", "") for p in node.iter("param")}
        shape = [point.split(",")[:2] for point in node.get("shape", "").split()]
        yield SumoLane(
            index,
            told.get("origId", ""),
            float(node.get("length", "0")),
            float(node.get("width", "3.2")),
            float(node.get("speed", "13.89")),
            np.array(shape, float),
            tuple(ways.get((edge.get("id", ""), index), ())),
            _closed(node),
        )


def _closed(lane: ET.Element) -> bool:
    """Return whether no vehicle of the traffic may use a lane.

    netconvert leaves lanes that are too narrow, such as the start of a turn lane, to emergency
    vehicles and authorities.
    """
    if lane.get("disallow") == "all":
        return True
    allowed = lane.get("allow", "").split()
    return bool(allowed) and not USERS.intersection(allowed)


class SumoLink(NamedTuple):
    """A connection through a junction that a traffic light controls."""

    light: str
    index: int  # index in the states of the light
    edge: str  # edge from which it comes
    turn: str  # direction in SUMO's letters: s, l, r, ...


def links_of(net: SumoNet) -> list[SumoLink]:
    """Return the connections that traffic lights control."""
    return [
        SumoLink(node.get("tl", ""), int(node.get("linkIndex", "0")), node.get("from", ""), way)
        for node in ET.fromstring(net.content).iter("connection")
        if node.get("tl") and (way := node.get("dir", "s"))
    ]


def lane_types(net: SumoNet, network: Network) -> dict[tuple[str, int], str]:
    """Return the type of each lane of a net by edge and index; `net_of` made it from `network`."""
    names = {number: name for (kind, name), number in numbered(network).items() if kind == "road"}
    found = {}
    for edge in net.edges.values():
        for lane in edge.lanes:
            road_id, _, number = lane.original.split()[0].rpartition("_")
            road = network.road(names[int(road_id)])
            kinds = [x.type for s in road.sections for x in s.lanes if x.number == int(number)]
            # a lane may be closed on a part of its road only, as next to a ramp or at road works
            if lane.closed:
                kinds = [x for x in kinds if x not in SIMULATED] or ["none"]
            found[edge.name, lane.index] = "driving" if "driving" in kinds else kinds[0]
    return found


def edge_of(net: SumoNet, network: Network, key: LaneKey) -> tuple[SumoEdge, SumoLane] | None:
    """Return the edge and the lane of a net for a lane of the network outside of junctions.

    Parameters
    ----------
    net : net of SUMO, made from the network.
    network : network of roads.
    key : key of the lane.
    """
    number = numbered(network)["road", key.road]
    middle = network.lane(key).points(network.lane(key).length_m / 2)[:2]
    found = [
        (edge, lane)
        for edge in net.edges.values()
        for lane in edge.lanes
        if f"{number}_{key.number}" in lane.original.split()
    ]
    # a road with several sections has several edges for one lane
    away = lambda pair: np.linalg.norm(_beside(pair[1].shape_m, middle)[1])
    return min(found, key=away, default=None)


def along(lane: SumoLane, point_m: Floats) -> float:
    """Return the distance of a plan point (2,) along a lane, in SUMO's metres."""
    at, _ = _beside(lane.shape_m, point_m)
    steps = np.linalg.norm(np.diff(lane.shape_m, axis=0), axis=1)
    return at * lane.length_m / float(steps.sum())


def _beside(shape: Floats, point: Floats) -> tuple[float, Floats]:
    """Return metres along a polyline to the place nearest to a point, and the vector from there to
    the point.
    """
    way = np.diff(shape, axis=0)
    length = np.linalg.norm(way, axis=1)
    part = np.einsum("ij,ij->i", point - shape[:-1], way) / np.maximum(length, 1e-9) ** 2
    part = part.clip(0.0, 1.0)
    off = point - (shape[:-1] + part[:, None] * way)
    k = int(np.argmin(np.linalg.norm(off, axis=1)))
    return float(length[:k].sum() + part[k] * length[k]), off[k]


def _simulated(network: Network) -> Network:
    """Return the network with the type `none` for lanes on which SUMO must not drive."""
    return replace(network, roads=tuple(map(_without, network.roads)))


def _without(road: Road) -> Road:
    change = lambda lanes: tuple(map(_hidden, lanes))
    sections = tuple(replace(s, left=change(s.left), right=change(s.right)) for s in road.sections)
    return replace(road, sections=sections, objects=())


def _hidden(lane: Lane) -> Lane:
    return lane if lane.type in SIMULATED else replace(lane, type="none")

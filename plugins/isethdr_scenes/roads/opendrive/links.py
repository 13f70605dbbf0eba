"""Links between roads and junctions as elements, in both directions."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

from ..network import Connection, Junction
from ..road import End, Link, Road
from .elements import Node, child


def read_link(road: Node, name: str) -> Link | None:
    """Return the neighbour of a road at its `predecessor` or `successor` end; None without one, and
    for a link to the side of a road, which is noted.

    Raises
    ------
    CatalogError : the type of element or the contact point is unknown.
    """
    node = road.first(f"link/{name}")
    if node is None:
        return None
    kind = node.text("elementType", "road")
    if kind == "junction":
        return Link("junction", node.text("elementId"))
    if kind != "road":
        raise road.error(f"its {name} is a {kind!r}; expected road or junction")
    if not node.text("contactPoint", "") and node.text("elementS", ""):
        road.note("links to the side of a road (virtual junctions) are left out")
        return None
    return Link("road", node.text("elementId"), _end(node, road, name))


def _end(node: Node, road: Node, name: str) -> End:
    told = node.text("contactPoint", "")
    if told == "start":
        return "start"
    if told == "end":
        return "end"
    raise road.error(f"the contactPoint of its {name} is {told!r}; expected start or end")


def read_junction(node: Node) -> Junction:
    """Return a junction and the paths through it."""
    node = node.named(f"junction {node.text('id')}")
    connections = []
    for told in node.all("connection"):
        incoming = told.text("incomingRoad", "")
        # a direct junction leads onto a road itself, without a connecting road
        connecting = told.text("connectingRoad", told.text("linkedRoad", ""))
        if not incoming or not connecting:
            node.note("connections without an incoming and a connecting road are left out")
            continue
        lanes = tuple((lane.integer("from"), lane.integer("to")) for lane in told.all("laneLink"))
        contact = told.text("contactPoint", "start")
        if contact not in ("start", "end"):
            raise node.error(f"a contactPoint is {contact!r}; expected start or end")
        connections.append(Connection(incoming, connecting, contact, lanes))
    return Junction(node.text("id"), tuple(connections))


def check_links(roads: Mapping[str, tuple[Road, Node]], junctions: Mapping[str, Node]) -> None:
    """Raise CatalogError where a link names a road or a junction that the file lacks."""
    for road, node in roads.values():
        for end, link in (("predecessor", road.predecessor), ("successor", road.successor)):
            if link is None:
                continue
            known = roads if link.kind == "road" else junctions
            if link.name not in known:
                raise node.error(
                    f"its {end} is {link.kind} {link.name}, which the file does not hold; expected"
                    f" one of its {len(known)} {link.kind}s"
                )
        if road.junction and road.junction not in junctions:
            raise node.error(
                f"it belongs to junction {road.junction}, which the file does not hold; expected"
                f" one of its {len(junctions)} junctions"
            )


def check_junctions(
    junctions: Mapping[str, tuple[Junction, Node]], roads: Mapping[str, object]
) -> None:
    """Raise CatalogError where a connection names a road that the file lacks."""
    for junction, node in junctions.values():
        for connection in junction.connections:
            for name in (connection.incoming, connection.connecting):
                if name not in roads:
                    raise node.error(
                        f"a connection names road {name}, which the file does not hold; expected"
                        f" one of its {len(roads)} roads"
                    )


def write_link(node: ET.Element, road: Road, ids: Mapping[tuple[str, str], int]) -> None:
    """Add the links of a road to its element.

    Parameters
    ----------
    node : element of the road.
    road : road with predecessor and successor.
    ids : number of each road and junction by its kind (road, junction) and its name.
    """
    links = child(node, "link")
    for name, link in (("predecessor", road.predecessor), ("successor", road.successor)):
        if link is not None:
            child(
                links,
                name,
                elementType=link.kind,
                elementId=ids[link.kind, link.name],
                contactPoint=link.end,
            )


def write_junction(top: ET.Element, junction: Junction, ids: Mapping[tuple[str, str], int]) -> None:
    """Add a junction to the root element.

    Parameters
    ----------
    top : root element of the file.
    junction : junction to add.
    ids : number of each road and junction by its kind (road, junction) and its name.
    """
    node = child(top, "junction", id=ids["junction", junction.name], name=junction.name)
    for k, connection in enumerate(junction.connections):
        told = child(
            node,
            "connection",
            id=k,
            incomingRoad=ids["road", connection.incoming],
            connectingRoad=ids["road", connection.connecting],
            contactPoint=connection.contact,
        )
        for first, last in connection.lanes:
            child(told, "laneLink", **{"from": first, "to": last})

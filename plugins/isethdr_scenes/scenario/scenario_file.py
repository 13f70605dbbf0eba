"""Scenario files: the road file, the entities, and their positions at the start."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ..roads.opendrive.elements import Node, opened
from .catalogs import KIND, entry, path_in
from .parameters import declared, put_values

KINDS: dict[str, Literal["vehicle", "pedestrian"]] = {
    "Vehicle": "vehicle",
    "Pedestrian": "pedestrian",
}
EGO = ("ego", "hero", "egovehicle")  # names of the camera's vehicle, in lower case
STORY = "what happens after the start (stories, speeds, routes, events) is left out"


@dataclass(frozen=True, eq=False)
class Entity:
    """One entity at the start of a scenario: a vehicle, a pedestrian or an object."""

    name: str
    kind: Literal["vehicle", "pedestrian", "other"]
    category: str  # category of OpenSCENARIO: car, truck, bicycle, ...
    size_m: tuple[float, float, float] | None  # length, width, height
    centre_m: tuple[float, float]  # centre of its box, ahead and left of its reference point
    position: Node  # element of its position


@dataclass(frozen=True, eq=False)
class Scenario:
    """The start of a scenario."""

    path: Path
    road_file: Path
    ego: Entity
    others: tuple[Entity, ...]
    notes: tuple[str, ...]
    files: tuple[Path, ...]  # all files that were read, the road file included


def read(path: Path, ego: str = "") -> Scenario:
    """Return the start of a scenario.

    Parameters
    ----------
    path : scenario file (.xosc).
    ego : name of the entity that carries the camera; empty: `Ego` or `Hero`, else the first
        vehicle.

    Raises
    ------
    CatalogError : the file is missing or no scenario; it names no road file; the entity with the
        camera has no position.
    """
    top = opened(path, "OpenSCENARIO", KIND).named("scenario")
    put_values(top.element, declared(top.element, {}))
    logic = top.first("RoadNetwork/LogicFile")
    if logic is None:
        raise top.error("it names no road file; expected <RoadNetwork> with <LogicFile>")
    road_file = path_in(path, logic.text("filepath"))
    positions = _positions(top)
    files = [path, road_file]
    found = []
    for node in top.all("Entities/ScenarioObject"):
        made = _entity(top, node, positions, files)
        if made is not None:
            found.append(made)
    chosen = _ego(top, found, ego)
    if any(True for _ in top.all("Storyboard/Story")):
        top.notes.add(STORY, path.name)
    others = tuple(one for one in found if one is not chosen)
    return Scenario(path, road_file, chosen, others, top.notes.lines, tuple(dict.fromkeys(files)))


def _positions(top: Node) -> dict[str, Node]:
    """Return the element of the initial position by the entity's name."""
    found = {}
    for private in top.all("Storyboard/Init/Actions/Private"):
        name = private.text("entityRef")
        node = private.first("PrivateAction/TeleportAction/Position/*")
        if node is None:
            continue
        found[name] = node.named(f"start of {name}")
    return found


def _entity(top: Node, node: Node, positions: dict[str, Node], files: list[Path]) -> Entity | None:
    name = node.text("name")
    if name not in positions:
        top.notes.add("entities without a TeleportAction at the start are left out", name)
        return None
    held: Node | None = next((found for found in node.all("*") if _is_entity(found)), None)
    if held is not None and held.element.tag == "CatalogReference":
        held = entry(top, held)
        if held is not None:
            files.append(held.file)
    if held is None:
        return Entity(name, "other", "", None, (0.0, 0.0), positions[name])
    kind = KINDS.get(held.element.tag, "other")
    category = held.text(f"{kind}Category", "") if kind != "other" else held.element.tag
    box = held.first("BoundingBox/Dimensions")
    centre = held.first("BoundingBox/Center")
    size = tuple(box.number(n) for n in ("length", "width", "height")) if box else None
    x, y = centre.numbers("x", "y") if centre else (0.0, 0.0)
    return Entity(name, kind, category, size, (x, y), positions[name])  # type: ignore[arg-type]


def _is_entity(node: Node) -> bool:
    return node.element.tag in ("Vehicle", "Pedestrian", "MiscObject", "CatalogReference")


def _ego(top: Node, found: list[Entity], ego: str) -> Entity:
    names = [one.name for one in found]
    if ego:
        for one in found:
            if one.name == ego:
                return one
        known = ", ".join(names) or "none"
        raise top.error(
            f"it places no entity {ego!r} at the start; expected one of {known}; type for example"
            f" scene.scenario_ego={names[0] if names else 'Ego'}"
        )
    for one in found:
        if one.name.lower() in EGO:
            return one
    for kind in ("vehicle", "other"):  # "other": an entry that no catalog holds may be a vehicle
        for one in found:
            if one.kind == kind and one.category != "MiscObject":
                return one
    raise top.error("it places no vehicle for the camera; expected a TeleportAction for one")

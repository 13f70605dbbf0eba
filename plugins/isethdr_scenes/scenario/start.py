"""Start: road, camera and entities of a street from a scenario file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..placing.site import Site
from ..roads.opendrive.elements import Notes
from ..roads.opendrive.file_road import Choices, FileRoad, Start, content, file_road
from .entities import Placed, beyond, placed, put
from .positions import lane_below, on_lane, spot
from .scenario_file import Entity, read


@dataclass(frozen=True, eq=False)
class ScenarioStart:
    """A road with the camera on it, and the entities around the camera."""

    road: FileRoad
    entities: tuple[Placed, ...]
    notes: tuple[str, ...]
    files: tuple[Path, ...]

    def put(self, site: Site) -> None:
        """Place the entities on a site.

        Raises
        ------
        ConfigError : an entity overlaps another one, or the camera's car.
        """
        put(site, self.entities, self.road.shift_m)


def scenario_start(path: Path, ego: str, seed: int, choices: Choices) -> ScenarioStart:
    """Return the start of a scenario.

    Parameters
    ----------
    path : scenario file (.xosc).
    ego : name of the entity that carries the camera; empty: as `scenario_file.read` finds it.
    seed : seed of everything that the files do not state.
    choices : light, type and speed limit of the road.

    Raises
    ------
    CatalogError : a file cannot be read; a position is not on the roads of the road file.
    """
    scenario = read(path, ego)
    network = content(scenario.road_file).network
    road = file_road(scenario.road_file, seed, choices, _camera(scenario.ego, scenario.road_file))
    notes = Notes()
    entities = placed(scenario.others, network, notes)
    middle = road.base.pose()[:2, 3] - road.shift_m
    for name in beyond(entities, middle):
        notes.add("entities too far from the camera are left out", name)
    told = (*scenario.notes, *notes.lines)
    return ScenarioStart(road, entities, told, scenario.files)


def _camera(ego: Entity, road_file: Path) -> Start:
    """Return the place of the camera's car: the middle of the entity's bounding box."""
    network = content(road_file).network
    place = spot(ego.position, network)
    if place is None:
        raise ego.position.error(
            f"it is a {ego.position.element.tag}; expected a LanePosition, RoadPosition or"
            " WorldPosition for the camera's vehicle"
        )
    place = place.ahead(*ego.centre_m)
    lane = lane_below(place, network)
    if lane is None:
        raise ego.position.error(
            f"it is at ({place.x_m:.1f}, {place.y_m:.1f}) m, where no road of {road_file} is;"
            " expected a place on a road for the camera's vehicle"
        )
    return Start(lane, *on_lane(place, lane))

"""Things of a street for the entities of a scenario: same category, most similar size."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple
from zlib import crc32

import numpy as np

from isethdr_core.errors import ConfigError

from ..placement import DRIVING
from ..placing.site import REACH_M, Foot, Site
from ..placing.vehicles import rider_foot
from ..roads.network import Network
from ..roads.opendrive.elements import Notes
from ..roads.profile import Floats
from ..things.registry import RIDDEN
from ..things.thing import Thing
from .positions import Spot, spot
from .scenario_file import Entity

# groups of things by the category of OpenSCENARIO; entities of other categories are left out
GROUPS = {
    "car": "car",
    "van": "car",
    "truck": "truck",
    "semitrailer": "truck",
    "trailer": "truck",
    "bus": "bus",
    "motorbike": "motorcycle",
    "bicycle": "bicycle",
    "pedestrian": "person",
    "wheelchair": "person",
    "animal": "animal",
}
DRAWS = 24  # number of things drawn from a group; the one nearest in size is taken


class Placed(NamedTuple):
    """An entity and its place."""

    name: str
    group: str
    size_m: tuple[float, float, float] | None
    place: Spot  # place of the middle of its bounding box


def placed(entities: Sequence[Entity], network: Network, notes: Notes) -> tuple[Placed, ...]:
    """Return the entities that can be placed; the others are noted.

    Parameters
    ----------
    entities : entities of the scenario.
    network : roads to which their positions refer.
    notes : collects the entities that are left out.

    Raises
    ------
    CatalogError : a position names a road or a lane that does not exist.
    """
    found = []
    for entity in entities:
        group = GROUPS.get(entity.category)
        if group is None:
            what = entity.category or "an unknown catalog entry"
            notes.add(f"entities of category {what} are left out", entity.name)
            continue
        place = spot(entity.position, network)
        if place is None:
            notes.add(f"entities at a {entity.position.element.tag} are left out", entity.name)
            continue
        found.append(Placed(entity.name, group, entity.size_m, place.ahead(*entity.centre_m)))
    return tuple(found)


def put(site: Site, entities: Sequence[Placed], shift_m: Floats) -> None:
    """Place the entities within reach on a site.

    Parameters
    ----------
    site : road that is being filled.
    entities : entities with places in the coordinates of the road file.
    shift_m : (2,) shift from these coordinates to those of the site, m.

    Raises
    ------
    ConfigError : an entity overlaps another one, or the camera's car.
    """
    for entity in entities:
        place = entity.place
        point = np.array([place.x_m, place.y_m]) + shift_m
        if not site.near(point):
            continue
        rng = np.random.default_rng([site.seed, crc32(entity.name.encode())])
        foot = _foot(site, entity, point, _thing(site, entity, rng))
        if foot.thing.group in RIDDEN:
            done = site.put_pair(foot, rider_foot(foot, rng), 0.0)
        else:
            done = site.put(foot, 0.0)
        if not done:
            raise ConfigError(
                f"{entity.name!r} of the scenario stands at ({place.x_m:.1f}, {place.y_m:.1f}) m,"
                f" where another entity or the camera's car ({foot.thing.size_m[0]:.1f} m long"
                " itself) stands; expected entities that do not overlap"
            )


def beyond(entities: Sequence[Placed], middle_m: Floats) -> list[str]:
    """Return the names of entities that are too far from the camera to be built."""
    away = [np.hypot(e.place.x_m - middle_m[0], e.place.y_m - middle_m[1]) for e in entities]
    return [e.name for e, distance in zip(entities, away) if distance >= REACH_M]


def _thing(site: Site, entity: Placed, rng: np.random.Generator) -> Thing:
    """Return a drawn thing of the entity's group; of `DRAWS` draws the one nearest in size."""
    if entity.size_m is None:
        return site.stock.draw(entity.group, rng)
    size = np.array(entity.size_m)
    drawn = [site.stock.draw(entity.group, rng) for _ in range(DRAWS)]
    off = [np.abs(np.array(thing.size_m) - size).max() for thing in drawn]
    return drawn[int(np.argmin(off))]


def _foot(site: Site, entity: Placed, point: Floats, thing: Thing) -> Foot:
    lamps = DRIVING
    if entity.group in ("person", "animal"):
        lamps = ()
    elif entity.group == "bicycle":
        lamps = ("bike_front", "bike_tail")
    road, level = _deck(site, entity.place, point)
    walks = entity.group in ("person", "animal")
    return Foot(
        entity.name,
        thing,
        float(point[0]),
        float(point[1]),
        entity.place.heading_rad,
        "scenario",
        lamps,
        lean="upright" if walks else "surface",
        road=road,
        level=level,
    )


def _deck(site: Site, place: Spot, point: Floats) -> tuple[str, int]:
    """Return the road that carries a place, "" if it is not known, and 1 on a bridge, else 0.

    A place in the world stands on a bridge if it states a height that is nearer to the bridge than
    to the ground.

    Parameters
    ----------
    site : road that is being filled.
    place : place in the coordinates of the road file.
    point : (2,) plan point of the place in the coordinates of the site, m.
    """
    network = site.base.network
    for road in network.roads:
        if place.road not in ("", road.name):
            continue
        s, t, beyond = (float(v[0]) for v in road.line.beside(point[None]))
        above = bool(road.on_structure("bridge", s))
        if place.road:
            return road.name, int(above)
        right, left = (float(v) for v in road.edges(s))
        if place.z_m is None or not above or beyond > 0.0 or not right <= t <= left:
            continue
        ground = float(network.height(*point))
        if abs(float(road.height(s, t)) - place.z_m) < abs(ground - place.z_m):
            return road.name, 1
    return "", 0

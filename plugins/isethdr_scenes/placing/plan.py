"""Plan: place all things of a road in a fixed order, and put them on the ground."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..roads.kinds import BaseRoad
from ..things.stock import BUNDLED, Stock
from .barriers import place_barriers
from .boxes import Solid, rows
from .buildings import place_buildings
from .ground import poses
from .living import CROSSING_SHARE, place_animals, place_people, place_riders
from .parked import place_parked
from .pavement_things import place_pavement_things
from .plants import place_plants, place_tufts
from .road_signs import place_signs
from .shortage import Shortage
from .site import Foot, Site
from .street_lights import Signals, place_signals, place_street_lamps, signals
from .vehicles import EGO_M, place_vehicles

FREE_M = 6.0  # length of the area in front of the camera that stays free
FREE_WIDTH_M = 1.2  # width of this area
EGO_HEIGHT_M = 2.0
EGO_MARGIN_M = 0.5  # width of the free space around the camera's car


@dataclass(frozen=True)
class Densities:
    """Densities of the things on a road."""

    vehicles_per_km: float = 15.0  # vehicles per km of each lane
    parked_share: float = 0.5  # share of bays with a parked vehicle
    people_per_km: float = 60.0
    riders_per_km: float = 6.0
    animals_per_km: float = 2.0
    plants_per_km: float = 150.0
    tufts_per_km: float = 0.0  # tufts of grass per km of each verge
    tuft_height_m: tuple[float, float] = (0.2, 0.4)  # least and greatest height
    crossing_share: float = CROSSING_SHARE  # share of people on crosswalks, where there are any


@dataclass(frozen=True, eq=False)
class Standing:
    """A thing and its pose in the world."""

    foot: Foot
    pose: np.ndarray  # (4, 4), without scale
    gone: bool = False  # whether it has left the road and is not visible

    @property
    def name(self) -> str:
        """Return the name of the object."""
        return self.foot.name


@dataclass(frozen=True, eq=False)
class Layout:
    """A road and the things on it."""

    base: BaseRoad
    standing: tuple[Standing, ...]
    shortages: tuple[Shortage, ...]
    signals: Signals = Signals({})


@dataclass(frozen=True)
class Viewpoint:
    """Place and heading of the camera in plan. An area in front of it stays free."""

    x_m: float
    y_m: float
    heading_rad: float


FirstThings = Callable[[Site], None]


def plan(
    base: BaseRoad,
    seed: int,
    densities: Densities,
    view: Viewpoint,
    stock: Stock = BUNDLED,
    first: FirstThings | None = None,
) -> Layout:
    """Return the layout of a road with things of a stock. The same seed gives the same layout.

    Parameters
    ----------
    base : the road.
    seed : seed of all things.
    densities : densities of things on the road.
    view : the camera; the area in front of it stays free.
    stock : things that may be drawn.
    first : function that places things with fixed places before others are drawn.

    Raises
    ------
    ConfigError : the number of things of a density could not be placed; the message states how many
        were placed.
    """
    site = Site(base, seed, stock=stock)
    _keep_free(site, view)
    if first is not None:
        first(site)
    told = signals(site)
    shortages = [place_vehicles(site, densities.vehicles_per_km, told.red)]
    place_signals(site, told)
    place_street_lamps(site)
    place_signs(site)
    place_barriers(site)
    shortages.append(place_riders(site, densities.riders_per_km))
    place_parked(site, densities.parked_share)
    place_buildings(site)
    place_pavement_things(site)
    shortages += [
        place_people(site, densities.people_per_km, densities.crossing_share),
        place_animals(site, densities.animals_per_km),
        place_plants(site, densities.plants_per_km),
    ]
    place_tufts(site, densities.tufts_per_km, densities.tuft_height_m)
    for shortage in shortages:
        shortage.check(base.name.replace("_", " "))
    feet = _named(site.feet)
    standing = tuple(
        Standing(foot, pose) for foot, pose in zip(feet, poses(base.network, feet), strict=True)
    )
    return Layout(base, standing, tuple(shortages), told)


def _keep_free(site: Site, view: Viewpoint) -> None:
    """Occupy the place of the camera's car and the area in front of the camera."""
    own = site.base.pose()
    length = EGO_M[0] + 2 * EGO_MARGIN_M
    width = EGO_M[1] + 2 * EGO_MARGIN_M
    heading = float(np.arctan2(own[1, 0], own[0, 0]))
    car = Solid(0.0, 0.0, length, width, 0.0, EGO_HEIGHT_M)
    level = int(
        site.base.lane.road.on_structure(
            "bridge", float(site.base.lane.along_road(site.base.start_m))
        )
    )
    site.taken.add(rows((car,), (float(own[0, 3]), float(own[1, 3]), heading), level=level))
    ahead = Solid(FREE_M / 2, 0.0, FREE_M, FREE_WIDTH_M, 0.0, 5.0)
    site.taken.add(rows((ahead,), (view.x_m, view.y_m, view.heading_rad), level=level))


def _named(feet: list[Foot]) -> list[Foot]:
    """Return the feet with unique names."""
    seen: Counter[str] = Counter()
    out = []
    for foot in feet:
        seen[foot.name] += 1
        again = seen[foot.name] > 1
        out.append(replace(foot, name=f"{foot.name} ({seen[foot.name]})") if again else foot)
    return out

"""The choice of traffic: drawn by the placer, or simulated by SUMO."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean

from ...placing.plan import Densities
from ...placing.site import Site
from ...placing.street_lights import signals
from ...roads.kinds import BaseRoad
from ...roads.network import Network
from ...roads.opendrive.file_road import Start
from ...roads.profile import Floats
from ...things.stock import Stock
from .demand import Wanted
from .lane_below import LanesBelow
from .lights import heeded
from .own_files import CONFIGURATION, ROUTES, bodies, check_own, driven, nearest
from .traffic import SumoTraffic, drawn_traffic, middle, shown

PLACER = "placer"
SUMO = "sumo"
CHOICES = (PLACER, SUMO)
REACH_M = 350.0  # vehicles that never come nearer to the camera than this are left out


@dataclass(frozen=True)
class RoadOfTraffic:
    """The road on which a file's traffic drives."""

    network: Network  # network of its file, or of its kind
    base: BaseRoad  # road around the default start of the camera
    shift_m: Floats  # (2,) shift from the file's coordinates to those of `base`
    # function of a start that returns the road around that place, and its shift
    about: Callable[[Start], tuple[BaseRoad, Floats]]


def from_files(traffic: str) -> bool:
    """Return whether a choice names a file."""
    return traffic.endswith((CONFIGURATION, *ROUTES))


def check_traffic(traffic: str, scenario: str) -> None:
    """Raise ConfigError for an unknown choice, and for SUMO together with a scenario."""
    if traffic not in CHOICES and not from_files(traffic):
        raise ConfigError(
            f"scene.traffic is {traffic!r}{did_you_mean(traffic, CHOICES)}; expected"
            f" {', '.join(CHOICES)}, a configuration of SUMO (.sumocfg) or a route file (.rou.xml);"
            " type for example scene.traffic=sumo"
        )
    if traffic != PLACER and scenario:
        raise ConfigError(
            f"scene.traffic is {traffic!r} beside scene.scenario, which places its own vehicles;"
            " expected one of both; type for example scene.traffic=placer"
        )


def sumo_traffic(
    base: BaseRoad, stock: Stock, seed: int, densities: Densities, second_s: float
) -> SumoTraffic:
    """Return traffic of given densities on a road, simulated by SUMO.

    Parameters
    ----------
    base : road and start of the camera's car.
    stock : families of things that may be drawn.
    seed : seed of demand and vehicles.
    densities : densities on the road; SUMO simulates vehicles and riders of bicycles.
    second_s : second of the simulation at which the scene begins, s.

    Raises
    ------
    ConfigError : SUMO is not installed; a density cannot be placed.
    CatalogError : SUMO fails.
    """
    wanted = Wanted(densities.vehicles_per_km, densities.riders_per_km, second_s)
    return drawn_traffic(base, stock, seed, wanted)


def file_traffic(
    path: Path, ego: str, second_s: float, road: RoadOfTraffic, stock: Stock
) -> SumoTraffic:
    """Return the traffic of a file on a road.

    Parameters
    ----------
    path : configuration of SUMO, or route file.
    ego : name of the vehicle that carries the camera; empty: the car nearest to the start of the
        road.
    second_s : second of the simulation at which the scene begins, s.
    road : road below the traffic.
    stock : families of things that may be drawn.

    Raises
    ------
    ConfigError : SUMO is not installed; no vehicle, or not the one for the camera, is on the road
        at that second.
    CatalogError : a file is missing or of another format; the traffic is of another network.
    """
    seed = road.base.seed
    heed = heeded(signals(Site(road.base, seed, stock=stock)), road.network, second_s)
    found, lights = driven(path, road.network, second_s, seed, heed)
    things = bodies(path, found, stock, seed)
    place = road.base.pose()[:2, 3] - road.shift_m
    own = ego or nearest(found, things, place, second_s)
    check_own(own, path, {name: found[name] for name in things}, second_s)
    state = found[own].at(second_s)
    at = np.array(middle(things[own], state))
    lane = LanesBelow(road.network).at(at, state.heading_rad)
    base = road.base
    shift = road.shift_m
    if lane is not None:
        base, shift = road.about(Start(road.network.lane(lane.key), lane.s_m, lane.aside_m))
    near = {
        name: found[name].moved(shift)
        for name in things
        if np.linalg.norm(found[name].front_m - at, axis=1).min() < REACH_M
    }
    return replace(shown(base, near, things, own, second_s), lights=lights)


def rest_of(densities: Densities) -> Densities:
    """Return the densities of the things that the placer adds to SUMO's traffic.

    They are without vehicles, riders and people who cross, because SUMO's drivers would not see
    them.
    """
    return replace(densities, vehicles_per_km=0.0, riders_per_km=0.0, crossing_share=0.0)

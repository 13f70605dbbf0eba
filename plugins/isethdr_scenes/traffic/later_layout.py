"""A layout at a later time: new places of vehicles and people, brake lamps, indicators, signals."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..placement import BRAKING
from ..placing.ground import poses
from ..placing.plan import Layout, Standing
from ..placing.site import Foot
from ..roads.kinds import turned
from ..roads.network import Network
from ..things.furniture.traffic_lights import STATES
from ..things.people.gait import walked
from .signal_plan import signal_plan
from .simulation import OWN, STANDING_M_S, Moved, Simulation

BRAKES_M_S2 = -0.7  # acceleration below which brake lights are on
DRAWN_S = 0.5  # time for which brake lamps stay as they were drawn
BLINKS_PER_S = 1.5  # UN R48: 60 to 120 per minute
# distance within which a camera's car that starts at an angle turns into the direction of its lane
TURNS_IN_M = 15.0
BRAKED = ("car", "truck", "bus", "motorcycle")  # groups with brake lights


@dataclass(frozen=True, eq=False)
class Moment:
    """A layout and the camera's car at one time."""

    layout: Layout
    own_pose: np.ndarray  # (4, 4) pose of the camera's car
    own_gone: bool  # whether the camera's car has come to the end of its road


def moment(layout: Layout, simulation: Simulation, time_s: float) -> Moment:
    """Return a layout after some seconds.

    Parameters
    ----------
    layout : layout as placed.
    simulation : simulation of that layout.
    time_s : time since the layout as placed, s; 0 or more.
    """
    state = simulation.at(time_s)
    network = layout.base.network
    signals = signal_plan(layout.signals)
    feet = []
    gone = set()
    for standing in layout.standing:
        foot = standing.foot
        carried_by = foot.partner or foot.name
        if carried_by in state.drivers:
            moved = state.drivers[carried_by]
            gone |= {foot.name} if moved.gone else set()
            feet.append(_driven(foot, moved, time_s, network))
        elif foot.name in state.people:
            x, y = state.people[foot.name]
            feet.append(_walked(foot, x, y))
        elif foot.stops:
            feet.append(replace(foot, lamps=STATES[signals.state(foot.stops, time_s)]))
        else:
            lamps = tuple(lamp for lamp in foot.lamps if lit(lamp, foot, time_s))
            feet.append(replace(foot, lamps=lamps))
    standing = tuple(
        Standing(foot, pose, foot.name in gone)
        for foot, pose in zip(feet, poses(network, feet), strict=True)
    )
    own = state.drivers[OWN]
    turn_rad = layout.base.turn_rad * max(1 - state.own_way_m / TURNS_IN_M, 0.0)
    own_pose = turned(network.lane(own.lane.key).at(own.lane.s_m, own.lane.aside_m), turn_rad)
    return Moment(replace(layout, standing=standing), own_pose, own.gone)


def _walked(foot: Foot, x_m: float, y_m: float) -> Foot:
    """Return a person who has walked to a plan point.

    Parameters
    ----------
    foot : person as placed.
    x_m, y_m : coordinates of the point, m.
    """
    now = walked(foot.thing, float(np.hypot(x_m - foot.x_m, y_m - foot.y_m)))
    cos = np.cos(foot.heading_rad)
    sin = np.sin(foot.heading_rad)
    x_m += foot.scale * float(cos * now.ahead_m - sin * now.aside_m)
    y_m += foot.scale * float(sin * now.ahead_m + cos * now.aside_m)
    return replace(foot, thing=now.thing, x_m=x_m, y_m=y_m)


def _driven(foot: Foot, moved: Moved, time_s: float, network: Network) -> Foot:
    """Return a vehicle or a rider on a lane at a later time."""
    path = network.lane(moved.lane.key)
    pose = path.at(moved.lane.s_m, moved.lane.aside_m)
    lamps = [lamp for lamp in foot.lamps if lit(lamp, foot, time_s)]
    if time_s > DRAWN_S and foot.thing.group in BRAKED:
        braking = moved.acceleration_m_s2 < BRAKES_M_S2 or moved.speed_m_s < STANDING_M_S
        lamps = [lamp for lamp in lamps if lamp not in BRAKING]
        lamps += BRAKING if braking else ()
    return replace(
        foot,
        x_m=float(pose[0, 3]),
        y_m=float(pose[1, 3]),
        heading_rad=float(np.arctan2(pose[1, 0], pose[0, 0])),
        lamps=tuple(lamps),
        road=path.road.name,
        level=int(path.road.on_structure("bridge", float(path.along_road(moved.lane.s_m)))),
        lane=foot.lane and moved.lane,
    )


def lit(lamp: str, foot: Foot, time_s: float) -> bool:
    """Return whether a lamp that was drawn as on is on at a time. Indicators are on at first and
    blink with a phase of each vehicle; other lamps stay on.

    Parameters
    ----------
    lamp : kind of lamp, with its side.
    foot : thing with the lamp; its variant seeds the phase of the blinking.
    time_s : time since the layout as placed, s.
    """
    if not lamp.startswith("indicator"):
        return True
    phase = np.random.default_rng([foot.thing.variant, 1]).uniform(0, 0.5)
    return (phase + BLINKS_PER_S * time_s) % 1.0 < 0.5

"""Traffic of SUMO from a chosen second on: its vehicles as things of a street."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import ConfigError

from ...placement import BRAKING, DRIVING
from ...placing.boxes import FIELDS
from ...placing.ground import poses
from ...placing.plan import Layout, Standing
from ...placing.shortage import Shortage
from ...placing.site import Foot, Site
from ...placing.street_lights import signals
from ...placing.vehicles import rider_foot
from ...roads.kinds import BaseRoad
from ...things.furniture.traffic_lights import STATES
from ...things.registry import RIDDEN
from ...things.stock import Stock
from ...things.thing import Thing
from ..later_layout import Moment, lit
from .demand import AFTER_S, OWN, OWN_THING, Demand, Maker, Wanted
from .lane_below import LanesBelow
from .lights import PROGRAM_FILE, STATES_FILE, Heeded, Lights, heeded, read_lights
from .net import NET, SumoNet, net_of
from .overlaps import fewest, swept, touching
from .program import call
from .trace import STEP_S, Journey, Signal, State, read

NAN = float("nan")  # bound of an error of unknown size
ROUTES = "traffic.rou.xml"
TRACE = "trace.xml"
RUNS = 4  # greatest number of runs of SUMO
LEAST = 0.5  # least number of vehicles on the road over the wanted number
NEAR = 0.15  # accepted deviation of the number of vehicles, over the wanted number
CHANGES = (0.5, 2.0)  # range of the factor on the flow from one run to the next
DYNAMIC = ("brake", "indicator")  # beginnings of the names of lamps that SUMO switches
INDICATORS = {Signal.LEFT: "left", Signal.RIGHT: "right"}
OPTIONS = (
    "--fcd-output.signals",
    "--fcd-output.acceleration",
    "--precision=4",
    "--lanechange.duration=3",
    "--time-to-teleport=-1",
    "--collision.action=warn",
    "--max-depart-delay=20",
    "--eager-insert",
    "--no-step-log",
    "--xml-validation=never",
)


@dataclass(frozen=True, eq=False)
class SumoTraffic:
    """Motion of SUMO's vehicles from a second of its simulation on."""

    base: BaseRoad  # road that starts at the place of the camera's car at that second
    second_s: float
    journeys: Mapping[str, Journey]  # journeys of the vehicles shown, by vehicle
    things: Mapping[str, Thing]
    own: str  # name of the vehicle that carries the camera
    shortages: tuple[Shortage, ...]
    left_out: tuple[str, ...] = ()  # vehicles left out because they touch others
    lights: Lights | None = None  # traffic lights that SUMO's drivers obey

    @cached_property
    def _below(self) -> LanesBelow:
        return LanesBelow(self.base.network)

    @cached_property
    def _by_foot(self) -> dict[str, str]:
        """Return the vehicle by the name of its foot."""
        return {self._name(name): name for name in self.journeys if name != self.own}

    def _name(self, vehicle: str) -> str:
        return f"{self.things[vehicle].group} {vehicle}"

    def put(self, site: Site) -> None:
        """Place the vehicles on a site, and keep the area that they sweep later free."""
        for name, journey in self.journeys.items():
            site.taken.add(self._swept(name, journey))
            if name == self.own:
                continue
            foot = self._foot(name, self.second_s)
            site.feet.append(foot)
            if foot.thing.group in RIDDEN:
                rng = np.random.default_rng([site.seed, foot.thing.variant])
                site.feet.append(rider_foot(foot, rng))

    def _swept(self, name: str, journey: Journey) -> np.ndarray:
        ahead = journey.time_s >= self.second_s - STEP_S
        return swept(journey_boxes(self.things[name], journey)[ahead])

    def _foot(self, name: str, time_s: float) -> Foot:
        """Return a vehicle at a second of the simulation."""
        state = self.journeys[name].at(time_s)
        thing = self.things[name]
        x, y = middle(thing, state)
        lane = self._below.at(np.array([x, y]), state.heading_rad)
        level = 0
        road = ""
        if lane is not None:
            path = self.base.network.lane(lane.key)
            road = path.road.name
            s = float(path.along_road(lane.s_m))
            level = int(path.road.on_structure("bridge", s))
        driving = DRIVING if thing.group != "bicycle" else ("bike_front", "bike_tail")
        lamps = (*driving, *switched_on(thing, state))
        return Foot(
            self._name(name),
            thing,
            x,
            y,
            state.heading_rad,
            "riding" if thing.group == "bicycle" else "driving",
            lamps,
            lean="surface",
            road=road,
            level=level,
            lane=lane,
        )

    def without(self, layout: Layout) -> Layout:
        """Return a layout without SUMO's vehicles and their riders."""
        own = self._by_foot
        kept = tuple(
            one for one in layout.standing if one.name not in own and one.foot.partner not in own
        )
        return replace(layout, standing=kept)

    def moment(self, layout: Layout, others: Layout, time_s: float) -> Moment:
        """Return the layout and the camera's car some seconds after `second_s`.

        Parameters
        ----------
        layout : layout as placed.
        others : layout at that time of all things that SUMO does not move.
        time_s : time after `second_s`, s.
        """
        there = {one.name: one for one in others.standing}
        standing = tuple(there.get(one.name, one) for one in layout.standing)
        moved = self.at(replace(layout, standing=standing), time_s)
        return Moment(moved, self.own_pose(time_s), self.own_gone(time_s))

    def at(self, layout: Layout, time_s: float) -> Layout:
        """Return a layout with SUMO's vehicles at their places some seconds after `second_s`."""
        feet: list[Foot] = []
        gone: list[bool] = []
        for standing in layout.standing:
            carrier = standing.foot.partner or standing.name
            vehicle = self._by_foot.get(carrier)
            if vehicle is None:
                feet.append(self._lit(standing.foot, time_s))
                gone.append(standing.gone)
                continue
            feet.append(self._later(standing.foot, vehicle, time_s))
            gone.append(not self.journeys[vehicle].present(self.second_s + time_s))
        network = layout.base.network
        moved = [k for k, one in enumerate(layout.standing) if feet[k] is not one.foot]
        later = dict(zip(moved, poses(network, [feet[k] for k in moved]), strict=True))
        standing = tuple(
            Standing(foot, later.get(k, layout.standing[k].pose), gone[k])
            for k, foot in enumerate(feet)
        )
        return replace(layout, standing=standing)

    def _lit(self, foot: Foot, time_s: float) -> Foot:
        """Return a traffic light as SUMO reports it; others stay as they are."""
        if not foot.stops or self.lights is None:
            return foot
        state = self.lights.state(foot.stops, self.second_s + time_s)
        return replace(foot, lamps=STATES.get(state, ()))

    def _later(self, foot: Foot, vehicle: str, time_s: float) -> Foot:
        now = self._foot(vehicle, self.second_s + time_s)
        switched = [lamp for lamp in now.lamps if lamp.startswith(DYNAMIC)]
        lamps = [lamp for lamp in foot.lamps if not lamp.startswith(DYNAMIC)]
        carrier = not foot.partner
        lamps += [lamp for lamp in switched if carrier and lit(lamp, now, time_s)]
        return replace(
            foot,
            x_m=now.x_m,
            y_m=now.y_m,
            heading_rad=now.heading_rad,
            lamps=tuple(lamps),
            road=now.road,
            level=now.level,
            lane=now.lane if carrier else None,
        )

    def state_notes(self, vehicles_per_km: float) -> None:
        """Record in the ledger the vehicles that are left out, and how many were placed."""
        for told in (one for one in self.shortages if one.placed < one.wanted):
            what = f"{told.placed} of {told.wanted} vehicles ({vehicles_per_km:g} per km)"
            ledger.left_out(f"SUMO placed {what}", "its traffic varies", NAN, "")
        for name in self.left_out:
            ledger.left_out(f"vehicle {name} of SUMO", "it would touch another vehicle", NAN, "")

    def own_pose(self, time_s: float) -> np.ndarray:
        """Return the pose (4, 4) of the camera's car some seconds after `second_s`."""
        foot = self._foot(self.own, self.second_s + time_s)
        if foot.lane is None:
            return poses(self.base.network, [foot])[0]
        return _start(self.base, foot).pose()

    def own_gone(self, time_s: float) -> bool:
        """Return whether the camera's car has left the road by then."""
        return not self.journeys[self.own].present(self.second_s + time_s)


def middle(thing: Thing, state: State) -> tuple[float, float]:
    """Return the plan point of a vehicle's middle; SUMO states that of its front bumper."""
    back = thing.size_m[0] / 2
    x, y = state.front_m
    return (
        float(x - back * np.cos(state.heading_rad)),
        float(y - back * np.sin(state.heading_rad)),
    )


def journey_boxes(thing: Thing, journey: Journey) -> np.ndarray:
    """Return the boxes (n, FIELDS) that a vehicle occupies at the times of its journey."""
    length, width, height = thing.size_m
    cos = np.cos(journey.heading_rad)
    sin = np.sin(journey.heading_rad)
    out = np.zeros((len(cos), FIELDS))
    out[:, 0] = journey.front_m[:, 0] - cos * length / 2
    out[:, 1] = journey.front_m[:, 1] - sin * length / 2
    out[:, 2:4] = length / 2, width / 2
    out[:, 4], out[:, 5], out[:, 7] = cos, sin, height
    return out


def switched_on(thing: Thing, state: State) -> tuple[str, ...]:
    """Return the lamps that SUMO's signals switch on: brake lamps and indicators."""
    if thing.group == "bicycle":
        return ()
    lamps = list(BRAKING) if Signal.BRAKE in state.signals else []
    sides = [s for bit, s in INDICATORS.items() if state.signals & (bit | Signal.HAZARD)]
    for side in sides:
        lamps += [f"indicator_front:{side}", f"indicator_rear:{side}"]
    return tuple(lamps)


def drawn_traffic(base: BaseRoad, stock: Stock, seed: int, wanted: Wanted) -> SumoTraffic:
    """Return traffic of a density on a road, drawn from a seed and simulated by SUMO.

    Parameters
    ----------
    base : road and start of the camera's car.
    stock : families of things that may be drawn.
    seed : seed of demand and vehicles.
    wanted : densities, and the second of the simulation at which the scene begins.

    Raises
    ------
    ConfigError : SUMO is not installed; the density cannot be placed.
    CatalogError : SUMO fails.
    """
    told = signals(Site(base, seed, stock=stock))
    heed = heeded(told, base.network, wanted.second_s)
    net = net_of(base.network, heed.junctions if heed else ())
    asked = replace(wanted, stop_gap_m=heed.stop_gap_m if heed else 0.0)
    best: tuple[_Ran, Demand] | None = None
    least_off = np.inf
    for _ in range(RUNS):
        demand = Maker(net, base, stock, seed).demand(asked)
        ran = _run(net, demand, asked, seed, heed)
        journeys = ran.journeys
        if OWN not in journeys or not journeys[OWN].present(wanted.second_s):
            asked = replace(asked, lead_s=2 * asked.lead_s, forced=asked.lead_s > wanted.lead_s)
            continue
        motor = _motor(journeys, demand.things, wanted.second_s)
        if abs(motor - demand.wanted) < least_off:
            least_off = abs(motor - demand.wanted)
            best = ran, demand
        if least_off <= max(NEAR * demand.wanted, 1):
            break
        # junctions may hold back vehicles, or vehicles may leave sooner than others enter
        change = float(np.clip(demand.wanted / max(motor, 1), *CHANGES))
        asked = replace(asked, flow=asked.flow * change)
    if best is not None:
        return _traffic(base, *best, wanted)
    raise ConfigError(
        f"scene.traffic=sumo found no place for the camera's car at second {wanted.second_s:g} on"
        f" this {base.name.replace('_', ' ')}; expected less traffic; type for example"
        f" scene.vehicles_per_km={wanted.vehicles_per_km / 2:.3g}"
    )


def _motor(journeys: Mapping[str, Journey], things: Mapping[str, Thing], second_s: float) -> int:
    """Return the number of motor vehicles on the road at a second, without the camera's car."""
    here = [name for name, one in journeys.items() if name != OWN and one.present(second_s)]
    return sum(things[name].group != "bicycle" for name in here)


class _Ran(NamedTuple):
    """Report of a run of SUMO."""

    journeys: dict[str, Journey]
    lights: Lights | None


def _run(net: SumoNet, demand: Demand, wanted: Wanted, seed: int, heed: Heeded | None) -> _Ran:
    """Return the journeys from the wanted second on, and the states of the traffic lights."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / NET).write_bytes(net.content)
        (folder / ROUTES).write_bytes(demand.content())
        arguments = [
            f"--net-file={NET}",
            f"--route-files={ROUTES}",
            f"--seed={seed % 2**31}",
            "--begin=0",
            f"--end={wanted.second_s + AFTER_S:.1f}",
            f"--step-length={STEP_S}",
            f"--fcd-output={TRACE}",
            f"--device.fcd.begin={max(wanted.second_s - 2 * STEP_S, 0):.1f}",
            *OPTIONS,
        ]
        if heed is not None:
            (folder / PROGRAM_FILE).write_bytes(heed.program(net))
            arguments.append(f"--additional-files={PROGRAM_FILE}")
        call("sumo", arguments, folder)
        lights = heed and read_lights((folder / STATES_FILE).read_bytes(), net, heed.network)
        return _Ran(read(folder / TRACE, net.offset_m), lights)


def _traffic(base: BaseRoad, ran: _Ran, demand: Demand, wanted: Wanted) -> SumoTraffic:
    """Return the traffic of a density."""
    things = {**demand.things, OWN: OWN_THING}
    traffic = shown(base, ran.journeys, things, OWN, wanted.second_s)
    motor = _motor(traffic.journeys, things, wanted.second_s)
    shortage = Shortage("vehicles_per_km", "vehicles", demand.wanted, motor, wanted.vehicles_per_km)
    check_shortage(shortage, base.name, wanted.second_s)
    return replace(traffic, shortages=(shortage,), lights=ran.lights)


def shown(
    base: BaseRoad,
    journeys: Mapping[str, Journey],
    things: Mapping[str, Thing],
    own: str,
    second_s: float,
) -> SumoTraffic:
    """Return the vehicles of all journeys, but leave out those that would touch another one.

    The road of the result starts where the camera's vehicle is at `second_s`.

    Parameters
    ----------
    base : the road.
    journeys : journeys of the vehicles, by name.
    things : thing of each vehicle, by name.
    own : name of the vehicle for the camera.
    second_s : second of the simulation at which the scene begins, s.
    """
    fine = {name: one.between(STEP_S) for name, one in journeys.items()}
    names = list(fine)
    parts = [journey_boxes(things[name], fine[name]) for name in names]
    owner = np.repeat(np.arange(len(names)), [len(part) for part in parts])
    # vehicles of one simulation step have exactly the same time
    time_s = np.concatenate([fine[name].time_s for name in names])
    out = fewest(touching(np.concatenate(parts), time_s, owner), names.index(own))
    left_out = tuple(sorted(names[k] for k in out))
    kept = {name: j for name, j in fine.items() if name not in left_out}
    traffic = SumoTraffic(base, second_s, kept, things, own, (), left_out)
    return replace(traffic, base=_start(base, traffic._foot(own, second_s)))


def check_shortage(told: Shortage, road: str, second_s: float) -> None:
    """Raise ConfigError if far fewer vehicles are on a road than wanted.

    Parameters
    ----------
    told : numbers of vehicles wanted and placed.
    road : name of the road, for the message.
    second_s : second of the simulation, for the message, s.
    """
    if told.placed >= LEAST * told.wanted - 2:
        return
    possible = told.density * told.placed / told.wanted
    raise ConfigError(
        f"scene.vehicles_per_km is {told.density:g}, but only {told.placed} of {told.wanted}"
        f" vehicles of SUMO are on this {road.replace('_', ' ')} at second {second_s:g}; expected"
        f" fewer; type for example scene.vehicles_per_km={0.8 * possible:.3g}"
    )


def _start(base: BaseRoad, foot: Foot) -> BaseRoad:
    """Return the base road with the camera's car at the place of a foot."""
    assert foot.lane is not None
    pose = base.network.lane(foot.lane.key).at(foot.lane.s_m, foot.lane.aside_m)
    turn = foot.heading_rad - float(np.arctan2(pose[1, 0], pose[0, 0]))
    return replace(
        base,
        start=foot.lane.key,
        start_m=foot.lane.s_m,
        aside_m=foot.lane.aside_m,
        turn_rad=float(np.angle(np.exp(1j * turn))),
    )

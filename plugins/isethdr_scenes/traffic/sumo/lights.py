"""Traffic lights that SUMO's drivers obey: the plan of a layout as SUMO's program, and the states
that SUMO reports.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...placing.street_lights import Signals
from ...roads.network import Network
from ...roads.opendrive.elements import child
from ...roads.opendrive.road_file import numbered
from ...roads.profile import Floats
from ..signal_plan import PHASES, SignalPlan, signal_plan
from .net import SumoNet, links_of

PROGRAM_FILE = "lights.add.xml"
STATES_FILE = "lights.xml"
STOP_GAP_M = 0.5  # distance from the stop line at which the first vehicle stops
# states in SUMO's letters; with `g`, drivers who turn left give way to oncoming ones
LETTERS = {"green": "G", "amber": "y", "red": "r", "red_amber": "u"}
NAMES = {"G": "green", "g": "green", "y": "amber", "Y": "amber", "u": "red_amber"}
OFF = "oO"


class Lights(NamedTuple):
    """States of the traffic lights over time."""

    time_s: Floats  # (n,) seconds of the simulation, rising
    shown: Mapping[str, tuple[str, ...]]  # (n,) states by the name of the road with the signal

    def state(self, road: str, time_s: float) -> str:
        """Return what a road's signal shows: green, amber, red, red_amber; "" without a signal.

        Parameters
        ----------
        road : name of the road that meets the signal.
        time_s : second of the simulation, s; outside the range the first or last state is returned.
        """
        if road not in self.shown:
            return ""
        row = int(np.searchsorted(self.time_s, time_s + 1e-6, side="right")) - 1
        return self.shown[road][max(row, 0)]


@dataclass(frozen=True)
class Heeded:
    """The signals of a layout that drivers obey."""

    plan: SignalPlan
    network: Network
    second_s: float  # second of the simulation at time 0 of the plan

    @property
    def junctions(self) -> tuple[str, ...]:
        """Return the names of the junctions that the roads with signals meet."""
        lit = self.plan.first | self.plan.second
        found = {
            road.junction
            for road in self.network.roads
            for link in (road.predecessor, road.successor)
            if road.junction and link is not None and link.name in lit
        }
        return tuple(sorted(found))

    @property
    def stop_gap_m(self) -> float:
        """Return the distance from a junction at which the first driver stops: before the stop
        lines.
        """
        lit = self.plan.first | self.plan.second
        lines = [
            min(mark.s_m, road.length_m - mark.s_m) + mark.length_m / 2
            for road in self.network.roads
            if road.name in lit
            for mark in road.objects
            if mark.kind == "stop_line"
        ]
        return max(lines, default=0.0) + STOP_GAP_M

    def program(self, net: SumoNet) -> bytes:
        """Return the plan as an additional file of SUMO, which also makes SUMO save the states."""
        top = ET.Element("additional")
        cycle_s = self.plan.cycle_s
        offset_s = (self.second_s - self.plan.start_s) % cycle_s
        for light, roads in _roads_of(net, self.network).items():
            told = {"id": light, "type": "static", "programID": "plan"}
            logic = child(top, "tlLogic", **told, offset=f"{offset_s:.3f}")
            for phase, length_s in zip(PHASES, self.plan.lengths_s, strict=True):
                letters = [LETTERS[phase[road in self.plan.second]] for road, _ in roads]
                for k, (_, left) in enumerate(roads):
                    letters[k] = letters[k].lower() if left else letters[k]
                child(logic, "phase", duration=f"{length_s:.3f}", state="".join(letters))
            child(top, "timedEvent", type="SaveTLSStates", source=light, dest=STATES_FILE)
        return ET.tostring(top)


def heeded(signals: Signals, network: Network, second_s: float) -> Heeded | None:
    """Return the signals that SUMO's drivers obey; None if a layout has none.

    Parameters
    ----------
    signals : signals of the layout.
    network : roads of the layout.
    second_s : second of the simulation at which the layout is as placed, s.
    """
    return Heeded(signal_plan(signals), network, second_s) if signals.state else None


def _roads_of(net: SumoNet, network: Network) -> dict[str, list[tuple[str, bool]]]:
    """Return for each traffic light of a net its links: the road of origin, and whether the link
    turns left.
    """
    ids = {
        str(number): name for (kind, name), number in numbered(network).items() if kind == "road"
    }
    found: dict[str, list[tuple[str, bool]]] = {}
    for link in sorted(links_of(net), key=lambda link: link.index):
        original = net.edges[link.edge].lanes[0].original.split()[0]
        road = ids[original.rpartition("_")[0]]
        found.setdefault(link.light, []).append((road, link.turn in ("l", "L")))
    return found


def read_lights(content: bytes, net: SumoNet, network: Network) -> Lights:
    """Return the states of a file that SUMO's event `SaveTLSStates` wrote, by road.

    Parameters
    ----------
    content : content of the file.
    net : net on which the simulation ran.
    network : network from which the net was made.
    """
    roads_of = _roads_of(net, network)
    times: dict[float, dict[str, str]] = {}
    for node in ET.fromstring(content).iter("tlsState"):
        here = times.setdefault(float(node.get("time", "0")), {})
        for (road, _), letter in zip(roads_of[node.get("id", "")], node.get("state", "")):
            state = "" if letter in OFF else NAMES.get(letter, "red")
            if here.get(road, "red") == "red":  # one link that is not red decides for the road
                here[road] = state
    time_s = np.array(sorted(times))
    roads = sorted({road for here in times.values() for road in here})
    return Lights(time_s, {road: tuple(times[t].get(road, "") for t in time_s) for road in roads})

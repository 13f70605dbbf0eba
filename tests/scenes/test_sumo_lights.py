"""Traffic lights that SUMO's drivers obey: the picture shows the states that SUMO reports."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest
from isethdr_scenes.placing.ground import poses
from isethdr_scenes.placing.plan import Layout, Standing
from isethdr_scenes.placing.site import Site
from isethdr_scenes.placing.street_lights import Signals, place_signals, signals
from isethdr_scenes.roads.kinds import kind
from isethdr_scenes.street import Street
from isethdr_scenes.things.furniture.traffic_lights import STATES
from isethdr_scenes.things.thing import Thing
from isethdr_scenes.traffic.signal_plan import signal_plan
from isethdr_scenes.traffic.sumo.demand import OWN, OWN_THING
from isethdr_scenes.traffic.sumo.lights import heeded, read_lights
from isethdr_scenes.traffic.sumo.net import net_of
from isethdr_scenes.traffic.sumo.net import read as read_net
from isethdr_scenes.traffic.sumo.own_files import stopping_at
from isethdr_scenes.traffic.sumo.trace import STEP_S, read
from isethdr_scenes.traffic.sumo.traffic import shown

needs_sumo = pytest.mark.skipif(find_spec("sumo") is None, reason="needs the extra `traffic`")

# A crossing converted by netconvert 1.28 and run by SUMO 1.28 (city_crossing, seed 1). For each
# edge: index of its first connection in the state of the light, and the directions of its
# connections.
EDGES = {"1": (10, "rrssl"), "2": (5, "rrssl"), "3": (0, "rrssl"), "4": (15, "rrssl")}
STATES_OF_SUMO = {
    82.8: "rrrrrGGGGgrrrrrGGGGg",
    83.0: "rrrrryyyyyrrrrryyyyy",
    86.8: "rrrrrrrrrrrrrrrrrrrr",
    88.4: "uuuuurrrrruuuuurrrrr",
    89.8: "GGGGgrrrrrGGGGgrrrrr",
}
# x, y, angle, speed, acceleration, signals of a car that waits at the stop line of road 1, and of
# the camera car behind it
CAR = {
    82.8: (-23.69, -4.64, 108.9305, 0.0, 0.0, 8),
    88.4: (-23.69, -4.64, 108.9305, 0.0, 0.0, 8),
    89.8: (-23.3781, -4.64, 107.7324, 1.0394, 2.5968, 0),
}
STANDS = (-33.1062, -4.64, 90.0, 0.0, 0.0, 9)
KEYS = ("x", "y", "angle", "speed", "acceleration", "signals")


def recorded_net():
    text = "<net><location netOffset='0.00,0.00'/>"
    for road, (first, turns) in EDGES.items():
        lane = f"<lane id='' index='0'><param key='origId' value='{road}_3'/></lane>"
        text += f"<edge id='{road}.0.00'>{lane}</edge>"
        for k, turn in enumerate(turns):
            told = f"tl='21' linkIndex='{first + k}' dir='{turn}'"
            text += f"<connection from='{road}.0.00' to='-.0.00' fromLane='0' toLane='0' {told}/>"
    return read_net((text + "</net>").encode())


@pytest.fixture(scope="module")
def crossing():
    return kind("city_crossing", 1)


@pytest.fixture
def recorded(crossing, tmp_path):
    """Return the recorded lights and journeys."""
    rows = "".join(
        f"<tlsState time='{t:.3f}' id='21' programID='plan' phase='0' state='{s}'/>"
        for t, s in STATES_OF_SUMO.items()
    )
    (tmp_path / "lights.xml").write_text(f"<tlsStates>{rows}</tlsStates>")
    one = lambda name, row: (
        f"<vehicle id='{name}' type='{name}' "
        + " ".join(f"{key}='{value}'" for key, value in zip(KEYS, row))
        + "/>"
    )
    steps = "".join(
        f"<timestep time='{t:.3f}'>{one('car', row)}{one(OWN, STANDS)}</timestep>"
        for t, row in CAR.items()
    )
    (tmp_path / "trace.xml").write_text(f"<fcd-export>{steps}</fcd-export>")
    content = (tmp_path / "lights.xml").read_bytes()
    lights = read_lights(content, recorded_net(), crossing.network)
    return lights, read(tmp_path / "trace.xml", np.zeros(2))


def test_the_picture_shows_the_recorded_states_and_who_waits_brakes(crossing, recorded):
    lights, journeys = recorded
    car = Thing("sedan", 1, "car", (4.5, 1.8, 1.45), "car")
    traffic = shown(crossing, journeys, {"car": car, OWN: OWN_THING}, OWN, 82.8)
    traffic = replace(traffic, lights=lights)
    site = Site(crossing, 1)
    traffic.put(site)
    place_signals(site, signals(site))
    at = poses(crossing.network, site.feet)
    standing = tuple(Standing(foot, pose) for foot, pose in zip(site.feet, at, strict=True))
    layout = Layout(crossing, standing, ())
    letters = {"G": "green", "y": "amber", "r": "red", "u": "red_amber"}
    for time_s, states in STATES_OF_SUMO.items():
        feet = {one.name: one.foot for one in traffic.at(layout, time_s - 82.8).standing}
        for road, (first, _) in EDGES.items():
            assert feet[f"signal {road}"].lamps == STATES[letters[states[first]]], (time_s, road)
        red = states[EDGES["1"][0]] != "G"
        assert ("brake" in feet["car car"].lamps) == red
    # between two reports, the earlier one is valid
    assert lights.state("2", 84.9) == "amber"
    assert lights.state("elsewhere", 84.9) == ""


def test_the_program_repeats_the_plan_and_begins_where_it_does(crossing):
    told = Signals({"1": "red", "2": "green", "3": "red", "4": "green"}, 5)
    plan = signal_plan(told)
    heed = heeded(told, crossing.network, 60.0)
    assert heeded(Signals({}), crossing.network, 60.0) is None
    assert heed.junctions == ("j",)
    text = heed.program(recorded_net()).decode()
    lengths = [float(part.split('"')[1]) for part in text.split("duration=")[1:]]
    assert lengths == pytest.approx(plan.lengths_s, abs=5e-4)  # SUMO counts milliseconds
    offset = float(text.split('offset="')[1].split('"')[0])
    assert (60.0 - offset) % plan.cycle_s == pytest.approx(plan.start_s, abs=5e-4)
    first = text.split('state="')[1].split('"')[0]
    assert first in ("rrrrrGGGGgrrrrrGGGGg", "GGGGgrrrrrGGGGgrrrrr")


QUIET = dict(people_per_km=0.0, animals_per_km=0.0, plants_per_km=0.0, parked_share=0.0)


def count_waiting(street: Street, first_s: float) -> int:
    """Count vehicles that stand at red, up to 0.8 m before their stop line.

    The count is summed over all steps of 30 s from `first_s` of the simulation. The function also
    checks that the lights follow the plan, and that the brake lamps are on.
    """
    layout = street.plan()
    sumo = street._sumo
    plan = signal_plan(layout.signals)
    waited = 0
    for k in range(150):
        second_s = first_s + k * STEP_S
        for road in layout.signals.state:
            seen = sumo.lights.state(road, second_s)
            # SUMO changes lights at its steps, so up to one step earlier or later than planned
            planned = {plan.state(road, (k + off) * STEP_S) for off in (-1, 0, 1)}
            assert seen in planned, (road, second_s)
        for journey in sumo.journeys.values():
            if not journey.present(second_s):
                continue
            now = journey.at(second_s)
            lane = sumo._below.at(now.front_m, now.heading_rad)
            if lane is None or sumo.lights.state(lane.key.road, second_s) != "red":
                continue
            line = next(
                mark.s_m
                for mark in layout.base.network.road(lane.key.road).objects
                if mark.kind == "stop_line"
            )
            ahead_m = lane.s_m - (layout.base.network.lane(lane.key).length_m - line)
            if now.speed_m_s < 0.1 and -0.8 < ahead_m < 0.0:
                waited += 1
                assert now.signals & 8  # its brake lamps are on
    return waited


@needs_sumo
@pytest.mark.slow
def test_drivers_of_sumo_stand_at_red_before_the_line():
    street = Street(road="city_crossing", seed=2, traffic="sumo", vehicles_per_km=14.0, **QUIET)
    assert count_waiting(street, 60.0) > 100


@needs_sumo
@pytest.mark.slow
def test_drivers_of_a_route_file_stand_at_red_before_the_line(crossing, tmp_path):
    """Let two cars drive on each road to the crossing; they arrive within 30 s."""
    cars = []
    for edge in net_of(crossing.network).edges.values():
        for way in edge.ways[:1]:
            for k in range(2):
                route = f"<route edges='{edge.name} {way}'/>"
                name = f"{edge.name}.{k}"
                cars.append(f"<vehicle id='{name}' depart='{4 * k}'>{route}</vehicle>")
    path = tmp_path / "cars.rou.xml"
    cars.sort(key=lambda car: "depart='4'" in car)  # SUMO reads cars by departure
    path.write_text(f"<routes>{''.join(cars)}</routes>")
    street = Street(road="city_crossing", seed=1, traffic=str(path), traffic_start_s=8.0, **QUIET)
    assert count_waiting(street, 8.0) > 50


def test_types_of_a_route_file_keep_the_distance_from_lights_that_they_state(tmp_path):
    path = tmp_path / "cars.rou.xml"
    path.write_text("<routes><vType id='a' jmStoplineGap='1'/><vType id='b'/></routes>")
    types = ET.fromstring(stopping_at(path, 2.5)).iter("vType")
    gaps = {node.get("id"): node.get("jmStoplineGap") for node in types}
    assert gaps == {"DEFAULT_VEHTYPE": "2.50", "a": "1", "b": "2.50"}

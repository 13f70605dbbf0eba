"""Traffic lights that change: order and durations of their states, and drivers who obey them."""

from __future__ import annotations

from itertools import groupby, pairwise

import numpy as np
import pytest
from isethdr_scenes.placing.street_lights import Signals
from isethdr_scenes.street import Street
from isethdr_scenes.things.furniture.traffic_lights import STATES
from isethdr_scenes.traffic.drivers import entries
from isethdr_scenes.traffic.junctions import PAST_M, STOP_M
from isethdr_scenes.traffic.signal_plan import (
    AMBER_S,
    CLEARANCE_S,
    GREEN_S,
    RED_AMBER_S,
    signal_plan,
)

AT_FIRST = ("green", "red"), ("red", "green"), ("amber", "red")
SEEDS = range(12)
STEP_S = 0.1


def drawn(seed: int) -> Signals:
    """Return the states of two roads, one of each group."""
    main, other = AT_FIRST[seed % len(AT_FIRST)]
    return Signals({"1": main, "2": other}, seed)


def quiet(**fields) -> Street:
    """Return a crossing with vehicles and nothing else."""
    none = dict(people_per_km=0.0, riders_per_km=0.0, animals_per_km=0.0, plants_per_km=0.0)
    return Street(road="city_crossing", parked_share=0.0, **none | fields)


@pytest.fixture(scope="module")
def street():
    return quiet(seed=2, vehicles_per_km=0.0)


def test_groups_take_turns_and_one_of_them_is_always_red():
    for seed in SEEDS:
        told = drawn(seed)
        plan = signal_plan(told)
        assert {road: plan.state(road, 0.0) for road in told.state} == told.state
        assert plan.state("another road", 1.0) == ""
        times = np.arange(0.0, 2 * plan.cycle_s, STEP_S)
        pairs = [(plan.state("1", t), plan.state("2", t)) for t in times]
        assert all("red" in pair for pair in pairs)
        assert set(pairs) >= {("red", "red"), ("green", "red"), ("red", "green")}
        for k in (0, 1):
            runs = [(state, sum(1 for _ in run)) for state, run in groupby(p[k] for p in pairs)]
            after = dict(red="red_amber", red_amber="green", green="amber", amber="red")
            assert all(after[a] == b for (a, _), (b, _) in pairwise(runs))
            limits = dict(green=GREEN_S, amber=AMBER_S, red_amber=RED_AMBER_S)
            for state, count in runs[1:-1]:  # the first and the last run are incomplete
                if state != "red":
                    low, high = limits[state]
                    # both ends of a state are known to one step
                    assert low - STEP_S <= count * STEP_S <= high + STEP_S


def test_the_cycle_is_the_sum_of_its_phases():
    for seed in SEEDS:
        plan = signal_plan(drawn(seed))
        least, most = (
            2 * sum(x[k] for x in (GREEN_S, AMBER_S, CLEARANCE_S, RED_AMBER_S)) for k in (0, 1)
        )
        assert least <= plan.cycle_s <= most
        for t in (0.3, 7.7, 20.0):
            assert plan.state("1", t) == plan.state("1", t + plan.cycle_s)


def test_lamps_follow_the_plan_and_layouts_at_time_0_keep_their_lamps(street):
    placed = street.moment(0.0).layout
    plan = signal_plan(placed.signals)
    lights = [one.foot for one in placed.standing if one.foot.thing.group == "traffic light"]
    assert len(lights) == 4 and {foot.stops for foot in lights} == set(placed.signals.state)
    for foot in lights:
        assert foot.lamps == STATES[placed.signals.state[foot.stops]]
    for time_s in (1e-9, 3.0):
        later = [one.foot for one in street.moment(time_s).layout.standing if one.foot.stops]
        assert len(later) == 4
        for foot in later:
            assert foot.lamps == STATES[plan.state(foot.stops, time_s)]


def passed_lines(street: Street, end_s: float) -> list[tuple[str, str, str]]:
    """Return (vehicle, road, state of the signal) of all that passed a stop line before `end_s`."""
    simulation = street._simulation
    plan = signal_plan(street.moment(0.0).layout.signals)
    passed = []
    while (time_s := 0.1 * (len(simulation._at) - 1)) < end_s:
        before = []
        for one in simulation._drivers:
            for start, _ in entries(one, simulation._tracks)[:1]:
                line_m = start - STOP_M + PAST_M - one.length_m / 2
                if not one.gone and one.at_m <= line_m:
                    road = one.route[one.lane_at(start - 1e-6)].road
                    before.append((one, line_m, road))
        simulation.step()
        for one, line_m, road in before:
            if one.at_m > line_m:
                passed.append((one.name, road, plan.state(road, time_s)))
    return passed


def test_the_camera_car_stops_at_red_and_starts_at_green(street):
    """The first green comes after 8.1 s; within 4 s more the car has passed the line."""
    plan = signal_plan(street.moment(0.0).layout.signals)
    green_at = next(t for t in np.arange(0, 60, 0.1) if plan.state("1", t) == "green")
    assert plan.state("1", 0.0) == "red" and 5 < green_at < 9
    assert passed_lines(street, green_at) == []
    assert passed_lines(street, green_at + 4) and street._simulation._drivers[-1].speed_m_s > 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3, 6))
def test_nobody_passes_at_red_and_many_at_green(seed):
    """Within 45 s, each group has had a green phase."""
    shown = [state for _, _, state in passed_lines(quiet(seed=seed, vehicles_per_km=25.0), 45.0)]
    assert set(shown) <= {"green", "amber"}
    assert shown.count("green") >= 4

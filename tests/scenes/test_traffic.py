"""Traffic that moves on: nobody meets anybody, speeds are plausible, names and numbers stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.placing import rules
from isethdr_scenes.placing.plan import Layout
from isethdr_scenes.placing.site import Foot
from isethdr_scenes.roads.kinds import names
from isethdr_scenes.street import Street
from isethdr_scenes.things import draw
from isethdr_scenes.things.people import families, gait
from isethdr_scenes.things.people.body import joints, walking
from isethdr_scenes.things.ranges import generator
from isethdr_scenes.traffic.following import (
    ACCELERATION_M_S2,
    BRAKING_M_S2,
    EXPONENT,
    STANDSTILL_M,
    TIME_GAP_S,
    acceleration_m_s2,
    speed_that_stops_m_s,
)
from isethdr_scenes.traffic.later_layout import BLINKS_PER_S, lit
from isethdr_scenes.traffic.simulation import OWN

from isethdr_core.errors import ConfigError

TIMES_S = (0.31, 1.7, 4.0)


def there(layout: Layout) -> Layout:
    """The layout without what has left, and without bridges, under which the ground is."""
    kept = [one for one in layout.standing if not one.gone and not one.foot.level]
    return replace(layout, standing=tuple(kept))


def check(street: Street) -> None:
    for time_s in TIMES_S:
        layout = there(street.moment(time_s).layout)
        assert not rules.overlaps(layout), time_s
        assert not rules.off_the_ground(layout), time_s
        assert not rules.misplaced(layout), time_s


@pytest.fixture(scope="module")
def village():
    return Street(road="village", seed=3, people_per_km=20.0, plants_per_km=20.0)


@pytest.mark.slow
def test_nobody_meets_anybody_and_all_stay_where_they_may(village):
    check(village)


@pytest.mark.slow
@pytest.mark.parametrize("road", names())
def test_on_all_kinds_of_road_nobody_meets_anybody(road):
    check(Street(road=road, seed=2, vehicles_per_km=25.0, riders_per_km=10.0, people_per_km=80.0))


def test_positions_follow_speeds(village):
    """The way of a tenth of a second is the mean of the speeds at its ends times its length."""
    simulation = village._simulation
    states = [simulation.at(k / 10) for k in range(20)]
    for before, after in zip(states, states[1:]):
        for name, one in before.drivers.items():
            other = after.drivers[name]
            if other.gone or one.lane.key != other.lane.key:
                continue
            way = other.lane.s_m - one.lane.s_m
            # whoever had to stop at once has not moved in that step
            mean = (one.speed_m_s + other.speed_m_s) / 2 if way else 0.0
            assert way == pytest.approx(0.1 * mean, abs=1e-9)
            assert 0 <= other.speed_m_s <= 1.05 * village.base().speed_limit_kmh / 3.6


def test_between_two_steps_places_are_linear(village):
    first, half, last = (village._simulation.at(t).drivers[OWN].lane.s_m for t in (1, 1.05, 1.1))
    assert half == pytest.approx((first + last) / 2, abs=1e-12)
    assert last > first


def test_names_stay_and_the_first_moment_is_the_drawn_one(village):
    drawn = village.moment(0.0).layout
    later = village.moment(2.0).layout
    assert [one.name for one in later.standing] == [one.name for one in drawn.standing]
    start = village.moment(1e-12).layout
    for one, other in zip(drawn.standing, start.standing, strict=True):
        np.testing.assert_allclose(one.pose, other.pose, atol=1e-6)
        assert set(one.foot.lamps) == set(other.foot.lamps)


def test_objects_keep_their_numbers_and_next_poses_are_those_of_the_next_frame():
    street = dict(road="country_crest", seed=1, vehicles_per_km=4.0, people_per_km=0.0)
    street |= dict(riders_per_km=0.0, animals_per_km=0.0, plants_per_km=0.0, parked_share=0.0)
    moving = Street(time_s=1.0, frames_per_s=4.0, **street)
    scene = moving()
    then = Street(time_s=1.25, **street)
    standing = {one.name: one.pose for one in then.plan().standing}
    names = [one.name for one in scene.objects]
    assert [name for name in names if name in standing] == list(standing)
    assert scene.next_frame.after_s == 0.25
    for name, pose, one in zip(names, scene.next_frame.poses, scene.objects, strict=True):
        if name in standing:
            np.testing.assert_allclose(pose, standing[name], atol=1e-9)
        elif name != "own headlamps":
            np.testing.assert_array_equal(pose, one.pose)
    assert scene.next_frame.camera == then._camera(then.eye())


def test_the_end_of_the_road_is_an_error_before_anything_is_built():
    street = Street(road="village", seed=3, vehicles_per_km=0.0, people_per_km=0.0, time_s=60.0)
    with pytest.raises(ConfigError, match="end of its road by then.*scene.time_s=30"):
        street.plan()


def test_indicators_blink_as_the_rule_says():
    """UN R48: 60 to 120 times a minute. Each vehicle has its own time, and starts lit."""
    assert 1 <= BLINKS_PER_S <= 2
    states = []
    for seed in range(3):
        foot = Foot("car", draw("car", np.random.default_rng(seed)), 0.0, 0.0, 0.0, "driving")
        lit_at = [lit("indicator_rear:left", foot, t) for t in np.arange(0, 10, 0.01)]
        assert lit_at[0]
        assert sum(lit_at) == pytest.approx(500, abs=35)  # half of the time, within half a blink
        assert sum(a != b for a, b in zip(lit_at, lit_at[1:])) == pytest.approx(30, abs=1)
        assert all(lit("tail", foot, t) for t in (0.0, 0.4, 7.0))
        states.append(lit_at)
    assert states[0] != states[1]


def test_the_driver_model_keeps_its_laws():
    free = 14.0
    assert acceleration_m_s2(free, free, np.inf, 0.0) == 0.0
    assert acceleration_m_s2(0.0, free, np.inf, 0.0) == ACCELERATION_M_S2
    # Treiber et al. 2000, eq. 7: the gap at which a speed is kept behind a leader of equal speed
    speed = 10.0
    gap = (STANDSTILL_M + speed * TIME_GAP_S) / np.sqrt(1 - (speed / free) ** EXPONENT)
    assert acceleration_m_s2(speed, free, gap, speed) == pytest.approx(0.0, abs=1e-12)
    # far from a wall, the braking is the kinematic one over the comfortable one, squared
    speed = 20.0
    gap = 400.0
    near = acceleration_m_s2(speed, 1e6, gap, 0.0, 0.0) - ACCELERATION_M_S2
    kinematic = speed**2 / (2 * (gap))
    expected = -(kinematic**2) / BRAKING_M_S2
    assert near == pytest.approx(expected, rel=0.15)  # the gap at a standstill is left out
    assert speed_that_stops_m_s(STANDSTILL_M, 0.0) == 0.0
    assert speed_that_stops_m_s(0.0, 9.0) == 9.0


def test_a_step_takes_the_walker_as_far_as_the_foot():
    """While a thigh swings from one end to the other, its ankle goes back by a step; 10 %, because
    the knee bends by some degrees more at the ends.
    """
    family = "man" if "man" in families.shares() else next(iter(families.shares()))
    walkers = [(k, gait.gait(families.thing(family, k))) for k in range(12)]
    variant, walk = next((k, told) for k, told in walkers if told)
    thing = families.thing(family, variant)
    assert 0.6 < gait.walking_speed_m_s(thing) < 2.2
    body = families.look_of(family, generator(family, variant)).body
    ends = [joints(body, walking(phase, walk.stride_deg)) for phase in (0.0, 0.5)]
    step_m = ends[0]["ankle_l"][0] - ends[1]["ankle_l"][0]
    assert step_m == pytest.approx(walk.cycle_m / 2, rel=0.1)
    assert gait.walked(thing, walk.cycle_m).phase == pytest.approx(walk.phase, abs=1e-9)
    assert gait.walked(thing, 0.25 * walk.cycle_m).phase != pytest.approx(walk.phase, abs=0.1)
    standing = next(k for k, told in walkers if told is None)
    still = families.thing(family, standing)
    assert gait.walking_speed_m_s(still) == 0.0
    assert gait.walked(still, 1.0) is still

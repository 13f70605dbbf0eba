"""Traffic over time: no collisions, plausible speeds, names and instance numbers that stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.placing import rules
from isethdr_scenes.placing.plan import Layout
from isethdr_scenes.placing.site import Foot
from isethdr_scenes.roads.kinds import kind, names
from isethdr_scenes.street import Street
from isethdr_scenes.things import draw
from isethdr_scenes.things.people import families, gait
from isethdr_scenes.things.people.body import (
    ANKLE_M,
    HEEL,
    TOE,
    Body,
    Swing,
    foot_across,
    joints,
    walking,
)
from isethdr_scenes.things.thing import Thing
from isethdr_scenes.traffic.following import (
    ACCELERATION_M_S2,
    BRAKING_M_S2,
    EXPONENT,
    STANDSTILL_M,
    TIME_GAP_S,
    acceleration_m_s2,
    speed_that_stops_m_s,
)
from isethdr_scenes.traffic.later_layout import BLINKS_PER_S, lit, moment
from isethdr_scenes.traffic.simulation import OWN, Simulation

from isethdr_core.errors import ConfigError

TIMES_S = (0.31, 1.7, 4.0)


def there(layout: Layout) -> Layout:
    """Return the layout without things that have left, and without things on bridges.

    The ground of a thing on a bridge would be that below the bridge.
    """
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


@pytest.mark.parametrize(("family", "seed"), [("man", 1), ("teenager", 0)])
def test_the_room_of_a_walking_person_holds_every_step(family, seed):
    """The space reserved for a walking person contains the person in every phase of a step.

    Limbs swing, so the middle of the extent moves by up to 8 cm relative to uniform motion. The
    space is computed from eight poses of a step; between them it was too small by at most 0.1 mm.
    """
    thing = draw("person", np.random.default_rng(seed), family)
    assert gait.walking_speed_m_s(thing) > 0
    room = gait.largest_size_m(thing)
    for way_m in np.linspace(0, 2, 13):
        now = gait.walked(thing, way_m)
        for side, off in enumerate((now.ahead_m, now.aside_m)):
            assert abs(off) + now.thing.size_m[side] / 2 <= room[side] / 2 + 1e-3


def test_positions_follow_speeds(village):
    """The distance driven in a step of 0.1 s is the mean of the speeds at its ends times 0.1 s."""
    simulation = village._simulation
    states = [simulation.at(k / 10) for k in range(20)]
    for before, after in zip(states, states[1:]):
        for name, one in before.drivers.items():
            other = after.drivers[name]
            if other.gone or one.lane.key != other.lane.key:
                continue
            way = other.lane.s_m - one.lane.s_m
            # a vehicle that had to stop at once does not move in that step
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


@pytest.mark.slow
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
    with pytest.raises(ConfigError, match="end of its road at 60 s.*scene.time_s=30"):
        street.plan()
    with pytest.raises(ConfigError, match="time_s is 60, .* at 60.5 s"):  # of a next frame
        street.moment(60.5)


def test_the_cameras_car_keeps_its_offset_on_its_lane():
    """A scenario may place it beside the middle of its lane, and it does not jump there later."""
    base = replace(kind("country_straight", 1), aside_m=0.3)
    layout = Layout(base, (), ())
    later = moment(layout, Simulation(layout, 0.0), 0.1)
    way = later.own_pose[:3, 3] - base.pose()[:3, 3]
    assert way @ base.pose()[:3, 1] == pytest.approx(0.0, abs=0.01)
    assert way @ base.pose()[:3, 0] > 0.5


def test_indicators_blink_as_the_rule_says():
    """Indicators blink 60 to 120 times per minute (UN R48).

    Each vehicle has its own rhythm and starts lit.
    """
    assert 1 <= BLINKS_PER_S <= 2
    states = []
    for seed in range(3):
        foot = Foot("car", draw("car", np.random.default_rng(seed)), 0.0, 0.0, 0.0, "driving")
        lit_at = [lit("indicator_rear:left", foot, t) for t in np.arange(0, 10, 0.01)]
        assert lit_at[0]
        assert sum(lit_at) == pytest.approx(500, abs=35)  # half of the time, to half a blink
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
    # far from a wall, the deceleration is the square of the kinematic one over the comfortable one
    speed = 20.0
    gap = 400.0
    near = acceleration_m_s2(speed, 1e6, gap, 0.0, 0.0) - ACCELERATION_M_S2
    kinematic = speed**2 / (2 * (gap))
    expected = -(kinematic**2) / BRAKING_M_S2
    assert near == pytest.approx(expected, rel=0.15)  # neglects the standstill gap
    assert speed_that_stops_m_s(STANDSTILL_M, 0.0) == 0.0
    assert speed_that_stops_m_s(0.0, 9.0) == 9.0


def soles(body, at):
    """Return position along x and height, m, of the lowest points of heel and toe of both feet.

    Heel and toe are rounded and roll on the ground.
    """
    found = {}
    for side in "lr":
        along = at[f"foot_{side}"]
        across = foot_across(along)
        for name, (reach, radius) in (("heel", HEEL), ("toe", TOE)):
            middle = reach * along - (ANKLE_M - radius) * across
            middle = at[f"ankle_{side}"] + body.scale * middle
            # a round that rolls by an angle moves by radius times angle
            rolled = -body.scale * radius * float(np.arcsin(along[2]))
            found[side, name] = middle[0] - rolled, middle[2] - radius * body.scale
    return found


@pytest.mark.parametrize("hip_deg", [10.0, 20.0, 31.0])
def test_a_foot_on_the_ground_stays_where_it_is(hip_deg):
    """The body moves uniformly, and the heel or toe on the ground rolls without sliding."""
    body = Body(height_m=1.72)
    swing = Swing(hip_deg)
    cycle_m = 2 * swing.step_m(body)
    for side, first in (("l", 0.0), ("r", 0.5)):
        places = {"heel": [], "toe": []}
        grounds = []
        for share in np.linspace(0.001, 0.499, 60):
            phase = (first + share) % 1.0
            at = joints(body, walking(body, phase, swing))
            pitch = at[f"foot_{side}"][2]
            told = soles(body, at)
            if pitch >= 0:
                places["heel"].append(told[side, "heel"][0] + share * cycle_m)
            if pitch <= 0:
                places["toe"].append(told[side, "toe"][0] + share * cycle_m)
            other = "r" if side == "l" else "l"
            low = [min(told[s, name][1] for name in places) for s in (side, other)]
            assert low[0] <= low[1] + 1e-9  # the foot that swings is above the ground
            grounds.append(low[0])
        hip_m = body.leg * body.height_m - np.array(grounds)
        # the hips move up and down by less than on stiff legs, for which it is 1 - cos of the swing
        # angle
        stiff = (body.thigh_m + body.shin_m) * (1 - np.cos(np.radians(hip_deg)))
        assert 0.0 < np.ptp(hip_m) < stiff + 0.005  # ankles swing farther forward than back
        for found in places.values():
            assert np.ptp(found) < 1e-9
        apart = np.mean(places["toe"]) - np.mean(places["heel"])
        assert apart == pytest.approx(body.scale * (TOE[0] - HEEL[0]), rel=0.01)  # feet turn out


def test_left_and_right_take_turns():
    body = Body()
    for phase in (0.0, 0.2, 0.37):
        here, later = (joints(body, walking(body, p, Swing(25.0))) for p in (phase, phase + 0.5))
        for part in ("knee", "ankle", "elbow", "wrist"):
            mirrored = here[f"{part}_l"] * [1, -1, 1]
            assert later[f"{part}_r"] == pytest.approx(mirrored, abs=1e-12)
    stretched = joints(body, walking(body, 0.0, Swing(25.0)))
    assert stretched["ankle_l"][0] > 0.2 > -0.2 > stretched["ankle_r"][0]
    assert stretched["wrist_l"][0] < stretched["wrist_r"][0]  # arms swing opposite to legs


def test_people_walk_on_evenly_by_the_steps_that_they_take():
    """The body of a walking person moves uniformly, by the length of the steps.

    The middle of the person's extent moves relative to the body, with arms and legs.
    """
    means = {"man": (0.79, 0.02), "woman": (0.66, 0.02)}
    for family, (step_m, within) in means.items():
        walks = [gait.gait(Thing(family, k, "person", (1, 1, 2))) for k in range(250)]
        steps = [walk.cycle_m / 2 for walk in walks if walk]
        assert np.mean(steps) == pytest.approx(step_m, abs=within)  # Murray et al. 1964, 1970
        assert np.mean([walk is None for walk in walks]) == pytest.approx(0.35, abs=0.08)
    walkers = [(k, gait.gait(families.thing("man", k))) for k in range(12)]
    variant, walk = next((k, told) for k, told in walkers if told)
    thing = families.thing("man", variant)
    assert gait.walking_speed_m_s(thing) == pytest.approx(walk.cycle_m * 117 / 120)
    before = families.centre_m(families.figure_of_thing(thing))
    for way_m in (0.0, 0.3, 0.25 * walk.cycle_m, walk.cycle_m):
        now = gait.walked(thing, way_m)
        after = families.centre_m(families.figure_of_thing(now.thing))
        assert after[0] - before[0] == pytest.approx(now.ahead_m, abs=1e-12)
        assert now.thing.phase == pytest.approx((walk.phase + way_m / walk.cycle_m) % 1, abs=1e-9)
    assert now.ahead_m == pytest.approx(0.0, abs=1e-9)  # after a whole cycle
    standing = next(k for k, told in walkers if told is None)
    still = families.thing("man", standing)
    assert gait.walking_speed_m_s(still) == 0.0
    assert gait.walked(still, 1.0).thing is still

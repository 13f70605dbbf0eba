"""Layouts of streets without meshes: nothing overlaps, floats, or stands where it may not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.placing import rules
from isethdr_scenes.placing.boxes import Solid, overlapping, rows, solids
from isethdr_scenes.placing.camera import Mounting, check_eye, eye
from isethdr_scenes.placing.living import _riding
from isethdr_scenes.placing.plan import Densities, Layout, plan
from isethdr_scenes.placing.road_signs import _along
from isethdr_scenes.placing.site import Site
from isethdr_scenes.placing.street_lights import signals
from isethdr_scenes.roads.kinds import kind, names
from isethdr_scenes.roads.lane_path import LanePath
from isethdr_scenes.roads.profile import Profile
from isethdr_scenes.roads.reference_line import ReferenceLine, Stretch
from isethdr_scenes.roads.road import Lane, LaneSection, Road
from isethdr_scenes.street import Street
from isethdr_scenes.things import draw
from isethdr_scenes.things.furniture import street_lamps, traffic_lights

from isethdr_core.errors import ConfigError

# kinds with layouts that take little time; the others are tested among the slow tests
QUICK = ("country_curve", "city_2_lanes", "tunnel", "cycle_street", "country_crest", "city_6_lanes")
DENSITIES = Densities(10.0, 0.4, 12.0, 2.0, 2.0, 30.0)
BUSY = Densities(45.0, 0.9, 150.0, 25.0, 12.0, 300.0)


def laid_out(name: str, seed: int, densities: Densities, mounting: Mounting | None = None):
    base = kind(name, seed)
    view = eye(base.pose(), mounting or Mounting())
    return plan(base, seed, densities, view.viewpoint()), view


def samples(layout: Layout, count: int = 7) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 3) in the boxes of all things, at their poses, and the number of their
    thing."""
    grid = np.linspace(-0.49, 0.49, count)
    unit = np.stack(np.meshgrid(grid, grid, [0.02, 0.5, 0.98], indexing="ij"), -1).reshape(-1, 3)
    points = []
    owner = []
    for k, one in enumerate(layout.standing):
        for x, y, length, width, bottom, top in solids(one.foot.thing):
            local = unit * [length, width, top - bottom] + [x, y, bottom]
            local *= one.foot.scale
            points.append(local @ one.pose[:3, :3].T + one.pose[:3, 3])
            owner += [k] * len(unit)
    return np.concatenate(points), np.array(owner)


def inside_others(layout: Layout) -> list[str]:
    """Return things that contain a point of another thing, found without separating axes."""
    points, owner = samples(layout)
    found = []
    for k, one in enumerate(layout.standing):
        reach = one.foot.scale * np.linalg.norm(one.foot.thing.size_m)
        near = np.linalg.norm(points - one.pose[:3, 3], axis=1) < reach
        near &= owner != k
        local = (points[near] - one.pose[:3, 3]) @ one.pose[:3, :3]
        for x, y, length, width, bottom, top in one.foot.scale * np.array(solids(one.foot.thing)):
            # 1 cm: panels that stand end to end on a hill are tilted relative to each other
            held = np.abs(local[:, 0] - x) < length / 2 - 0.01
            held &= np.abs(local[:, 1] - y) < width / 2 - 0.01
            # 20 cm: on slopes, a thing stands on the mean height of the ground below it
            held &= (local[:, 2] > bottom + 0.2) & (local[:, 2] < top - 0.2)
            for j in set(owner[near][held]):
                other = layout.standing[j].foot
                if one.foot.name != other.partner and other.name != one.foot.partner:
                    found.append(f"{other.name} in {one.name}")
    return found


def check(layout: Layout, view, in_space: bool = True) -> None:
    assert not rules.overlaps(layout)
    assert not rules.off_the_ground(layout)
    assert not rules.misplaced(layout)
    assert not rules.before_camera(layout, view.viewpoint())
    assert not in_space or not inside_others(layout)
    assert all(s.placed == s.wanted for s in layout.shortages)
    assert {s.field for s in layout.shortages} == {
        "vehicles_per_km",
        "riders_per_km",
        "people_per_km",
        "animals_per_km",
        "plants_per_km",
    }
    named = [s.name for s in layout.standing]
    assert len(set(named)) == len(named)
    check_eye(layout, view)


# each quick kind is tested once; further layouts of these kinds are among the slow tests
@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=[pytest.mark.slow] * (k >= len(QUICK))) for k in range(20)]
)
def test_layouts_keep_all_rules(seed):
    check(*laid_out(QUICK[seed % len(QUICK)], seed, DENSITIES), seed % 5 == 0)


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_twelve_layouts_of_each_kind_keep_all_rules(name):
    for seed in range(12):
        mount = ("front", "rear", "left", "right")[seed % 4]
        densities = DENSITIES if seed % 2 else Densities()
        check(*laid_out(name, seed, densities, Mounting(mount)))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["city_4_lanes", "country_crossing", "residential"])
def test_busy_roads_keep_all_rules(name):
    for seed in range(4):
        check(*laid_out(name, seed, BUSY))


def test_the_same_seed_gives_the_same_layout_and_another_one_differs():
    first, again, other = (laid_out("tunnel", seed, DENSITIES)[0] for seed in (3, 3, 4))
    assert [s.foot for s in first.standing] == [s.foot for s in again.standing]
    assert all(
        np.array_equal(a.pose, b.pose) for a, b in zip(first.standing, again.standing, strict=True)
    )
    assert [s.foot for s in first.standing] != [s.foot for s in other.standing]


def only_vehicles(per_km: float) -> Densities:
    return Densities(per_km, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_a_density_that_cannot_be_placed_says_how_many_were_and_proposes_one_that_can():
    with pytest.raises(ConfigError, match=r"only (\d+) of (\d+) vehicles could be placed") as told:
        laid_out("country_straight", 1, only_vehicles(220.0))
    placed, wanted = (int(word) for word in str(told.value).split() if word.isdigit())
    assert 0 < placed < wanted and "type for example scene.vehicles_per_km=" in str(told.value)
    density = float(str(told.value).rpartition("=")[2])
    layout, _ = laid_out("country_straight", 1, only_vehicles(density))
    assert layout.shortages[0].placed == layout.shortages[0].wanted > 0


def test_the_number_of_things_follows_the_density():
    """Compare means over seeds; the number of vehicles is rounded in each lane."""
    counts = {
        density: np.mean(
            [
                laid_out("country_straight", s, only_vehicles(density))[0].shortages[0].placed
                for s in range(3)
            ]
        )
        for density in (10.0, 40.0)
    }
    assert counts[10.0] >= 2 and counts[40.0] / counts[10.0] == pytest.approx(4.0, rel=0.35)


def test_boxes_overlap_as_points_say():
    """Compare separating axes with a fine grid of points of both boxes."""
    rng = np.random.default_rng(4)
    grid = np.linspace(-0.5, 0.5, 41)
    unit = np.stack(np.meshgrid(grid, grid), -1).reshape(-1, 2)
    decided = 0
    for _ in range(60):
        boxes = []
        for _ in range(2):
            size = rng.uniform(0.5, 4.0, 2)
            at = (*rng.uniform(-2, 2, 2), float(rng.uniform(0, 6.3)))
            boxes.append(rows((Solid(0, 0, *size, 0, 1),), at)[0])
        one, two = boxes
        cos, sin = one[4:6]
        points = unit * 2 * one[2:4] @ np.array([[cos, sin], [-sin, cos]]) + one[:2]
        cos, sin = two[4:6]
        local = (points - two[:2]) @ np.array([[cos, -sin], [sin, cos]])
        deepest = (np.abs(local) - two[2:4]).max(1).min()
        if abs(deepest) < 0.15:
            continue  # the grid is too coarse to decide
        decided += 1
        assert overlapping(one, two[None])[0] == (deepest < 0)
    assert decided > 40


def test_what_hangs_over_a_road_leaves_room_below():
    for thing in (
        street_lamps.thing("mast_arm", 1),
        street_lamps.thing("high_mast", 1),
        traffic_lights.thing("signal_mast", 1),
    ):
        post, arm = solids(thing)
        assert post.bottom_m == 0.0 and post.length_m < 0.5 and arm.bottom_m > 4.5


def test_a_camera_in_a_thing_or_the_ground_is_one_error():
    layout, place = laid_out("city_2_lanes", 2, DENSITIES)
    building = next(s for s in layout.standing if s.foot.thing.group == "building")
    with pytest.raises(ConfigError, match=f"inside '{building.name}'; expected a free place"):
        check_eye(layout, type(place)(building.pose[:3, 3] + [0, 0, 1.3], place.direction))
    with pytest.raises(ConfigError, match=r"\+0.10 m above the ground; expected 0.2 or more"):
        check_eye(layout, eye(layout.base.pose(), Mounting(height_m=0.1)))


def test_a_camera_in_the_wall_of_a_tunnel_is_one_error():
    base = kind("tunnel", 1)
    layout, _ = laid_out("tunnel", 1, DENSITIES)
    span = base.lane.road.structures[0]
    middle = base.lane.road.pose(span.start_m + 50.0, float(base.lane.road.edges(50.0)[1]) + 0.6)
    place = eye(base.pose(), Mounting())
    with pytest.raises(ConfigError, match="inside the wall of a tunnel"):
        check_eye(layout, type(place)(middle[:3, 3] + [0, 0, 1.3], place.direction))


def test_signs_warn_both_directions_of_their_own_curve():
    """A road that curves to the left for one direction curves to the right for the other one."""
    base = kind("country_straight", 1)
    lane = Lane(-1, "driving", Profile.constant(3.5))
    section = LaneSection(0.0, (replace(lane, number=1),), (lane,))
    line = ReferenceLine.of(0.0, 0.0, 0.0, [Stretch(400.0, 1 / 90)])
    road = Road("curve", line, (section,), "rural")
    site = Site(base, 1)
    told = {
        side: {foot.thing.family for foot in _along(site, road, side, site.rng("signs"))}
        for side in (-1, 1)
    }
    assert "curve_left" in told[-1] and "curve_right" not in told[-1]
    assert "curve_right" in told[1] and "curve_left" not in told[1]


@pytest.mark.parametrize("right_hand", [True, False])
def test_bicycles_ride_at_the_outer_edge_of_a_lane(right_hand):
    lane = Lane(-1, "driving", Profile.constant(3.5))
    line = ReferenceLine.of(0.0, 0.0, 0.0, [Stretch(100.0)])
    road = Road("r", line, (LaneSection(0.0, (), (lane,)),), right_hand=right_hand)
    rng = np.random.default_rng(0)
    bicycle = draw("bicycle", rng)
    foot = _riding("bicycle", bicycle, [LanePath(road, 0, lane)], 1.0, rng)
    # the lane lies right of the reference line, from y = 0 to -3.5 m
    assert foot.y_m == pytest.approx(-2.75, abs=0.11)


def test_signals_of_crossing_roads_never_show_green_together():

    for seed in range(6):
        told = signals(Site(kind("city_crossing", seed), seed))
        headings = {
            road: kind("city_crossing", seed).network.road(road).line.at(0.0).heading_rad
            for road in told.state
        }
        green = [float(headings[r]) for r, state in told.state.items() if state != "red"]
        assert len(told.state) == 4
        assert all(abs(np.sin(a - b)) < 0.7 for a in green for b in green)


@pytest.mark.slow
def test_some_vehicles_are_inside_a_junction():
    layout, _ = laid_out("country_crossing", 1, only_vehicles(60.0))
    network = layout.base.network
    inside = [s for s in layout.standing if s.foot.road and network.road(s.foot.road).junction]
    assert inside and not rules.overlaps(layout)


@pytest.mark.slow
def test_tufts_stand_beside_the_shoulders_and_nowhere_else():
    """No tuft is on the road, inside another thing, or in front of the camera.

    The other things stand where they stand without tufts.
    """
    none = dict(people_per_km=0.0, riders_per_km=0.0, animals_per_km=0.0, parked_share=0.0)
    bare = Street(road="country_curve", seed=3, vehicles_per_km=0.0, plants_per_km=40.0, **none)
    grown = replace(bare, tufts_per_km=400.0, tuft_height_m=(0.25, 0.35))
    without = bare.plan()
    layout = grown.plan()
    tufts = [one for one in layout.standing if one.foot.thing.group == "grass"]
    others = [one for one in layout.standing if one.foot.thing.group != "grass"]
    assert [one.name for one in others] == [one.name for one in without.standing]
    assert len(tufts) > 20
    only = replace(layout, standing=tuple(tufts))
    assert not rules.overlaps(layout)
    assert not rules.misplaced(only)
    assert not rules.before_camera(layout, grown.eye().viewpoint())
    heights = [one.foot.scale * one.foot.thing.size_m[2] for one in tufts]
    assert 0.25 <= min(heights) < max(heights) <= 0.35
    middle = layout.base.pose()[:2, 3]
    assert max(np.linalg.norm(one.pose[:2, 3] - middle) for one in tufts) <= 60.0
    assert len({one.foot.thing for one in tufts}) <= 6  # six shared meshes

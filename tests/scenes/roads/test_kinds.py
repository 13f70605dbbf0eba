"""Kinds of base road: valid networks, drawn within their ranges, the same for the same seed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.roads import kinds
from isethdr_scenes.roads.checks import problems
from isethdr_scenes.roads.layouts.junction import Pose, way
from isethdr_scenes.roads.layouts.vertical import Vertex, grades
from isethdr_scenes.roads.markings import patches
from isethdr_scenes.roads.pictures.from_above import top_view
from isethdr_scenes.roads.reference_line import ReferenceLine
from isethdr_scenes.roads.stations import HEIGHT_M, PLAN_M, stations

from isethdr_core.errors import ConfigError


def allowed(ranges):
    """Return the smallest and the largest width, m, that a kind declares, by type of lane."""
    told = [*ranges["right"], *ranges.get("below", [])]
    told += [] if ranges.get("left", "mirror") == "mirror" else ranges["left"]
    told += [("driving", *ranges[n]) for n in ("works_lane_m", "ring_m") if n in ranges]
    told += [("parking", *ranges["bay_m"])] if "bay_m" in ranges else []
    return {
        kind: (min(x[1] for x in told if x[0] == kind), max(x[2] for x in told if x[0] == kind))
        for kind in {x[0] for x in told} - {"shoulder"}  # tapers narrow a shoulder
    }


def check(name, seed):
    base = kinds.kind(name, seed)
    network = base.network
    limit = base.curvature_limit_per_m
    widths = allowed(kinds.table()[name]) if name != "motorway_ramp" else {}
    assert not [str(p) for p in problems(network, limit, widths)]
    assert base.lane.type == "driving" and 0 <= base.start_m < base.lane.length_m
    pose = base.pose()
    assert pose[:3, 2] @ [0, 0, 1] > 0.99 and pose[0, 0] ** 2 + pose[1, 0] ** 2 > 0.98
    # follow the lanes for 100 m, or to the end of the network
    key = base.start
    driven = base.lane.length_m - base.start_m
    while network.successors(key):
        key = network.successors(key)[0]
        driven += network.lane(key).length_m
        if driven > 100:
            break
    assert driven > (100 if name not in ("car_park", "yard") else 40)


@pytest.mark.parametrize("name", kinds.names())
def test_kind_is_sound(name):
    check(name, 1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 32))
def test_kinds_of_many_seeds_are_sound(seed):
    for name in kinds.names():
        check(name, seed)


def test_there_are_25_kinds_and_another_name_is_one_clear_error():
    assert len(kinds.names()) == 25
    with pytest.raises(ConfigError, match="country_straight"):
        kinds.kind("rainbow_road")


def test_same_seed_same_road_and_another_seed_another_road():
    first, again, other = (kinds.kind("country_curve", seed) for seed in (4, 4, 5))
    assert first.network.roads == again.network.roads
    assert first.network.roads != other.network.roads


def test_problems_are_found():
    network = kinds.kind("city_crossing", 0).network
    road = network.roads[0]
    first = road.line.records[0]
    moved = replace(road, line=ReferenceLine((replace(first, x_m=first.x_m + 0.2),)))
    broken = replace(network, roads=(moved, *network.roads[1:]))
    found = problems(broken, 0.01, {"driving": (3.3, 4.0)})
    assert {"steps", "curvature", "narrow"} <= {w for p in found for w in p.what.split()}
    assert found[0].road and "s =" in str(found[0])


@pytest.mark.parametrize("aside", (-12.0, 0.0, 3.0))
def test_way_ends_at_its_pose(aside):
    start = Pose(1.0, 2.0, 0.4)
    turn = -1.2 if aside < 0 else 0.0
    ahead = np.array([np.cos(0.4), np.sin(0.4)])
    end = Pose(
        *(np.array([1.0, 2.0]) + 20 * ahead + aside * np.array([-ahead[1], ahead[0]])), 0.4 + turn
    )
    line = way(start, end)
    x, y, heading, _ = line.at(line.length_m)
    assert (x, y, heading) == pytest.approx(end, abs=1e-9)
    assert not line.gaps(1e-9, 1e-9)


@pytest.mark.parametrize("turn", (0.0, 1e-4, -0.05, 0.05, 0.25))
@pytest.mark.parametrize("aside", (-3.0, -0.2, 0.2, 3.0))
def test_movement_straight_on_may_lead_to_the_side(aside, turn):
    """Roads that are almost in line, with lanes that are not: the straight lines through the lanes
    often meet before the start or beyond the end.
    """
    start = Pose(0.0, 0.0, 0.0)
    end = Pose(20.0, aside, turn)
    line = way(start, end)
    x, y, heading, _ = line.at(line.length_m)
    assert (x, y, heading) == pytest.approx(end, abs=1e-9)
    assert not line.gaps(1e-9, 1e-9)
    # not much longer than the chord, and without a loop
    assert line.length_m < 1.05 * np.hypot(20.0, aside)
    for end in (Pose(-20.0, aside, turn), Pose(0.5, 10 * aside, turn), Pose(20.0, -9.0, 1.5)):
        with pytest.raises(ConfigError, match="cannot be built"):
            way(start, end)


def test_parabola_joins_the_grades():
    heights = grades([0.05, -0.03], [Vertex(100.0, 1000.0)])
    assert heights.slope([59.9, 140.1]) == pytest.approx([0.05, -0.03])
    assert heights.at(59.0) == pytest.approx(2.95)  # on the first grade
    assert heights.bend(100.0) == pytest.approx(-1 / 1000)
    # at the vertex the parabola lies R dg^2 / 8 under it
    assert heights.at(100.0) == pytest.approx(5.0 - 1000 * 0.08**2 / 8)


def test_chords_between_stations_stay_near_the_road():
    road = kinds.kind("country_curve", 1).network.roads[0]
    s = stations(road)
    for t in (-4.0, 0.0, 4.0):
        ends = road.points(s, t)
        middle = road.points((s[1:] + s[:-1]) / 2, t)
        off = (ends[1:] + ends[:-1]) / 2 - middle
        assert np.hypot(*off[:, :2].T).max() < 1.2 * PLAN_M  # at t, not on the line
        assert np.abs(off[:, 2]).max() < 1.2 * HEIGHT_M


def test_dashes_have_their_length_and_arrows_point_with_the_traffic():
    road = kinds.kind("city_4_lanes", 3).network.roads[0]
    found = patches(road)
    dashes = [p.st_m for p in found if p.name == "line" and np.ptp(p.st_m[..., 0]) < 10]
    assert {round(float(np.ptp(d[..., 0])), 6) for d in dashes[:-4]} == {3.0}
    heads = [p.st_m for p in found if p.name == "arrow" and np.ptp(p.st_m[..., 1]) > 0.5]
    for head in heads:
        ahead = head[1].mean(0)[0] - head[0].mean(0)[0]
        assert ahead * head[0, 0, 1] < 0  # ahead on the right, backwards on the left


def test_top_view_shows_the_road_and_the_car():
    picture = np.asarray(top_view(kinds.kind("country_straight", 0), 120.0, 120))
    red = np.argwhere((picture == (220, 20, 20)).all(-1))
    assert len(red) > 4 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 5

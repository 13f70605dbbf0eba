"""Reference lines, lanes and the height of the ground against closed forms and integrations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.roads.ground_height import Land
from isethdr_scenes.roads.network import Connection, Junction, Network
from isethdr_scenes.roads.profile import Cubic, Profile
from isethdr_scenes.roads.reference_line import Record, ReferenceLine, Stretch
from isethdr_scenes.roads.road import Lane, LaneSection, Link, Road
from scipy.integrate import solve_ivp

from isethdr_core.errors import ConfigError

CURVE = [Stretch(40), Stretch(35, 0, 0.02), Stretch(50, 0.02), Stretch(35, 0.02, -0.01)]


def lanes(*widths, types=("driving", "sidewalk")):
    left = [Lane(k + 1, t, Profile.constant(w)) for k, (w, t) in enumerate(zip(widths, types))]
    left = [replace(lane, raised_m=0.12 * (lane.type == "sidewalk")) for lane in left]
    return LaneSection(0.0, tuple(left), tuple(replace(x, number=-x.number) for x in left))


@pytest.fixture(scope="module")
def road():
    return Road(
        "1",
        ReferenceLine.of(3.0, -2.0, 0.3, CURVE),
        (lanes(3.5, 2.0),),
        elevation=Profile.smooth([(0, 1.0, 0.0), (60, 2.0, 0.05), (160, 7.0, 0.03)]),
        superelevation=Profile.constant(0.02),
        crossfall=(Profile.constant(0.025), Profile.constant(0.025)),
    )


def test_line_is_the_integral_of_its_curvature(road):
    line = road.line
    curvature = lambda s: np.interp(s, [40, 75, 125, 160], [0, 0.02, 0.02, -0.01])
    along = lambda s, p: [np.cos(p[2]), np.sin(p[2]), curvature(s)]
    s = np.linspace(0, 160, 33)
    stretches = [(0.0, 40.0), (40.0, 75.0), (75.0, 125.0), (125.0, 160.0)]
    start = [3.0, -2.0, 0.3]
    worst = 0.0
    for first, last in stretches:
        at = s[(s >= first) & (s <= last)]
        ends = np.unique([*at, last])
        found = solve_ivp(along, (first, last), start, "DOP853", ends, rtol=1e-12, atol=1e-12)
        x, y, heading, _ = line.at(ends)
        worst = max(worst, np.abs(found.y - [x, y, heading]).max())
        start = found.y[:, -1]
    assert worst < 1e-9  # the tolerance of the integrator, over 160 m


def test_spiral_of_many_turns_keeps_its_precision():
    record = Record(0, 0, 0, 0, 200.0, -0.2, 0.5)  # 30 radians of heading
    fine = np.linspace(0, 200, 400001)
    heading = -0.2 * fine + 0.7 / 200 * fine**2 / 2
    x = np.trapezoid(np.cos(heading), fine)
    assert record.end.x_m == pytest.approx(x, abs=1e-5)  # trapezoid rule: h^2 / 12 * 0.5 * 200


def test_points_are_found_again_beside_the_line(road):
    rng = np.random.default_rng(1)
    s = rng.uniform(1, 159, 500)
    t = rng.uniform(-20, 20, 500)
    found = road.line.beside(road.line.points(s, t))
    assert np.abs(found.s_m - s).max() < 1e-9  # Newton's method ends at rounding
    assert np.abs(found.t_m - t).max() < 1e-9
    behind = road.line.beside(road.line.points(-5.0, 2.0)[None])
    assert (behind.s_m[0], behind.beyond_m[0]) == (0.0, pytest.approx(5.0))


def test_smooth_profile_keeps_values_and_slopes():
    profile = Profile.smooth([(0, 1, 0.1), (10, 3, -0.2), (30, 2, 0.0)])
    assert profile.at([0, 10, 30]) == pytest.approx([1, 3, 2])
    before = profile.slope(10 - 1e-9)
    after = profile.slope(10.0)
    assert before == pytest.approx(after, abs=1e-7) and after == pytest.approx(-0.2)


def test_a_profile_is_its_cubic_for_any_number_of_pieces():
    s = np.linspace(-5, 30, 36)
    cubic = Cubic(2.0, 1.0, 0.3, -0.02, 0.001)
    ds = s - 2.0
    expected = 1.0 + ds * (0.3 + ds * (-0.02 + ds * 0.001))
    assert np.array_equal(Profile((cubic,)).at(s), expected)
    after = Profile((cubic, Cubic(12.0, 7.0)))
    assert np.array_equal(after.at(s), np.where(s < 12.0, expected, 7.0))
    assert np.array_equal(Profile().at(s), np.zeros(36))
    assert Profile((cubic,)).at(3.0).shape == Profile().at(3.0).shape == ()


def test_places_on_one_record_are_those_of_the_whole_line(road):
    """All records of the line at once, and the places of each record alone."""
    s = np.linspace(0, 160, 33)
    whole = np.array(road.line.at(s))
    starts = [record.start_m for record in road.line.records]
    which = np.searchsorted(starts, s, side="right")
    for k in range(1, len(starts) + 1):
        assert np.array_equal(road.line.at(s[which == k]), whole[:, which == k])
    assert np.array_equal(road.line.at(s[:1, None]), whole[:, :1, None])
    assert np.array(road.line.at(np.zeros(0))).shape == (4, 0)


def test_gap_between_records_is_found(road):
    records = list(road.line.records)
    records[2] = replace(records[2], x_m=records[2].x_m + 0.5)
    (gap, back) = ReferenceLine(tuple(records)).gaps(0.01, 1e-3)
    assert gap.s_m == 75.0 and gap.gap_m == pytest.approx(0.5) and back.s_m == 125.0


def test_pose_on_a_lane_stands_on_the_surface(road):
    network = Network((road,))
    for lane in network.lanes():
        assert lane.length_m == pytest.approx(160, rel=0.03)
        pose = lane.at(70.0)
        h = 0.01
        ahead = lane.points(70 + h) - lane.points(70 - h)
        assert pose[:3, 0] == pytest.approx(ahead / np.linalg.norm(ahead), abs=1e-4)
        assert np.linalg.det(pose[:3, :3]) == pytest.approx(1) and pose[2, 2] > 0.99
        aside = lane.at(70.0, 0.5)[:3, 3]  # the surface is straight across the lane
        assert (aside - pose[:3, 3]) @ pose[:3, 2] == pytest.approx(0, abs=1e-4)
        assert network.height(*pose[:2, 3]) == pytest.approx(pose[2, 3], abs=1e-9)
    right, left = (lane for lane in network.lanes() if lane.section == 0)
    assert {right.direction, left.direction} == {1, -1}
    assert right.at(50)[:3, 0] @ left.at(left.length_m - 50)[:3, 0] < -0.99


def test_ground_is_continuous_from_road_over_pavement_to_land(road):
    network = Network((road,), land=Land(2.0, 0.5, 3))
    s = np.repeat(np.linspace(5, 155, 40), 2)
    edges = road.edges(s[::2])
    for side, edge in zip((-1, 1), edges):
        t = np.stack([edge - side * 0.01, edge + side * 0.01], 1).ravel()
        z = network.height(*road.line.points(s, t).T).reshape(-1, 2)
        assert np.abs(np.diff(z)).max() < 0.02  # 2 cm apart: a slope of 1 at most
    kerb = network.height(*road.line.points(50.0, [3.4, 3.6]).T)
    assert kerb[1] - kerb[0] == pytest.approx(0.12 - 0.2 * 0.025 + 0.2 * np.tan(0.02), abs=1e-9)
    assert network.lane_types(*road.line.points(50.0, [-3, -4, -9]).T) == [
        "driving",
        "sidewalk",
        "",
    ]


def test_free_areas_leave_out_other_roads(road):
    at = road.line.at(60.0)
    side = Road(
        "2", ReferenceLine.of(float(at.x_m), float(at.y_m), 1.9, [Stretch(60)]), (lanes(3.0),)
    )
    network = Network((road, side))
    verges = network.free_areas("verge")
    assert len([a for a in verges if a.road is road]) == 3  # the other road divides one side
    for area in verges:
        pose = area.at(area.length_m / 2, 0.5)
        assert network.lane_types(*pose[:2, 3]) == [""]
        assert network.height(*pose[:2, 3]) == pytest.approx(pose[2, 3])
    assert {a.lane for a in network.free_areas("pavement")} == {(0, 2), (0, -2)}
    with pytest.raises(ConfigError, match="verge, field"):
        network.free_areas("roof")


def test_traffic_goes_on_through_links_and_junctions():
    def straight(name, x, **links):
        return Road(name, ReferenceLine.of(x, 0, 0, [Stretch(10)]), (lanes(3.0),), **links)

    first = straight("a", 0, successor=Link("junction", "j"))
    through = straight("b", 10, junction="j", successor=Link("road", "c", "start"))
    through = replace(
        through,
        sections=(
            LaneSection(0, (), (Lane(-1, "driving", Profile((Cubic(0, 3),)), successor=-1),)),
        ),
    )
    junction = Junction("j", (Connection("a", "b", "start", ((-1, -1),)),))
    network = Network((first, through, straight("c", 20)), (junction,))
    (way,) = network.successors(network.lanes()[1].key)
    (out,) = network.successors(way)
    assert (way.road, out.road, out.number) == ("b", "c", -1)

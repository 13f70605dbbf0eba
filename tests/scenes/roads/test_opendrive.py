"""OpenDRIVE files: networks survive writing and reading, curves follow their formulas, and each
mistake is one error.
"""

from __future__ import annotations

import gzip
import re
from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.roads.checks import problems
from isethdr_scenes.roads.cubic_record import CubicRecord
from isethdr_scenes.roads.kinds import kind, names
from isethdr_scenes.roads.lateral_shape import LateralShape, ShapeRow
from isethdr_scenes.roads.markings import patches
from isethdr_scenes.roads.opendrive.file_road import Choices, file_of, file_road
from isethdr_scenes.roads.opendrive.heights import SHAPE_M
from isethdr_scenes.roads.opendrive.lanes import _known
from isethdr_scenes.roads.opendrive.overpasses import with_overpasses
from isethdr_scenes.roads.opendrive.road_file import RoadFile, numbered, read, write
from isethdr_scenes.roads.opendrive.window import moved, window
from isethdr_scenes.roads.pictures.command import roads_command
from isethdr_scenes.roads.pictures.file_plan import draw, report
from isethdr_scenes.roads.profile import Cubic, Profile
from isethdr_scenes.roads.reference_line import ReferenceLine
from PIL import Image
from scipy.integrate import quad
from typer.testing import CliRunner

from isethdr_core.errors import CatalogError, ConfigError

QUICK = ("country_hill", "motorway_ramp", "tunnel", "yard")

ROAD = """<road id="7" length="{length}" junction="-1"><link>{link}</link>
<type s="0" type="town"><speed max="{speed}" unit="{unit}"/></type>
<planView>{plan}</planView><elevationProfile>{up}</elevationProfile>
<lateralProfile>{across}</lateralProfile><lanes>{offset}<laneSection s="0">
<center><lane id="0" type="none"><roadMark sOffset="0" type="broken" color="yellow"/></lane>
</center><right>{right}</right></laneSection></lanes><objects>{objects}</objects></road>"""
LINE = '<geometry s="0" x="0" y="0" hdg="0" length="40"><line/></geometry>'
LANE = '<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'
PARTS = {
    "length": 40,
    "link": "",
    "speed": 50,
    "unit": "km/h",
    "plan": LINE,
    "up": "",
    "across": "",
    "offset": "",
    "right": LANE,
    "objects": "",
}


def written(folder, after="", **parts):
    path = folder / "road.xodr"
    text = ROAD.format(**(PARTS | parts))
    path.write_text(f'<OpenDRIVE><header name="x"/>{text}{after}</OpenDRIVE>')
    return path


def own_road(folder, **parts):
    return read(written(folder, **parts)).network.roads[0]


def painted(marks):
    """Return marks without the lengths of dashes and gaps, except for broken lines."""
    return [m if "broken" in m.kind else m._replace(dash_m=0.0, gap_m=0.0) for m in marks]


def compare(name: str, seed: int, path) -> None:
    """Compare a kind that was written and read with the original."""
    network = kind(name, seed).network
    ids = numbered(network)
    write(RoadFile(network, name, "+proj=tmerc <&>"), path)
    file = read(path)
    assert file.geo_reference == "+proj=tmerc <&>" and not file.notes
    assert file.network.land == network.land
    back = {road.name: road for road in file.network.roads}
    constant = lambda p: all(not any(piece[2:]) for piece in p.pieces)
    for road in network.roads:
        again = back[str(ids["road", road.name])]
        # a crossfall that changes is written as rows of a shape with linear interpolation between
        # them
        exact = all(map(constant, road.crossfall))
        bound = 1e-9 if exact else SHAPE_M
        assert (again.type, again.speed_limit_kmh) == (road.type, road.speed_limit_kmh)
        assert (again.right_hand, again.surface) == (road.right_hand, road.surface)
        assert (again.objects, again.structures) == (road.objects, road.structures)
        for k, section in enumerate(road.sections):
            first, last = road.span(k)
            s = np.linspace(first, last, 7)
            assert again.span(k) == pytest.approx((first, last), abs=1e-9)
            assert painted(again.sections[k].centre) == painted(section.centre)
            for lane, other in zip(section.lanes, again.sections[k].lanes, strict=True):
                assert (lane.number, lane.type, lane.raised_m) == (
                    other.number,
                    other.type,
                    other.raised_m,
                )
                linked = _known(lane, road, k)  # no link to lanes that are not there
                assert (linked.predecessor, linked.successor) == (
                    other.predecessor,
                    other.successor,
                )
                assert painted(lane.marks) == painted(other.marks)
                widths = [x.width.at(s - first) for x in (lane, other)]
                assert np.abs(widths[0] - widths[1]).max() < 1e-9
                inner, outer = road.borders(k, s)[lane.number]
                places = [r.points(s, (inner + outer) / 2) for r in (road, again)]
                assert np.abs(places[0] - places[1]).max() < bound
                assert np.abs(places[0] - places[1])[:, :2].max() < 1e-9
                headings = [r.line.at(s).heading_rad for r in (road, again)]
                assert np.abs(headings[0] - headings[1]).max() < 1e-9
    named = {str(number): what for what, number in ids.items()}
    for path_key, after in network._successors.items():
        key = path_key._replace(road=str(ids["road", path_key.road]))
        found = [k._replace(road=named[k.road][1]) for k in file.network.successors(key)]
        assert tuple(found) == after


@pytest.mark.parametrize("name", QUICK)
def test_a_kind_that_is_written_is_read_back(name, tmp_path):
    compare(name, 1, tmp_path / "road.xodr")


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_every_kind_that_is_written_is_read_back(name, tmp_path):
    for seed in range(3):
        compare(name, seed, tmp_path / "road.xodr")


def test_a_cubic_curve_has_its_arc_length_as_s():
    curve = CubicRecord(0, 5, 1, 0.4, 12.0, (0, 11, 0, -1), (0, 0, 6.0, -3.0))
    speed = lambda p: np.hypot(11 - 3 * p * p, 12 * p - 9 * p * p)
    whole = quad(speed, 0, 1, epsabs=1e-12)[0]
    assert curve.arc_length_m == pytest.approx(whole, abs=1e-11)
    for p in (0.2, 0.55, 0.9):
        s = quad(speed, 0, p, epsabs=1e-12)[0] * 12.0 / whole
        u = 11 * p - p**3
        v = 6 * p * p - 3 * p**3
        x, y, heading, _ = curve.at(s)
        # 1e-8: the parameter is interpolated between 257 points, with an error of h^4 / 384 times
        # its fourth derivative
        assert x == pytest.approx(5 + u * np.cos(0.4) - v * np.sin(0.4), abs=1e-8)
        assert y == pytest.approx(1 + u * np.sin(0.4) + v * np.cos(0.4), abs=1e-8)
        slope = np.arctan2(12 * p - 9 * p * p, 11 - 3 * p * p)
        assert heading == pytest.approx(0.4 + slope, abs=1e-8)
    h = 1e-4
    turn = float(curve.at(6 + h).heading_rad - curve.at(6 - h).heading_rad)
    # the curvature refers to arc length, while s is scaled
    assert curve.at(6.0).curvature_per_m == pytest.approx(turn / (2 * h) * 12 / whole, rel=1e-5)


def test_a_cubic_curve_is_written_and_read_back(tmp_path):
    road = kind("country_straight", 0).network.roads[0]
    curve = CubicRecord(0, 5, 1, 0.4, 12.0, (0, 11, 0, -1), (0, 0, 6.0, -3.0))
    half = replace(curve, last=0.5, length_m=6.0)
    network = kind("country_straight", 0).network
    path = tmp_path / "road.xodr"
    for one in (curve, half):
        line = ReferenceLine((one,))
        write(RoadFile(replace(network, roads=(replace(road, line=line),))), path)
        s = np.linspace(0, one.length_m, 5)
        again = read(path).network.roads[0].line.points(s)
        assert np.abs(again - line.points(s)).max() < 1e-9


def test_curves_of_a_file_follow_their_polynomials(tmp_path):
    geometry = '<geometry s="0" x="1" y="2" hdg="0" length="40">{}</geometry>'
    poly = geometry.format('<poly3 a="0" b="0" c="0.01" d="0"/>')
    road = own_road(tmp_path, plan=poly)
    x, y = road.line.points(40.0)
    # arc length of a parabola y = k x^2 in closed form
    k = 0.01
    u = float(x) - 1
    length = u / 2 * np.sqrt(1 + 4 * k * k * u * u) + np.arcsinh(2 * k * u) / (4 * k)
    assert length == pytest.approx(40.0, abs=1e-9)
    assert float(y) - 2 == pytest.approx(k * u * u, abs=1e-9)
    zero = 'aU="0" bU="{}" cU="0" dU="0" aV="0" bV="0" cV="{}" dV="0"'
    normal = geometry.format(f'<paramPoly3 {zero.format(40, 3)} pRange="normalized"/>')
    along = geometry.format(f'<paramPoly3 {zero.format(1, 3 / 1600)} pRange="arcLength"/>')
    s = np.linspace(0, 40, 9)
    lines = [own_road(tmp_path, plan=plan).line.points(s) for plan in (normal, along)]
    assert np.abs(lines[0] - lines[1]).max() < 1e-9  # the same curve, parameters p and 40 p


def test_superelevation_crossfall_shape_and_offset_are_heights_and_places(tmp_path):
    both = 'b="0" c="0" d="0"'
    across = (
        f'<superelevation s="0" a="0.02" {both}/><crossfall side="both" s="0" a="0.03" {both}/>'
    )
    offset = '<laneOffset s="10" a="0.5" b="0.1" c="0" d="0"/>'
    road = own_road(tmp_path, across=across, offset=offset)
    # the superelevation raises the left side, the crossfall lowers both sides outwards
    assert float(road.height(5, 2.0)) == pytest.approx(2 * np.tan(0.02) - 0.06, abs=1e-12)
    assert float(road.height(5, -2.0)) == pytest.approx(-2 * np.tan(0.02) - 0.06, abs=1e-12)
    inner, outer = road.borders(0, 20.0)[-1]
    assert (float(inner), float(outer)) == pytest.approx((1.5, -2.0), abs=1e-12)
    rows = (
        '<shape s="0" t="-4" a="0.2" b="-0.05" c="0" d="0"/>'
        '<shape s="20" t="-4" a="0" b="0" c="0.01" d="0"/>'
    )
    road = own_road(tmp_path, across=rows)
    half_way = (0.2 - 0.05 * 3 + 0.01 * 9) / 2
    assert float(road.height(10, -1.0)) == pytest.approx(half_way, abs=1e-12)


def test_a_shape_and_a_crossfall_together_are_written(tmp_path):
    network = kind("country_curve", 2).network
    bump = Profile((Cubic(-9.0, 0.0, 0.0, 0.002), Cubic(0.0, 0.162, 0.01)))
    shape = LateralShape((ShapeRow(0.0, bump), ShapeRow(200.0, Profile.constant(0.1))))
    road = replace(network.roads[0], shape=shape)
    write(RoadFile(replace(network, roads=(road,))), tmp_path / "road.xodr")
    again = read(tmp_path / "road.xodr").network.roads[0]
    s, t = np.meshgrid(np.linspace(0, road.length_m, 57), np.linspace(-4, 4, 9))
    assert np.abs(again.height(s, t) - road.height(s, t)).max() < SHAPE_M


def test_borders_are_widths(tmp_path):
    border = '<lane id="{}" type="driving"><border sOffset="{}" a="{}" b="{}" c="0" d="0"/></lane>'
    right = border.format(-1, 0, -3, -0.01) + border.format(-2, 0, -6, 0.02)
    road = own_road(tmp_path, right=right)
    widths = [float(lane.width.at(10.0)) for lane in road.sections[0].right]
    assert widths == pytest.approx([3.1, 6 - 0.2 - 3.1], abs=1e-12)


def test_words_of_the_format_are_mapped_and_noted(tmp_path):
    lane = LANE.replace('type="driving"', 'type="bus"')
    lane += LANE.replace('id="-1" type="driving"', 'id="-2" type="walking"')
    objects = '<object id="3" type="tree" s="1" t="2"/>'
    file = read(written(tmp_path, right=lane, objects=objects, speed=30, unit="mph"))
    road = file.network.roads[0]
    assert [x.type for x in road.sections[0].right] == ["driving", "sidewalk"]
    assert road.speed_limit_kmh == pytest.approx(48.28032)
    assert road.sections[0].centre[0][:2] == ("broken", "yellow")
    told = "\n".join(file.notes)
    assert "'bus' is taken as 'driving': once (road 7, s = 0 m, lane -1)" in told
    assert "'walking' is taken as 'sidewalk'" in told and "'tree' are left out" in told


def test_contents_without_effect_are_noted(tmp_path):
    tag = '<object id="{}" type="{}" subtype="{}" s="20" t="-1" length="{}" width="{}">{}</object>'
    row = '<repeat s="20" length="10" distance="5" tStart="-1" tEnd="-1"/>'
    objects = tag.format(1, "barrier", "trafficCone", 0.3, 0.3, row)
    objects += tag.format(2, "crosswalk", "", 3, 0, "")
    objects += '<object id="3" type="roadMark" subtype="arrowLeft" s="20" t="-1"/>'
    surface = '<surface><CRG file="a.crg"/></surface>'
    path = written(tmp_path, objects=objects, length=40.5)
    text = path.read_text().replace("</road>", surface + "</road>")
    path.write_text(text.replace("/>", '><offset x="5" hdg="0.1"/></header>', 1))
    file = read(path)
    assert [item.kind for item in file.network.roads[0].objects] == ["barrier"]
    told = "\n".join(file.notes)
    assert "of a row of objects (<repeat>) only the first one is kept: once (road 7, obj" in told
    assert "crosswalks without length or width are left out: once (road 7, object 2)" in told
    assert "arrows without length or width are left out: once (road 7, object 3)" in told
    assert "a road surface from a CRG file is left out: once (road 7)" in told
    assert "a road of another length than its <planView>" in told
    assert "the turn of the header's <offset> is left out" in told
    # a small difference, and an offset without a turn, change nothing
    assert not read(written(tmp_path, length=40.05)).notes
    path.write_text(path.read_text().replace("/>", '><offset x="5"/></header>', 1))
    assert not read(path).notes


def test_a_packed_file_is_read_and_a_damaged_one_is_one_error(tmp_path):
    packed = gzip.compress(written(tmp_path).read_bytes())
    path = tmp_path / "packed.xodr"
    path.write_bytes(packed)
    assert read(path).network.roads[0].name == "7"
    path.write_bytes(packed[:-20])
    with pytest.raises(CatalogError, match="packed.xodr cannot be read .*; expected an OpenDRIVE"):
        read(path)


def test_a_file_without_a_lane_for_the_camera_is_checked_and_another_lane_is_named(tmp_path):
    path = written(tmp_path, right=LANE.replace('"driving"', '"biking"'))
    lines = report(path)
    words = "no driving lane of 8 m .*; type for example scene.road_id=7 scene.lane_id=-1$"
    assert re.match("camera: " + words, lines[-1])
    assert draw(path, tmp_path / "plan.png").is_file()
    with pytest.raises(ConfigError, match=words):
        file_road(path, 1, Choices())
    assert file_road(path, 1, Choices("7", -1)).base.start.number == -1
    short = written(tmp_path, length=7, plan=LINE.replace('length="40"', 'length="7"'))
    assert re.match("camera: " + words, report(short)[-1])
    assert draw(short, tmp_path / "plan.png").is_file()
    assert file_road(short, 1, Choices("7", -1)).base.start.number == -1
    path = written(tmp_path, right=LANE.replace('"driving"', '"sidewalk"'))
    with pytest.raises(ConfigError, match="no other lane for it; .* type another scene.road"):
        file_road(path, 1, Choices())


OBJECT = '<object id="1" type="roadMark" s="20" t="-1.75" {}/>'


def test_marks_across_a_road_and_arrows_have_the_direction_that_the_file_states(tmp_path):
    told = 'subtype="signalLines" hdg="1.5708" length="3.2" width="0.4"'
    (line,) = own_road(tmp_path, objects=OBJECT.format(told)).objects
    assert (line.kind, line.length_m, line.width_m, line.heading_rad) == ("stop_line", 0.4, 3.2, 0)
    # an arrow against s, told by its heading, by its orientation, or by both
    for heading, orientation in ((np.pi, "none"), (0.0, "-"), (np.pi, "-")):
        told = f'subtype="arrowStraight" hdg="{heading!r}" orientation="{orientation}" length="4"'
        road = own_road(tmp_path, objects=OBJECT.format(told + ' width="1"'))
        _, head = [patch.st_m for patch in patches(road) if patch.name == "arrow"]
        assert head[1] == pytest.approx(np.array([[18.0, -1.75]] * 2))
    told = 'subtype="arrowStraight" hdg="1.5707963" length="4" width="1"'
    road = own_road(tmp_path, objects=OBJECT.format(told))
    t = np.concatenate([p.st_m[..., 1].ravel() for p in patches(road) if p.name == "arrow"])
    assert (t.min(), t.max()) == pytest.approx((-3.75, 0.25))


def test_a_profile_is_constant_before_its_first_element(tmp_path):
    offset = '<laneOffset s="10" a="0.5" b="0" c="0.03" d="-0.001"/>'
    road = own_road(tmp_path, offset=offset)
    assert road.lane_offset.at([0.0, 10.0, 20.0]) == pytest.approx([0.5, 0.5, 2.5])


def test_a_road_without_a_type_has_the_limit_of_its_lanes_and_level_lanes_are_noted(tmp_path):
    lane = LANE.replace("</lane>", '<speed sOffset="0" max="20"/></lane>')
    across = '<superelevation s="0" a="0.05" b="0" c="0" d="0"/>'
    path = written(tmp_path, right=lane.replace('"driving"', '"driving" level="true"'))
    text = path.read_text()
    path.write_text(text[: text.index("<type")] + text[text.index("<planView") :])
    file = read(path)
    assert file.network.roads[0].speed_limit_kmh == pytest.approx(72.0) and not file.notes
    level = LANE.replace('"driving"', '"driving" level="true"')
    tilted = written(tmp_path, right=level, across=across)
    assert any("level lanes follow the tilt" in note for note in read(tilted).notes)


def test_a_link_to_the_side_of_a_road_and_a_reversed_lane_are_noted(tmp_path):
    other = ROAD.format(**PARTS).replace('id="7"', 'id="9"').replace('y="0"', 'y="70"')
    lane = LANE.replace("<width", '<link><successor id="-1"/></link><width')
    link = '<successor elementType="road" elementId="9" elementS="20" elementDir="+"/>'
    right = lane.replace("><link", ' direction="reversed"><link')
    file = read(written(tmp_path, after=other, link=link, right=right))
    assert file.network.roads[0].successor is None
    told = "\n".join(file.notes)
    assert "links to the side of a road" in told and "direction 'reversed' is left out" in told


SECOND = '<geometry s="{s}" x="{x}" y="0" hdg="0" length="20"><line/></geometry>'
MISTAKES = {
    "gap": (
        {"plan": LINE + SECOND.format(s=40, x=40.5)},
        r"road 7: geometry 2 at s = 40.00 m starts 0.500 m .* at most 0.1 m",
    ),
    "s": (
        {"plan": LINE + SECOND.format(s=43, x=40)},
        r"road 7: geometry 2 at s = 43.00 m states an s 3.000 m",
    ),
    "form": ({"plan": LINE.replace("line", "helix")}, "road 7, geometry 1: it holds <helix>"),
    "none": ({"plan": ""}, "road 7: it has no reference line"),
    "number": ({"plan": LINE.replace('x="0"', 'x="zero"')}, "geometry 1: 'x' .* is 'zero'"),
    "nan": ({"plan": LINE.replace('x="0"', 'x="nan"')}, "'x' of <geometry> is 'nan'"),
    "missing": ({"plan": LINE.replace('x="0"', "")}, "<geometry> has no attribute 'x'"),
    "type": (
        {"right": LANE.replace("driving", "drivin")},
        "road 7, s = 0 m, lane -1: the lane type 'drivin' is not known; did you mean 'driving'",
    ),
    "width": (
        {"right": LANE.replace('b="0"', 'b="-0.1"')},
        r"lane -1: its width is -0.500 m 40.00 m behind",
    ),
    "lanes": ({"right": LANE.replace('"-1"', '"-2"')}, "lane -2: expected lane -1"),
    "empty": ({"right": ""}, "road 7: the section at s = 0 m has no lanes"),
    "junction": (
        {"link": '<successor elementType="junction" elementId="9"/>'},
        "road 7: its successor is junction 9, which the file does not hold",
    ),
    "road": (
        {"link": '<predecessor elementType="road" elementId="3" contactPoint="end"/>'},
        "road 7: its predecessor is road 3",
    ),
    "contact": (
        {"link": '<predecessor elementType="road" elementId="7" contactPoint="top"/>'},
        "contactPoint of its predecessor is 'top'; expected start or end",
    ),
    "wide": (
        {"right": LANE.replace('d="0"', 'd="99"')},
        r"lane -1: its width is 6\.34e\+06 m 40\.00 m behind .*; expected 1000 m or less",
    ),
    "bend": (
        {"plan": LINE.replace("<line/>", '<spiral curvStart="1e9" curvEnd="0"/>')},
        r"geometry 1: its curvature is 1e\+09 /m over 40 m, .*; expected a smaller curvature",
    ),
    "long": (
        {"plan": LINE.replace('"40"', '"1e9"')},
        r"'length' of <geometry> is '1e9'; expected a number from -1e\+06 to 1e\+06",
    ),
    "far": ({"plan": LINE.replace('x="0"', 'x="1e300"')}, "'x' of <geometry> is '1e300'; expected"),
    "steep": ({"up": '<elevation s="0" a="0" b="1e300" c="0" d="0"/>'}, "'b' of <elevation> is"),
    "unit": ({"unit": "knots"}, "the unit of its speed is 'knots'; expected one of m/s"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_one_error_that_names_file_and_road(name, tmp_path):
    parts, words = MISTAKES[name]
    with pytest.raises(CatalogError, match=words) as told:
        read(written(tmp_path, **parts))
    assert "road.xodr" in str(told.value) and "\n" not in str(told.value)


def test_lanes_of_linked_roads_that_do_not_meet_are_one_error(tmp_path):
    network = kind("motorway_ramp", 1).network
    path = tmp_path / "road.xodr"
    write(RoadFile(network), path)
    text = path.read_text()
    starts = [m.start() for m in re.finditer("<planView>", text)]
    at = text.index(' x="', starts[1]) + 4  # move the second road by 2 m sideways
    end = text.index('"', text.index(' y="', at) + 4)
    first = text.index(' y="', at) + 4
    path.write_text(text[:first] + repr(float(text[first:end]) + 2.0) + text[end:])
    words = r"road \d+: lane -?\d ends at s = .* m 2.000 m beside lane -?\d of road \d+, .* 0.1 m"
    with pytest.raises(CatalogError, match=words):
        read(path)


@pytest.mark.parametrize(
    "text, words",
    [
        ("<OpenDRIVE><road", "not well-formed XML"),
        ("<osm/>", "root element <osm>; expected <OpenDRIVE>"),
        ("<OpenDRIVE/>", "holds no roads"),
        (None, "cannot be read"),
    ],
)
def test_another_file_is_one_error(text, words, tmp_path):
    path = tmp_path / "road.xodr"
    if text is not None:
        path.write_text(text)
    with pytest.raises(CatalogError, match=words):
        read(path)


def test_a_connection_to_a_missing_road_is_one_error(tmp_path):
    after = (
        '<junction id="4"><connection id="0" incomingRoad="7" connectingRoad="8"'
        ' contactPoint="start"/></junction>'
    )
    with pytest.raises(CatalogError, match="junction 4: a connection names road 8"):
        read(written(tmp_path, after))


def test_the_part_of_a_network_about_a_place_keeps_its_poses(tmp_path):
    network = kind("city_crossing", 1).network
    whole = network.roads[0]
    middle = whole.line.points(40.0)
    part = moved(window(network, middle, 60.0), np.array([1000.0, -200.0]))
    cut = part.road(whole.name)
    assert cut.length_m < whole.length_m - 50 and cut.predecessor == whole.predecessor
    assert cut.successor is None
    here = cut.line.beside(middle[None] + [1000.0, -200.0])
    s = float(here.s_m[0])
    for t in (-3.0, 0.0, 4.0):
        moved_by = cut.points(s, t) - whole.points(40.0, t)
        assert moved_by == pytest.approx([1000.0, -200.0, 0.0], abs=1e-9)
    assert not problems(part)
    names_kept = {road.name for road in part.roads}
    for junction in part.junctions:
        assert all({c.incoming, c.connecting} <= names_kept for c in junction.connections)


@pytest.mark.parametrize("start_m", [349.0, -1.0])
def test_a_road_with_one_near_place_keeps_a_stretch(tmp_path, start_m):
    """A place is sampled every 2 m, so the circle may hold the first or the last place alone."""
    length = 300 if start_m > 0 else 350.5
    line = f'<geometry s="0" x="{start_m}" y="0" hdg="0" length="{length}"><line/></geometry>'
    network = read(written(tmp_path, plan=line, length=length)).network
    at = np.array([0.0 if start_m > 0 else 698.0, 0.0])
    (cut,) = window(network, at, 350.0).roads
    assert 0 < cut.length_m < 5
    assert min(np.linalg.norm(cut.line.points([0.0, cut.length_m]) - at, axis=1)) < 350


def test_marks_of_a_cut_road_end_at_the_cut(tmp_path):
    """The first 651 m are cut off. A line is painted from the cut on, and dashes keep their places
    on the road.
    """
    line = '<geometry s="0" x="-1000" y="0" hdg="0" length="2000"><line/></geometry>'
    solid = '<roadMark sOffset="0" type="solid" color="white"/>'
    gone = '<roadMark sOffset="0" type="none"/><roadMark sOffset="10" type="solid"/>'
    lanes = LANE.replace("</lane>", f"{solid}</lane>")
    lanes += LANE.replace("-1", "-2").replace("</lane>", f"{gone}</lane>")
    network = read(written(tmp_path, plan=line, length=2000, right=lanes)).network
    (cut,) = window(network, np.zeros(2), 350.0).roads
    whole = [p.st_m[..., 0] for p in patches(network.roads[0])]
    first = float(network.roads[0].line.beside(cut.line.points([0.0]))[0][0])
    parts = [p.st_m[..., 0] for p in patches(cut)]
    assert min(s.min() for s in parts) == 0.0 and max(s.max() for s in parts) <= cut.length_m
    starts = {round(float(s.min()), 6) for s in whole if s.max() - s.min() < 10}
    dashes = {round(float(s.min() + first), 6) for s in parts if s.max() - s.min() == 3.0}
    assert len(dashes) > 70 and dashes <= starts


def test_a_side_that_a_section_lacks_goes_on_from_the_section_before(tmp_path):
    """A section may describe one side alone (singleSide); the lanes of the other one continue."""
    taper = '<width sOffset="0" a="3.5" b="0.01" c="0" d="0"/>'
    left = f'<left><lane id="1" type="driving">{taper}</lane></left>'
    path = written(tmp_path)
    text = path.read_text().replace("<right>", f"{left}<right>")
    one_side = f'<laneSection s="{{}}" singleSide="true"><right>{LANE}</right></laneSection>'
    path.write_text(text.replace("</lanes>", one_side.format(15) + "</lanes>"))
    road = read(path).network.roads[0]
    assert [[lane.number for lane in s.lanes] for s in road.sections] == [[1, -1], [1, -1]]
    assert road.borders(1, 20.0)[1][1] == pytest.approx(3.5 + 0.01 * 20)
    first, second = (section.left[0] for section in road.sections)
    assert (first.successor, second.predecessor) == (1, 1)
    # both sides may start at the same place, each in a section of its own
    path.write_text(
        text.replace("<right>", "<nothing>")
        .replace("</right>", "</nothing>")
        .replace('<laneSection s="0">', '<laneSection s="0" singleSide="true">')
        .replace("</lanes>", one_side.format(0) + "</lanes>")
    )
    (section,) = read(path).network.roads[0].sections
    assert [lane.number for lane in section.lanes] == [1, -1]


def test_a_road_high_over_another_gets_a_bridge_that_the_file_does_not_state():
    network = kind("bridge", 1).network
    below, above = network.roads
    (span,) = above.structures
    bare = replace(network, roads=(below, replace(above, structures=())))
    found, changed = with_overpasses(bare)
    assert changed == ("above",) and not found.road("below").structures
    (made,) = found.road("above").structures
    # the bridge of the kind leaves the same space for the embankments
    assert made.start_m == pytest.approx(span.start_m, abs=4.0)
    assert made.length_m == pytest.approx(span.length_m, abs=8.0)
    assert with_overpasses(network) == (network, ())


def test_the_camera_starts_on_the_longest_lane_or_where_it_is_told(tmp_path):
    network = kind("country_t_junction", 3).network
    path = tmp_path / "road.xodr"
    write(RoadFile(network), path)
    longest = max((lane for lane in network.lanes()), key=lambda lane: lane.length_m)
    base = file_road(path, 1, Choices()).base
    assert base.lane.length_m == pytest.approx(longest.length_m, abs=1e-6)
    assert base.start_m == pytest.approx(20.0) and not base.lit and not base.urban
    told = file_road(path, 1, Choices("2", -1, 50.0, True, True, 33.0)).base
    assert told.start == ("2", 0, -1) and told.lit and told.urban
    assert float(told.lane.along_road(told.start_m)) == pytest.approx(50.0, abs=1e-6)
    assert told.speed_limit_kmh == told.network.roads[0].speed_limit_kmh == 33.0
    for choices, words in (
        (Choices("77"), "no such road"),
        (Choices("2", 9), r"has lanes -2, -1, 1, 2 there; type for example scene.lane_id=-2"),
        (Choices("2", None, 900.0), r"is \d+\.\d m long; type for example scene.s_m="),
        (Choices(s_m=3.0), "scene.s_m is 3 without a road"),
    ):
        with pytest.raises(ConfigError, match=words):
            file_road(path, 1, choices)


def test_a_written_kind_starts_where_the_kind_starts(tmp_path):
    base = kind("city_crossing", 2)
    write(file_of(base), tmp_path / "road.xodr")
    again = file_road(tmp_path / "road.xodr", 2, Choices()).base
    assert again.pose() == pytest.approx(base.pose(), abs=SHAPE_M)
    assert (again.name, again.lit, again.urban) == (base.name, base.lit, base.urban)


@pytest.mark.parametrize(
    ("code", "value", "words"),
    [
        ("start", "-0.0", r"isethdr\.start is '-0\.0'; expected the id of a road, a lane and"),
        ("start", "1 -1 nan", r"isethdr\.start is '1 -1 nan'; expected the id of a road"),
        ("land", "abc", r"isethdr\.land is 'abc'; expected relief and depth of the ditch in m"),
        ("land", "inf 0 3 meadow", r"isethdr\.land is 'inf 0 3 meadow'; expected relief"),
        ("land", "1 0 3 medow", r"the material 'medow'; expected .*; did you mean 'meadow'\?"),
        ("land", "1 0 -3 meadow", r"isethdr\.land is '1 0 -3 meadow'; expected relief"),
    ],
)
def test_a_damaged_entry_of_isethdr_is_one_error_that_names_it(code, value, words, tmp_path):
    path = tmp_path / "road.xodr"
    write(file_of(kind("village", 2)), path)
    text, count = re.subn(
        f'(code="isethdr.{code}" value=)"[^"]*"', rf'\1"{value}"', path.read_text()
    )
    assert count == 1
    path.write_text(text)
    with pytest.raises(CatalogError, match=words) as told:
        file_road(path, 1, Choices())
    assert "road.xodr" in str(told.value) and "\n" not in str(told.value)


def test_a_lane_of_the_camera_far_from_its_road_is_one_error(tmp_path):
    path = written(tmp_path, right=LANE.replace("3.5", "900"))
    with pytest.raises(CatalogError, match=r"road 7, lane -1: its middle is 450 m from the ref"):
        file_road(path, 1, Choices())


def test_commands_check_draw_and_write_files(tmp_path):
    path = tmp_path / "way.xodr"
    run = CliRunner().invoke
    assert run(roads_command, ["write", "yard", str(path), "--seed", "1"]).exit_code == 0
    told = run(roads_command, ["check", str(path)]).output
    assert "1 road," in told and "gaps: none" in told and "scene.road_id=1" in told
    assert run(roads_command, ["sheet", str(path)]).exit_code == 0
    picture = np.asarray(Image.open(path.with_suffix(".png")))
    assert (picture == (220, 20, 20)).all(-1).sum() > 20  # the camera's mark
    wrong = run(roads_command, ["sheet", str(path.with_suffix(".png"))]).exception
    assert isinstance(wrong, CatalogError) and "a road file that ends in .xodr" in str(wrong)

"""The start of an OpenSCENARIO file as a street: places, headings, categories and clear errors."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.placing import rules
from isethdr_scenes.roads.kinds import kind
from isethdr_scenes.roads.opendrive.file_road import file_of
from isethdr_scenes.roads.opendrive.road_file import write
from isethdr_scenes.scenario.scenario_file import read
from isethdr_scenes.street import Street
from isethdr_scenes.traffic.later_layout import TURNS_IN_M

from isethdr_core.errors import CatalogError, ConfigError

BOX = (
    '<BoundingBox><Center x="{}" y="0" z="0.8"/><Dimensions length="{}" width="1.8" height="1.5"/>'
)
CAR = f'<Vehicle name="c" vehicleCategory="car">{BOX.format(1.4, 4.5)}</BoundingBox></Vehicle>'
WALKER = '<Pedestrian name="w" pedestrianCategory="pedestrian"/>'
LANE = '<LanePosition roadId="1" laneId="{}" s="{}" offset="{}">{}</LanePosition>'
EMPTY = dict(
    vehicles_per_km=0.0,
    parked_share=0.0,
    people_per_km=0.0,
    riders_per_km=0.0,
    animals_per_km=0.0,
    plants_per_km=0.0,
)


def file_with(folder, entities, parameters="", catalogs="", story=""):
    """Write a scenario of {name: (entity, position)} on a straight road, and return its path."""
    (folder / "roads").mkdir(exist_ok=True)
    write(file_of(kind("country_straight", 1)), folder / "roads" / "way.xodr")
    objects = "".join(
        f'<ScenarioObject name="{name}">{entity}</ScenarioObject>'
        for name, (entity, _) in entities.items()
    )
    starts = "".join(
        f'<Private entityRef="{name}"><PrivateAction><TeleportAction><Position>{position}'
        "</Position></TeleportAction></PrivateAction></Private>"
        for name, (_, position) in entities.items()
        if position
    )
    path = folder / "cut_in.xosc"
    path.write_text(
        f"<OpenSCENARIO><ParameterDeclarations>{parameters}</ParameterDeclarations>"
        f"<CatalogLocations>{catalogs}</CatalogLocations>"
        '<RoadNetwork><LogicFile filepath="roads/way.xodr"/></RoadNetwork>'
        f"<Entities>{objects}</Entities><Storyboard><Init><Actions>{starts}</Actions></Init>"
        f"{story}</Storyboard></OpenSCENARIO>"
    )
    return path


def standing(street):
    return {one.name: one for one in street.plan().standing if one.foot.role == "scenario"}


@pytest.mark.parametrize("form", ["roads\\way.xodr", "file://{}/roads/way.xodr", "roads/way.xodr"])
def test_paths_of_windows_and_urls_are_paths(tmp_path, form):
    path = file_with(tmp_path, {"Ego": (CAR, LANE.format(-1, 50, 0, ""))})
    path.write_text(path.read_text().replace("roads/way.xodr", form.format(tmp_path)))
    assert read(path).road_file == tmp_path / "roads" / "way.xodr"


def test_entities_stand_where_the_scenario_puts_them(tmp_path):
    parameter = '<ParameterDeclaration name="S" parameterType="double" value="50"/>'
    turned = '<Orientation type="relative" h="0.5"/>'
    path = file_with(
        tmp_path,
        {
            "Ego": (CAR, LANE.format(-1, "$S", 0.2, "")),
            "Lead": (CAR, LANE.format(-1, "${$S + 2 * 10}", 0, "")),
            "Oncoming": (CAR, LANE.format(1, 120, 0, turned)),
            "Walker": (WALKER, '<RoadPosition roadId="1" s="80" t="-6"/>'),
            "Bus": (CAR.replace("car", "bus"), '<WorldPosition x="150" y="-1.8" h="0.1"/>'),
            "Box": ('<MiscObject name="b"/>', LANE.format(-1, 90, 0, "")),
            "Later": (CAR, LANE.format(1, 320, 0, "")),
            "Never": (CAR, ""),
        },
        parameter,
        story='<Story name="s"/>',
    )
    street = Street(seed=1, scenario=str(path), **EMPTY)
    street.check_files()
    assert [p.name for p in street.input_files()] == ["cut_in.xosc", "way.xodr"]
    base = street.base()
    road = base.network.road("1")
    # the reference point is the rear axle; the middle of the box is 1.4 m ahead of it
    own = base.pose()
    middle = float(base.lane.offset_m(51.4))
    assert road.line.beside(own[None, :2, 3])[0][0] == pytest.approx(51.4, abs=1e-6)
    assert road.line.beside(own[None, :2, 3])[1][0] == pytest.approx(middle + 0.2, abs=1e-6)
    found = standing(street)
    assert set(found) == {"Lead", "Oncoming", "Walker", "Bus"}
    heading = float(road.line.at(0).heading_rad)
    seen = {}
    for name, one in found.items():
        s, t, _ = (float(v[0]) for v in road.line.beside(one.pose[None, :2, 3]))
        seen[name] = s, t, one.foot.heading_rad - heading
    assert seen["Lead"] == pytest.approx((71.4, middle, 0.0), abs=1e-6)
    # on a left lane, traffic drives against s, and a relative heading counts from that direction
    turn = np.pi + 0.5
    aside = -middle + 1.4 * np.sin(turn)
    assert seen["Oncoming"][:2] == pytest.approx((120 + 1.4 * np.cos(turn), aside), abs=1e-6)
    assert np.cos(seen["Oncoming"][2] - turn) == pytest.approx(1.0, abs=1e-9)
    assert seen["Walker"] == pytest.approx((80.0, -6.0, 0.0), abs=1e-6)
    assert found["Bus"].foot.heading_rad == pytest.approx(0.1)
    assert found["Lead"].foot.thing.group == "car" and found["Bus"].foot.thing.group == "bus"
    assert found["Lead"].foot.thing.size_m[0] == pytest.approx(4.5, abs=0.4)  # nearest size
    layout = street.plan()
    assert not (rules.overlaps(layout) + rules.off_the_ground(layout) + rules.misplaced(layout))
    told = "\n".join(street._start.notes)
    for words in ("MiscObject are left out: once (Box)", "(Later)", "(Never)", "happens after"):
        assert words in told
    other = Street(seed=1, scenario=str(path), scenario_ego="Oncoming", **EMPTY)
    turned_pose = other.base().pose()
    # the crown of the road tilts the car by 2.5 %, and its axis is turned within the tilted plane
    assert turned_pose[:2, 0] == pytest.approx(
        [np.cos(heading + turn), np.sin(heading + turn)], abs=0.025**2
    )


def test_a_car_that_starts_at_an_angle_turns_into_its_lane_as_it_drives(tmp_path):
    position = LANE.format(-1, 50, 0, '<Orientation type="relative" h="0.2"/>')
    # a lane from an expression, which is a whole number
    number = '<ParameterDeclaration name="N" value="-2"/>'
    position = position.replace('laneId="-1"', 'laneId="${$N + 1}"')
    street = Street(scenario=str(file_with(tmp_path, {"Ego": (CAR, position)}, number)), **EMPTY)
    start = street.base().pose()
    heading = lambda pose: float(np.arctan2(pose[1, 0], pose[0, 0]))
    lane = heading(street.base().lane.at(street.base().start_m))
    for time_s in (0.01, 0.5, 3.0):
        pose = street.moment(time_s).own_pose
        way = float(np.linalg.norm(pose[:3, 3] - start[:3, 3]))
        wanted = 0.2 * max(1 - way / TURNS_IN_M, 0.0)
        assert heading(pose) - lane == pytest.approx(wanted, abs=1e-3)
    assert way > TURNS_IN_M


def test_entities_on_a_bridge_stand_on_its_deck(tmp_path):
    base = kind("bridge", 1)
    deck = base.network.road("above")
    middle = deck.structures[0].start_m + 20.0
    on = lambda s: deck.points(s, -1.8)
    world = '<WorldPosition x="{:.3f}" y="{:.3f}" {}/>'
    entities = {
        "Ego": (CAR, f'<LanePosition roadId="2" laneId="-1" s="{base.start_m}"/>'),
        "Road": (CAR, f'<RoadPosition roadId="2" s="{middle}" t="-1.8"/>'),
        "High": (CAR, world.format(*on(middle + 9)[:2], f'z="{on(middle + 9)[2]:.2f}"')),
        "Low": (CAR, world.format(*on(middle + 3)[:2], 'z="0"')),
    }
    path = file_with(tmp_path, entities)
    write(file_of(base), tmp_path / "roads" / "way.xodr")
    found = standing(Street(scenario=str(path), **EMPTY))
    assert {name: one.foot.level for name, one in found.items()} == {"Road": 1, "High": 1, "Low": 0}
    for name, one in found.items():
        s, t, _ = (v[0] for v in deck.line.beside(one.pose[None, :2, 3]))
        above = float(one.pose[2, 3] - deck.height(s, t))
        assert abs(above) < 0.1 if name != "Low" else above < -3.0


def test_entities_of_catalogs_are_resolved_with_their_parameters(tmp_path):
    (tmp_path / "catalogs").mkdir()
    entry = CAR.replace('"4.5"', '"$L"').replace(
        "<Bounding",
        '<ParameterDeclarations><ParameterDeclaration name="L" value="3.0"/>'
        "</ParameterDeclarations><Bounding",
        1,
    )
    (tmp_path / "catalogs" / "cars.xosc").write_text(
        f'<OpenSCENARIO><Catalog name="Cars">{entry}</Catalog></OpenSCENARIO>'
    )
    where = '<VehicleCatalog><Directory path="catalogs"/></VehicleCatalog>'
    assign = (
        '<CatalogReference catalogName="Cars" entryName="{}"><ParameterAssignments>'
        '<ParameterAssignment parameterRef="L" value="{}"/></ParameterAssignments>'
        "</CatalogReference>"
    )
    entities = {
        "Hero": (assign.format("c", 4.0), LANE.format(-1, 50, 0, "")),
        "Gone": (assign.format("d", 4.0), LANE.format(-1, 90, 0, "")),
    }
    scenario = read(file_with(tmp_path, entities, catalogs=where))
    assert scenario.ego.name == "Hero" and scenario.ego.size_m == (4.0, 1.8, 1.5)
    assert "cars.xosc" in {file.name for file in scenario.files}
    assert "catalogs that were not found are left out: once (Cars d)" in scenario.notes[0]


def test_parameters_may_use_those_before_them(tmp_path):
    declare = '<ParameterDeclaration name="{}" parameterType="double" value="{}"/>'
    parameters = declare.format("S", 50) + declare.format("D", "${$S + 30}")
    sums = parameters + declare.format("E", "${$D * 2}")
    path = tmp_path / "sums.xosc"
    file_with(tmp_path, {"Ego": (CAR, LANE.format(-1, "${$E - $D}", 0, ""))}, sums).rename(path)
    Street(scenario=str(path)).check_files()
    text = path.read_text().replace(declare.format("S", 50), "")
    path.write_text(text)
    with pytest.raises(CatalogError, match="'s' of <LanePosition> is .*; expected a finite number"):
        Street(scenario=str(path)).check_files()


@pytest.mark.parametrize(
    "position, words",
    [
        (LANE.format(-1, 900, 0, ""), "start of Ego: its s is 900 m, but road 1 is"),
        (LANE.format(7, 9, 0, ""), "it names lane 7, but road 1 has lanes -2, -1, 1, 2 at s = 9 m"),
        (LANE.replace('"1"', '"8"').format(-1, 9, 0, ""), "it names road 8, .* its 1 roads"),
        ('<WorldPosition x="50" y="90"/>', r"at \(51.4, 90.0\) m, where no road of .*way.xodr is"),
        ("<RoutePosition/>", "it is a RoutePosition; expected a LanePosition"),
        (LANE.format(-1, "$Z", 0, ""), r"'s' of <LanePosition> is '\$Z'; expected a finite number"),
    ],
)
def test_a_start_that_cannot_be_is_one_error(position, words, tmp_path):
    path = file_with(tmp_path, {"Ego": (CAR, position)})
    with pytest.raises(CatalogError, match=words):
        Street(scenario=str(path)).check_files()


def test_mistakes_of_files_and_fields_are_one_error(tmp_path):
    ego = (CAR, LANE.format(-1, 50, 0, ""))
    path = str(file_with(tmp_path, {"Ego": ego, "Twin": (CAR, LANE.format(-1, 52, 0, ""))}))
    with pytest.raises(ConfigError, match="'Twin' of the scenario stands at .* do not overlap"):
        Street(scenario=path, **EMPTY).plan()
    with pytest.raises(CatalogError, match="no entity 'Car'.* one of Ego, Twin; .*ego=Ego"):
        Street(scenario=path, scenario_ego="Car").check_files()
    with pytest.raises(CatalogError, match="gone.xosc cannot be read"):
        Street(scenario=str(tmp_path / "gone.xosc")).check_files()
    for fields, words in (
        (dict(scenario=path, s_m=4.0), "scene.s_m is set beside scene.scenario"),
        (dict(scenario=path, road="village"), "'village' beside scene.scenario"),
        (dict(scenario_ego="Ego"), "no scenario is set"),
    ):
        with pytest.raises(ConfigError, match=words):
            Street(**fields)
    (tmp_path / "roads" / "way.xodr").unlink()
    with pytest.raises(CatalogError, match="way.xodr cannot be read"):
        Street(scenario=path).check_files()

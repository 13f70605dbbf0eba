"""Traffic by SUMO: vehicles on their lanes and within speed limits, lamps as reported, the same
traffic from the same seed.
"""

from __future__ import annotations

import gzip
import os
import tempfile
from dataclasses import replace
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from isethdr_scenes.placing import rules
from isethdr_scenes.placing.plan import Layout
from isethdr_scenes.placing.shortage import Shortage
from isethdr_scenes.roads.kinds import kind, names
from isethdr_scenes.roads.opendrive.elements import opened
from isethdr_scenes.roads.opendrive.file_road import file_of
from isethdr_scenes.roads.opendrive.road_file import write
from isethdr_scenes.street import Street
from isethdr_scenes.traffic.sumo import configuration, own_files
from isethdr_scenes.traffic.sumo.choice import check_traffic, from_files
from isethdr_scenes.traffic.sumo.configuration import Option
from isethdr_scenes.traffic.sumo.net import read
from isethdr_scenes.traffic.sumo.overlaps import fewest, swept, touching
from isethdr_scenes.traffic.sumo.own_files import (
    TRIPS,
    _nobody,
    _stated_s,
    _types,
    check_own,
    driven,
)
from isethdr_scenes.traffic.sumo.program import call
from isethdr_scenes.traffic.sumo.trace import STEP_S, Signal, seconds
from isethdr_scenes.traffic.sumo.trace import read as read_trace
from isethdr_scenes.traffic.sumo.traffic import check_shortage

from isethdr_core.errors import CatalogError, ConfigError

EMPTY = dict(people_per_km=0.0, plants_per_km=0.0, animals_per_km=0.0, parked_share=0.0)
ON_LANE_M = 0.05  # error of SUMO's lanes: polylines with a point per metre, rounded to 1 cm


def installed() -> bool:
    try:
        metadata.version("eclipse-sumo")
    except metadata.PackageNotFoundError:
        return False
    return True


needs_sumo = pytest.mark.skipif(not installed(), reason="needs the extra `traffic`")


def there(layout: Layout) -> Layout:
    """Return the layout without absent things, and without things on bridges.

    The ground of a thing on a bridge would be that below the bridge.
    """
    kept = [one for one in layout.standing if not one.gone and not one.foot.level]
    return replace(layout, standing=tuple(kept))


def check(street: Street, times_s: tuple[float, ...], on_lane_m: float) -> None:
    """Check the rules of layouts, and that vehicles are on their lanes and within the limits."""
    for time_s in times_s:
        layout = there(street.moment(time_s).layout)
        assert not rules.overlaps(layout), time_s
        assert not rules.off_the_ground(layout), time_s
        assert not rules.misplaced(layout), time_s
        for one in layout.standing:
            journey = street._sumo.journeys.get(one.name.partition(" ")[2])
            if journey is None:
                continue
            # the front of a vehicle is on its lane, while its middle cuts the corner in bends
            state = journey.at(street.traffic_start_s + time_s)
            lane = street._sumo._below.at(state.front_m, state.heading_rad)
            assert lane is not None and abs(lane.aside_m) < on_lane_m, (one.name, lane)
            if street.traffic != "sumo":
                continue  # drivers of a user's own files may be faster than the limit
            limit = layout.base.network.road(lane.key.road).speed_limit_kmh
            assert state.speed_m_s <= limit / 3.6 + 0.01, one.name


@pytest.fixture(scope="module")
def junction():
    """Return a junction of two country roads, where vehicles turn and wait."""
    return Street(road="country_t_junction", seed=1, traffic="sumo", vehicles_per_km=12.0, **EMPTY)


@needs_sumo
def test_traffic_is_on_its_lanes_and_meets_nobody(junction):
    check(junction, (0.0, 1.3), ON_LANE_M)
    told = junction._sumo.shortages[0]
    assert told.wanted == pytest.approx(12 * 1.03, abs=1.5)  # 1.03 km of lanes
    assert 5 <= told.placed <= 1.5 * told.wanted
    assert not rules.before_camera(junction.plan(), junction.eye().viewpoint())


@needs_sumo
def test_frames_are_sumos_steps_and_names_stay(junction):
    sumo = junction._sumo
    first = junction.plan()
    for k in (1, 7):
        frame = junction.moment(k * STEP_S)
        assert [one.name for one in frame.layout.standing] == [one.name for one in first.standing]
        for one in frame.layout.standing:
            journey = sumo.journeys.get(one.name.partition(" ")[2])
            if journey is None or one.gone:
                continue
            row = np.flatnonzero(np.isclose(journey.time_s, 60.0 + k * STEP_S))
            ahead = one.foot.thing.size_m[0] / 2
            way = np.array([np.cos(one.foot.heading_rad), np.sin(one.foot.heading_rad)])
            front = np.array([one.foot.x_m, one.foot.y_m]) + ahead * way
            np.testing.assert_allclose(front, journey.front_m[row[0]], atol=1e-9)


@needs_sumo
def test_lamps_are_those_that_sumo_reports(junction):
    """The brake lamps of a vehicle are on when SUMO's brake signal is on.

    SUMO sets the signal for vehicles that stand, or that decelerate more than by rolling resistance
    and drag, (0.05 + 0.005 v) v (MSVehicle::setBrakingSignals).
    """
    sumo = junction._sumo
    braking = rolling = turning = 0
    for journey in sumo.journeys.values():
        lit = journey.signals & Signal.BRAKE > 0
        before = journey.speed_m_s - STEP_S * journey.acceleration_m_s2
        more = -journey.acceleration_m_s2 - (0.05 + 0.005 * before) * before
        moving = journey.speed_m_s > 0.2
        assert lit[(more > 0.01) & moving].all()
        assert not lit[(more < -0.01) & moving].any()
        braking += int(lit.sum())
        rolling += int((~lit).sum())
    assert braking and rolling
    for standing in junction.plan().standing:
        journey = sumo.journeys.get(standing.name.partition(" ")[2])
        if journey is not None and standing.foot.thing.group != "bicycle":
            state = journey.at(60.0)
            sides = {lamp.partition(":")[2] for lamp in standing.foot.lamps if "indicator" in lamp}
            left = {"left"} if state.signals & Signal.LEFT else set()
            right = {"right"} if state.signals & Signal.RIGHT else set()
            assert sides == left | right
            turning += len(sides)
            assert ("brake" in standing.foot.lamps) == bool(state.signals & Signal.BRAKE)
    assert turning  # indicators start lit, also those of vehicles that will come


@needs_sumo
def test_the_camera_rides_a_vehicle_of_the_traffic(junction):
    sumo = junction._sumo
    for time_s in (0.0, 2.0):
        pose = junction.moment(time_s).own_pose
        state = sumo.journeys["own"].at(60.0 + time_s)
        front = pose[:2, 3] + 2.3 * pose[:2, 0]
        np.testing.assert_allclose(front, state.front_m, atol=ON_LANE_M)
    np.testing.assert_allclose(junction.moment(0.0).own_pose, junction.base().pose())
    assert junction.programs() == {"SUMO": metadata.version("eclipse-sumo")}


@needs_sumo
@pytest.mark.slow
def test_the_same_seed_gives_the_same_traffic(junction):
    again = replace(junction)
    other = replace(junction, seed=2)
    poses = lambda street: [one.pose for one in street.moment(2.2).layout.standing]
    np.testing.assert_array_equal(poses(junction), poses(again))
    assert len(poses(other)) != len(poses(again)) or not np.allclose(poses(other), poses(again))


@needs_sumo
@pytest.mark.slow
@pytest.mark.parametrize("road", names())
def test_on_all_kinds_of_road_nobody_meets_anybody(road):
    street = Street(road=road, seed=2, traffic="sumo", vehicles_per_km=12.0, riders_per_km=10.0)
    check(street, (0.0, 0.5, 3.1), 2.2)  # half a lane, and lane changes


TYPE = '<vType id="c" vClass="{kind}" length="4.5"/>'
CAR = '<vehicle id="{name}" type="c" depart="{at}"><route edges="{edge}"/></vehicle>'


def routes(folder, edge: str, kind: str = "passenger") -> str:
    """Write a route file with three vehicles, and return its path."""
    cars = "".join(CAR.format(name=f"v{k}", at=4 * k, edge=edge) for k in range(3))
    path = folder / "cars.rou.xml"
    path.write_text(f"<routes>{TYPE.format(kind=kind)}{cars}</routes>")
    return str(path)


def on_a_straight_road(traffic: str, second_s: float = 10.0, **fields) -> Street:
    return Street(
        road="country_straight",
        seed=1,
        traffic=traffic,
        traffic_start_s=second_s,
        **EMPTY,
        **fields,
    )


@needs_sumo
def test_a_route_file_is_driven_and_one_of_its_cars_carries_the_camera(tmp_path):
    street = on_a_straight_road(routes(tmp_path, "-1.0.00"), traffic_ego="v1")
    check(street, (0.0, 1.0), ON_LANE_M)
    driving = [one for one in street.plan().standing if one.foot.role == "driving"]
    assert [one.name for one in driving] == ["car v0", "car v2"]
    ahead = street._sumo.journeys["v0"].at(10.0).front_m[0]
    assert ahead > street.base().pose()[0, 3] > street._sumo.journeys["v2"].at(10.0).front_m[0]
    assert {str(path) for path in street.input_files()} == {str(tmp_path / "cars.rou.xml")}


@needs_sumo
def test_bad_files_of_traffic_are_one_error_each(tmp_path):
    path = routes(tmp_path, "-1.0.00")
    with pytest.raises(
        ConfigError,
        match="no vehicle of .* second; the first one enters at second 0 .* leaves at second 2",
    ):
        on_a_straight_road(path, 400.0).plan()
    packed = tmp_path / "cars.rou.xml.gz"
    packed.write_bytes(gzip.compress(Path(path).read_bytes()))
    assert on_a_straight_road(str(packed), 10.0).plan().standing
    with pytest.raises(ConfigError, match="traffic_ego is 'v9'.* there are 3.*traffic_ego=v0"):
        on_a_straight_road(path, traffic_ego="v9").plan()
    with pytest.raises(CatalogError, match="missing"):
        on_a_straight_road(str(tmp_path / "none.rou.xml")).plan()
    path = routes(tmp_path, "elsewhere")
    with pytest.raises(CatalogError, match="elsewhere.*expected routes on the net.*roads net"):
        on_a_straight_road(path).plan()


@needs_sumo
@pytest.mark.slow
def test_a_configuration_drives_on_a_shifted_net_of_the_file(tmp_path):
    """Read a SUMO configuration with a net that states a shift of its coordinates.

    The step length of the configuration is kept.
    """
    write(file_of(kind("country_straight", 1)), tmp_path / "road.xodr")
    call("netconvert", ["--opendrive=road.xodr", "--output-file=road.net.xml"], tmp_path)
    edge = next(iter(read((tmp_path / "road.net.xml").read_bytes()).edges))
    routes(tmp_path, edge, "truck")
    (tmp_path / "rush.sumocfg").write_text(
        '<configuration><input><net-file value="road.net.xml"/>'
        '<route-files value="cars.rou.xml"/></input><time><end value="30"/></time></configuration>'
    )
    road = str(tmp_path / "road.xodr")
    path = str(tmp_path / "rush.sumocfg")
    street = Street(road=road, traffic=path, traffic_start_s=10.0, traffic_ego="v1", **EMPTY)
    check(street, (0.0, 0.5), ON_LANE_M)
    things = [one.foot.thing for one in street.plan().standing if one.foot.role == "driving"]
    assert [thing.group for thing in things] == ["truck", "truck"]
    assert len(list(street.input_files())) == 4
    last = max(one.time_s[-1] for one in street._sumo.journeys.values())
    assert last <= 30.0


CONFIGURATION = (
    '<configuration><input><net-file value="road.net.xml"/><route-files value="cars.rou.xml"/>'
    '<additional-files value="detectors.add.xml"/></input><time><begin value="{begin}"/></time>'
    "<mine>{more}</mine></configuration>"
)
STATED = (  # name, other names, section and type of some options of SUMO
    ("net-file", "net n", "input", "FILE"),
    ("route-files", "routes r", "input", "FILE"),
    ("additional-files", "additional a", "input", "FILE"),
    ("weight-files", "weights", "input", "FILE"),
    ("begin", "b", "time", "TIME"),
    ("end", "e", "time", "TIME"),
    ("tripinfo-output", "tripinfo", "output", "FILE"),
    ("save-state.period", "", "output", "TIME"),
    ("save-configuration", "C", "configuration", "FILE"),
    ("time-to-teleport", "", "processing", "TIME"),
    ("pedestrian.jupedsim.wkt", "", "processing", "FILE"),
    ("device.rerouting.output", "", "routing", "FILE"),
    ("device.toc.file", "", "toc_device", "STR"),
    ("device.toc.responseTime", "", "toc_device", "FLOAT"),
)


def configured(folder, begin: str = "0", more: str = ""):
    """Write a configuration next to a net without edges, and return its path."""
    (folder / "road.net.xml").write_text('<net><location netOffset="0,0"/></net>')
    for name in ("cars.rou.xml", "detectors.add.xml"):
        (folder / name).write_text("<routes/>")
    path = folder / "rush.sumocfg"
    path.write_text(CONFIGURATION.format(begin=begin, more=more))
    return path


def on_a_net(folder, more: str = ""):
    """Write a configuration with three cars on a straight road, and return its path."""
    write(file_of(kind("country_straight", 1)), folder / "road.xodr")
    path = configured(folder, "0", more)
    call("netconvert", ["--opendrive=road.xodr", "--output-file=road.net.xml"], folder)
    edge = next(iter(read((folder / "road.net.xml").read_bytes()).edges))
    routes(folder, edge)
    return path, edge


def straight(path, second_s: float = 10.0):
    """Return what SUMO simulates of a configuration on a straight road."""
    own_files._reported.cache_clear()
    return driven(path, kind("country_straight", 1).network, second_s, 1, None).journeys


@pytest.fixture
def stated(monkeypatch):
    """Options of SUMO, without SUMO."""
    found = {
        one: Option(name, section, type_)
        for name, others, section, type_ in STATED
        for one in (name, *others.split())
    }
    monkeypatch.setattr(configuration, "options", lambda: found)


def test_a_copy_of_a_configuration_names_no_file_that_sumo_writes(tmp_path, stated):
    told = {
        "tripinfo": "trips.xml",
        "save-state.period": "2",
        "C": "saved.sumocfg",
        "time-to-teleport": "-1",
        "pedestrian.jupedsim.wkt": "people.wkt",
        "device.rerouting.output": "weights.xml",
        "device.toc.file": "toc.xml",
        "device.toc.responseTime": "2",
        "weights": "a.xml, /data/b.xml",
        "not-of-sumo": "1",
    }
    user = tmp_path / "100% full"
    ours = tmp_path / "ours"
    user.mkdir()
    ours.mkdir()
    more = "".join(f'<{name} value="{value}"/>' for name, value in told.items())
    path = configured(user, "5", f"{more}<routes>more.rou.xml</routes>")
    name = configuration.copy_that_reads(path, ours)
    copied = [(x.tag, x.get("value")) for x in opened(ours / name, "configuration", "").element]
    folder = f"{tmp_path.resolve()}/100%25 full"
    assert copied == [
        ("net-file", f"{folder}/road.net.xml"),
        ("route-files", f"{folder}/cars.rou.xml"),
        ("additional-files", f"{folder}/detectors.add.xml"),
        ("begin", "5"),
        ("time-to-teleport", "-1"),
        ("device.toc.responseTime", "2"),
        ("weight-files", f"{folder}/a.xml,/data/b.xml"),
        ("not-of-sumo", "1"),
        ("route-files", f"{folder}/more.rou.xml"),
    ]


@pytest.mark.parametrize(
    "options",
    [
        '<n value="road.net.xml"/><r value="cars.rou.xml"/><a v="one.xml, {home}"/>'
        '<b value="1"/><e value="0:00:05"/>',
        "<net>road.net.xml</net><routes>\n cars.rou.xml </routes><end>5</end><begin>1</begin>"
        '<additional value="">one.xml,~/two.xml</additional>',
        '<net-file value="${{HERE}}/road.net.xml"/><route-files value="${{NONE}}cars.rou.xml"/>'
        '<additional-files value="${{LIST}}~/two.xml"/><begin value="${{BEGIN}}"/><end v="5"/>',
    ],
    ids=("short names", "other names and texts", "variables"),
)
def test_options_of_a_configuration_are_read_as_sumo_reads_them(
    tmp_path, monkeypatch, stated, options
):
    home = tmp_path / "home"
    monkeypatch.setenv("HOME", str(home))
    monkeypatch.setenv("USERPROFILE", str(home))
    for name, value in {"HERE": ".", "LIST": "one.xml,", "BEGIN": "1"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("NONE", raising=False)
    path = tmp_path / "rush.sumocfg"
    options = options.format(home=home / "two.xml")
    path.write_text(f"<configuration><input>{options}</input></configuration>")
    (tmp_path / "road.net.xml").write_text('<net><location netOffset="0,0"/></net>')
    wanted = [tmp_path / name for name in ("road.net.xml", "cars.rou.xml", "one.xml")]
    assert own_files.files_of(path) == (path, *wanted, home / "two.xml")
    ours = tmp_path / "ours"
    ours.mkdir()
    source = own_files._source(path, None, 1, None, ours)
    assert (source.begin_s, source.end_s) == (1.0, 5.0)
    copy = ours / configuration.COPY_OF_CONFIGURATION
    assert own_files.files_of(copy)[1:] == own_files.files_of(path)[1:]


@needs_sumo
def test_other_names_of_options_are_those_of_sumo(tmp_path):
    known = configuration.options()
    first = set(configuration.FIRST_NAMES.values())
    others = {name: one.name for name, one in known.items() if one.name in first - {name}}
    assert others == configuration.FIRST_NAMES


@needs_sumo
def test_a_configuration_with_other_spellings_is_simulated(tmp_path, monkeypatch):
    path, _ = on_a_net(tmp_path, '<e value="5"/><weights value="${HERE}/costs.xml"/>')
    monkeypatch.setenv("HERE", ".")
    (tmp_path / "costs.xml").write_text("<meandata/>")
    path.write_text(path.read_text().replace("route-files value", "r value"))
    found = straight(path, 3.0)
    assert found and max(one.time_s[-1] for one in found.values()) <= 5.0
    assert tmp_path / "cars.rou.xml" in own_files.files_of(path)


def test_a_simulation_without_its_report_is_one_error(tmp_path, monkeypatch, stated):
    asked = []
    monkeypatch.setattr(own_files, "call", lambda name, told, folder: asked.append((told, folder)))
    monkeypatch.setattr(own_files, "version", lambda: "1")
    path = configured(tmp_path)
    network = kind("country_straight", 1).network
    with pytest.raises(CatalogError, match="SUMO 1 ended .* wrote no isethdr.trace.xml; expected"):
        driven(path, network, 60.0, 1, None)
    with pytest.raises(CatalogError, match="SUMO 1 ended .* wrote no isethdr.trips.xml; expected"):
        _nobody(path, None, 60.0, 1, None)
    for told, folder in asked:
        prefix = next(x for x in told if x.startswith("--output-prefix=")).partition("=")[2]
        written = os.path.normpath(f"{tmp_path}/results/{prefix}loop.xml")
        assert Path(written) == folder / "loop.xml"


def test_temporary_files_of_sumo_go_where_it_replaces_no_word(tmp_path, monkeypatch):
    (tmp_path / "RUNTIME").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "RUNTIME"))
    with own_files._temporary() as name:
        assert "TIME" not in name
    monkeypatch.setattr(own_files, "OTHER_FOLDER", tmp_path / "none")
    with pytest.raises(
        ConfigError, match="replaces TIME in its path .* set TMPDIR to such a folder$"
    ):
        own_files._temporary()


@needs_sumo
@pytest.mark.parametrize(
    "more",
    [
        '<save-state.period value="2"/><save-state.period.keep value="1"/><save-state.prefix'
        ' value="st"/><save-state.suffix value=".xml"/>',
        '<save-state.times value="2,4"/><save-state.files value="st_0.000.xml,st_2.000.xml"/>',
        '<vtk-output value="vtk"/>',
        '<save-configuration value="saved.sumocfg"/>',
        '<C value="{user}/saved.sumocfg"/><save-template value="saved.sumocfg"/>',
        '<save-schema value="saved.sumocfg"/>',
        '<output-suffix value="_v1"/><tripinfo value="trips.xml"/>',
        '<output.format value="csv"/><human-readable-time value="true"/>',
        '<output-prefix value="TIME"/><tripinfo-output value="{user}/trips.xml"/>',
        '<summary value="results/sum.xml"/><log value="{user}/log.txt"/>',
        '<device.fcd.period value="5"/><device.fcd.probability value="0.1"/>'
        '<fcd-output.attributes value="speed"/><fcd-output value="trips.xml"/>',
        '<device.ssm.probability value="1"/><device.ssm.file value="trips.xml"/>'
        '<device.rerouting.probability value="1"/><device.rerouting.output value="log.txt"/>',
    ],
    ids=(
        "old states are removed",
        "states at given times",
        "vtk",
        "save-configuration",
        "save-template",
        "save-schema",
        "output-suffix",
        "output.format",
        "output-prefix",
        "log",
        "fcd",
        "devices",
    ),
)
def test_results_of_the_user_keep_their_content(tmp_path, monkeypatch, more):
    user = tmp_path / "user"
    (user / "results").mkdir(parents=True)
    (tmp_path / "RUNTIME").mkdir()
    path, edge = on_a_net(user, more.format(user=user))
    (user / "detectors.add.xml").write_text(
        f'<additional><edgeData id="a" file="edges.xml"/><e1Detector id="b" lane="{edge}_0" pos="9"'
        f' period="5" file="results/loop.xml"/><e1Detector id="c" lane="{edge}_0" pos="19"'
        f' period="5" file="{user}/loop.xml"/><routeProbe id="d" edge="{edge}" period="5"'
        ' file="probe.xml"/></additional>'
    )
    text = (user / "cars.rou.xml").read_text()
    ssm = '<param key="has.ssm.device" value="true"/><param key="device.ssm.file" value="ssm.xml"/>'
    (user / "cars.rou.xml").write_text(
        text.replace("</route></vehicle>", f"</route>{ssm}</vehicle>")
    )
    for name in (
        *(f"st_{second}.000{zeros}.xml" for second in range(12) for zeros in ("", "0")),
        *(f"vtk_{second}..vtp" for second in range(12)),
        *("saved.sumocfg", "trips.xml", "results/sum.xml", "log.txt"),
        *("edges.xml", "results/loop.xml", "loop.xml", "probe.xml", "ssm.xml"),
    ):
        (user / name).write_text("of the user")
    content = lambda: {x: x.read_bytes() for x in sorted(user.rglob("*")) if x.is_file()}
    before = content()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "RUNTIME"))
    assert len(straight(path)) == 3
    with pytest.raises(ConfigError, match="first one enters at second 0 and the last one leaves"):
        straight(path, 9000.0)
    assert content() == before


@needs_sumo
def test_an_error_of_sumo_in_a_configuration_is_one_error(tmp_path):
    path, _ = on_a_net(tmp_path, '<step-lenght value="0.1"/>')
    with pytest.raises(CatalogError, match="step-lenght.* expected a configuration .* sumo -c"):
        straight(path)
    path.write_text(path.read_text().replace("lenght", "length"))
    steps = np.diff(next(iter(straight(path).values())).time_s)
    assert np.allclose(steps, 0.1)
    (tmp_path / "cars.rou.xml").write_text("<routes><vehicle/></routes>")
    with pytest.raises(CatalogError, match="ended with 1: .* expected a configuration .* sumo -c"):
        straight(path)


@needs_sumo
def test_a_folder_of_a_configuration_may_have_any_name(tmp_path):
    user = tmp_path / "100%20 TIME"
    user.mkdir()
    assert len(straight(on_a_net(user)[0])) == 3


def test_a_second_without_vehicles_names_one_with_most_of_them(tmp_path, monkeypatch, stated):
    trips = [("30.00", "10.00"), ("300.00", "20.00"), ("0:05:10", "30.00"), ("-1", "-1")]
    nodes = "".join(f'<tripinfo depart="{at}" duration="{long}"/>' for at, long in trips)
    ends = []

    def call(name, told, folder):
        ends.extend(x for x in told if x.startswith("--end="))
        (folder / TRIPS).write_text(f"<tripinfos>{nodes}</tripinfos>")

    monkeypatch.setattr(own_files, "call", call)
    # the configuration begins after the second that is asked for
    said = _nobody(configured(tmp_path, "0:00:20"), None, 5.0, 1, None)
    assert "first one enters at second 30 and the last one leaves at second 340;" in said
    assert said.endswith("type for example scene.traffic_start_s=310")
    assert ends == ["--end=86420.0"]


@needs_sumo
def test_a_late_route_file_is_driven_at_the_second_that_the_error_names(tmp_path):
    path = Path(routes(tmp_path, "-1.0.00"))
    walker = '<person id="p" depart="21603"><walk edges="-1.0.00"/></person></routes>'
    text = path.read_text().replace('depart="', 'depart="2160').replace("</routes>", walker)
    path.write_text(text)
    with pytest.raises(ConfigError, match="enters at second 21600 .*traffic_start_s=") as told:
        on_a_straight_road(str(path), 60.0).plan()
    second = float(str(told.value).rpartition("=")[2])
    assert on_a_straight_road(str(path), second).plan().standing


LANES = """<net><edge id="e"><lane id="e_0" index="0" allow="emergency authority" shape="0,0 9,0"/>
<lane id="e_1" index="1" allow="emergency passenger" shape="0,0 9,0"/>
<lane id="e_2" index="2" allow="bicycle" shape="0,0 9,0"/><lane id="e_3" index="3" disallow="all"
shape="0,0 9,0"/><lane id="e_4" index="4" shape="0,0 9,0"/></edge></net>"""


def test_lanes_that_netconvert_takes_as_too_narrow_are_closed():
    lanes = read(LANES.encode()).edges["e"].lanes
    assert [lane.closed for lane in lanes] == [True, False, False, True, False]


@needs_sumo
def test_a_lane_that_opens_from_no_width_gets_no_vehicles_at_its_start(tmp_path):
    path = tmp_path / "road.xodr"
    write(file_of(kind("country_straight", 1)), path)
    lane = (
        '<lane id="{}" type="driving"><width sOffset="0" a="0" b="0" c="0" d="0"/>'
        '<width sOffset="50" a="0" b="0.035" c="0" d="0"/>'
        '<width sOffset="150" a="3.5" b="0" c="0" d="0"/></lane>'
    )
    full = '<lane id="{}" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'
    path.write_text(
        '<OpenDRIVE><header/><road length="300" id="1" junction="-1"><type s="0" type="rural"/>'
        '<planView><geometry s="0" x="0" y="0" hdg="0" length="300"><line/></geometry></planView>'
        f'<lanes><laneSection s="0"><left>{full.format(1)}</left><center><lane id="0" type="none"/>'
        f"</center><right>{full.format(-1)}{lane.format(-2)}</right></laneSection></lanes></road>"
        "</OpenDRIVE>"
    )
    street = Street(road=str(path), traffic="sumo", **EMPTY)
    assert len(street._sumo.journeys) > 5


def test_clock_times_and_packed_files_of_sumo_are_read(tmp_path):
    told = ("90.5", "1:30:00", "2:00:00:10.5", "-1")
    assert [seconds(text) for text in told] == [90.5, 5400.0, 172_810.5, -1.0]
    trace = tmp_path / "trace.xml"
    vehicle = '<vehicle id="a" x="1" y="2" angle="90" speed="3"/>'
    trace.write_text(f'<fcd><timestep time="00:01:00.20">{vehicle}</timestep></fcd>')
    assert read_trace(trace, np.zeros(2))["a"].time_s == pytest.approx([60.2])
    ends = {}
    for text in ("1:00:30", "-1", "soon"):
        path = tmp_path / "rush.sumocfg"
        path.write_text(f'<configuration><time><end value="{text}"/></time></configuration>')
        ends[text] = opened(path, "configuration", "a configuration")
    assert [_stated_s(ends[text], "end", 7.0) for text in ("1:00:30", "-1")] == [3630.0, -1.0]
    with pytest.raises(CatalogError, match="its end is 'soon'; expected seconds, or hh:mm:ss"):
        _stated_s(ends["soon"], "end", 7.0)
    assert _stated_s(ends["-1"], "begin", 7.0) == 7.0
    packed = tmp_path / "types.add.xml.gz"
    packed.write_bytes(
        gzip.compress(b'<additional><vType id="van" vClass="delivery"/></additional>')
    )
    assert _types([packed])["van"]["vClass"] == "delivery"


@needs_sumo
@pytest.mark.slow
def test_a_density_that_does_not_fit_says_how_many_were_placed(monkeypatch):
    """SUMO places half of 145 vehicles per km, which almost touch; the test requires 80 %."""
    monkeypatch.setattr("isethdr_scenes.traffic.sumo.traffic.LEAST", 0.8)
    street = Street(road="country_straight", traffic="sumo", vehicles_per_km=145.0, **EMPTY)
    with pytest.raises(ConfigError, match=r"only \d+ of \d+ vehicles .* second 60.*scene.vehicles"):
        street.plan()


def test_a_shortage_names_both_numbers_the_second_and_a_density_that_fits():
    told = Shortage("vehicles_per_km", "vehicles", 40, 15, 100.0)
    with pytest.raises(ConfigError, match="15 of 40 .* at second 60;.*vehicles_per_km=30$"):
        check_shortage(told, "village", 60.0)
    check_shortage(told._replace(placed=39), "village", 60.0)


def test_a_choice_that_is_not_there_is_one_error():
    with pytest.raises(ConfigError, match="did you mean 'sumo'.*scene.traffic=sumo"):
        check_traffic("sumi", "")
    assert all(map(from_files, ("a.sumocfg", "a.rou.xml", "a.rou.xml.gz")))
    with pytest.raises(ConfigError, match="beside scene.scenario"):
        check_traffic("sumo", "cut_in.xosc")


def test_without_the_extra_the_error_names_it(monkeypatch, tmp_path):
    from isethdr_scenes.traffic.sumo import program

    def absent(_name):
        raise metadata.PackageNotFoundError

    monkeypatch.setattr(program.metadata, "distribution", absent)
    monkeypatch.setattr(program.sys, "executable", str(tmp_path / "python"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ConfigError, match=r"SUMO's sumo.*pip install 'isethdr\[traffic\]'"):
        program.tool.__wrapped__("sumo")


def box(x: float, y: float, heading: float = 0.0) -> list[float]:
    return [x, y, 2.0, 1.0, np.cos(heading), np.sin(heading), 0.0, 1.5, 0.0]


def test_who_touches_is_found_at_the_same_time_only():
    boxes = np.array([box(0, 0), box(3.9, 0), box(0, 0), box(0, 2.1), box(9, 0), box(0, 1.9, 0.1)])
    time_s = np.array([0.0, 0.0, 0.2, 0.2, 0.0, 0.4])
    owner = np.array([0, 1, 0, 2, 3, 1])
    assert touching(boxes, time_s, owner) == {(0, 1)}
    assert touching(boxes[:1], time_s[:1], owner[:1]) == set()


def test_as_few_as_can_be_are_left_out_and_never_the_cameras_car():
    assert fewest({(0, 1), (1, 2), (1, 3)}, 0) == {1}
    assert fewest({(0, 1), (0, 2)}, 0) == {1, 2}
    assert fewest(set(), 0) == set()


def test_a_sweep_covers_each_place_once_with_the_largest_box():
    large = box(0.1, 0.1)
    large[2] = 5.0
    found = swept(np.array([box(0, 0), large, box(0, 0, np.pi / 2), box(5, 0)]))
    assert len(found) == 3
    assert large in found.tolist()


def test_traffic_without_a_vehicle_for_the_camera_is_one_error():
    with pytest.raises(ConfigError, match=r"trams.sumocfg has no car, .* at second 12 that could"):
        check_own("", Path("trams.sumocfg"), {}, 12.0)

"""The scene `street`: descriptions within their budget, lamps, cameras, and clear errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.placing import rules
from isethdr_scenes.roads.kinds import kind, names
from isethdr_scenes.roads.opendrive.file_road import file_of
from isethdr_scenes.roads.opendrive.road_file import write
from isethdr_scenes.street import Street
from isethdr_scenes.street_detail import BUDGET, ENDS_M, SPARE, TRIANGLES, levels
from isethdr_scenes.street_models import stored, visible
from isethdr_scenes.things import build, draw

from isethdr_core.conformance.scene import check_description
from isethdr_core.errors import CatalogError, ConfigError

BYTES = 100e6  # limit for the meshes of a scene: 75 bytes per triangle, and a third more
IN_TUNNEL = 1  # seed with a camera car that starts in the tunnel
EMPTY = dict(
    parked_share=0.0,
    people_per_km=0.0,
    riders_per_km=0.0,
    animals_per_km=0.0,
    plants_per_km=0.0,
)


@pytest.fixture(scope="module")
def quiet():
    """Return a country road with two or three vehicles, and its description."""
    street = Street(seed=1, road="country_crest", vehicles_per_km=4.0, **EMPTY)
    return street, street()


def test_a_description_is_complete_and_within_its_budget(quiet):
    street, scene = quiet
    check_description("street", scene)
    assert street.light_groups() == scene.light_groups() == ("sky", "headlights", "other")
    triangles, size = stored(scene.models)
    assert triangles < BUDGET and size < BYTES
    assert {o.model for o in scene.objects} == set(scene.models)
    assert {"road", "land", "own headlamps"} <= {o.name for o in scene.objects}


def test_the_camera_is_on_its_car_and_looks_along_its_mount(quiet):
    street, scene = quiet
    own = street.base().pose()
    ahead = np.subtract(scene.camera.target_m, scene.camera.position_m)
    ahead /= np.linalg.norm(ahead)
    local = own[:3, :3].T @ ahead
    assert np.degrees(np.arcsin(local[2])) == pytest.approx(-1.0, abs=1e-6)
    above = (np.array(scene.camera.position_m) - own[:3, 3]) @ own[:3, 2]
    assert above == pytest.approx(1.3, abs=1e-9)
    for mount, heading in (("rear", 180.0), ("left", 90.0), ("right", -90.0)):
        turned = Street(
            seed=1, road="country_crest", vehicles_per_km=0.0, camera_mount=mount, **EMPTY
        )
        camera = turned._camera(turned.eye())
        way = own[:3, :3].T @ np.subtract(camera.target_m, camera.position_m)
        turn = np.degrees(np.arctan2(way[1], way[0]))
        assert (turn - heading + 180) % 360 == pytest.approx(180.0, abs=1e-6)


def test_by_day_vehicles_have_daytime_lamps_in_place_of_the_others(quiet):
    street, scene = quiet
    day = replace(street, vehicle_lamps="daytime")
    kinds = lambda one: [
        set(s.foot.lamps) for s in one.plan().standing if s.foot.thing.group != "rider"
    ]
    for by_night, by_day in zip(kinds(street), kinds(day), strict=True):
        assert ("low_beam" in by_night) == ("daytime" in by_day)
        assert not by_day & {"low_beam", "position", "tail"}
        assert {k for k in by_night if "indicator" in k or "brake" in k} <= by_day
    described = day()
    lamps = [p.lamp for m in described.models.values() for p in m.parts if p.lamp]
    # 400 to 1200 cd are the limits of UN R148; lamps of the camera car are included
    assert all(400 <= lamp.intensity_cd <= 1200 for lamp in lamps if lamp.group == "headlights")
    assert {lamp.group for lamp in lamps} == set(day.light_groups()) - {"sky"}


LANES = "".join(
    f'<{side}><lane id="{number}" type="driving"><width sOffset="0" a="3.5"/></lane></{side}>'
    for side, number in (("left", 1), ("center", 0), ("right", -1))
).replace('<lane id="0" type="driving"><width sOffset="0" a="3.5"/>', '<lane id="0" type="none">')
TWO_LANES = f"""<OpenDRIVE><header revMajor="1" revMinor="6"/>
<road id="1" length="300" junction="-1" rule="RULE"><planView>
<geometry s="0" x="0" y="0" hdg="0" length="300"><line/></geometry></planView>
<lanes><laneSection s="0">{LANES}</laneSection></lanes></road></OpenDRIVE>"""


@pytest.mark.parametrize("beam", ["dipped_r112_b", "dipped_r149_c"])
def test_dipped_beams_rise_on_the_side_of_the_near_verge(tmp_path, beam):
    """On the left where traffic keeps to the left, for the own car and all other vehicles."""
    values = {}
    for rule in ("RHT", "LHT"):
        path = tmp_path / f"{rule}.xodr"
        path.write_text(TWO_LANES.replace("RULE", rule))
        street = Street(road=str(path), vehicles_per_km=20.0, headlamp_beam=beam, **EMPTY)
        models = street().models.values()
        lamps = [p.lamp for m in models for p in m.parts if p.lamp and p.lamp.kind == "low_beam"]
        assert len(lamps) >= 4, "those of the own car and of another vehicle"
        for lamp in lamps:
            # B50L, the eye of an oncoming driver on a right-hand road, and its mirror
            at = lamp.intensity_cd * lamp.table.at([3.43, -3.43], 0.57)
            values.setdefault(rule, at)
            np.testing.assert_allclose(at, values[rule], rtol=1e-12)
    assert values["RHT"][1] > 2 * values["RHT"][0]
    np.testing.assert_allclose(values["LHT"], values["RHT"][::-1], rtol=1e-12)


def test_own_headlamps_are_below_the_picture_and_its_margin(quiet):
    _, scene = quiet
    camera = scene.camera
    own = next(o for o in scene.objects if o.category == "own vehicle")
    points = np.concatenate([p.vertices for p in scene.models[own.model].parts])
    points = points @ own.pose[:3, :3].T + own.pose[:3, 3] - camera.position_m
    axis = np.subtract(camera.target_m, camera.position_m)
    axis = axis / np.linalg.norm(axis)
    side = np.cross(axis, [0, 0, 1])
    up = np.cross(side / np.linalg.norm(side), axis)
    top = np.tan(np.radians(camera.horizontal_field_deg / 2)) / camera.aspect
    assert ((points @ up) / (points @ axis) < -1.2 * top).all()


def test_things_are_coarser_with_distance_and_within_the_budget():
    street = Street(seed=2, road="city_2_lanes", parked_share=1.0, riders_per_km=0.0)
    layout = street.plan()
    place = street.eye()
    seen = visible(layout, place, street.horizontal_field_deg)
    assert 0 < len(seen) < len(layout.standing)
    level = levels(seen, place.position_m)
    rank = {"near": 0, "middle": 1, "far": 2, "distant": 3}
    cost = sum(TRIANGLES[t.group][rank[at]] for t, at in level.items() if t.group in TRIANGLES)
    assert cost <= BUDGET - SPARE
    for one in seen:
        distance = np.linalg.norm(one.pose[:3, 3] - place.position_m)
        if distance > ENDS_M[1] + one.foot.thing.size_m[0]:
            nearest = min(
                np.linalg.norm(o.pose[:3, 3] - place.position_m)
                for o in seen
                if o.foot.thing == one.foot.thing
            )
            assert rank[level[one.foot.thing]] >= 2 or nearest <= distance - 1e-9


@pytest.mark.parametrize(
    "fields, words",
    [
        ({"road": "vilage"}, "did you mean 'village'.* type for example scene.road=village"),
        ({"vehicles_per_km": 500.0}, "vehicles_per_km="),
        ({"camera_height_m": 9.0}, "camera_height_m="),
        ({"camera_mount": "top"}, "camera_mount="),
        ({"horizontal_field_deg": 170.0}, "scene.horizontal_field_deg=45"),
    ],
)
def test_impossible_fields_say_what_to_type(fields, words):
    with pytest.raises(ConfigError, match=f"expected .*{words}|{words}"):
        Street(**fields)


def test_a_camera_in_the_wall_of_a_tunnel_is_an_error_before_any_mesh():
    with pytest.raises(ConfigError, match="inside the wall of a tunnel.*scene.camera_left_m=0"):
        Street(seed=IN_TUNNEL, road="tunnel", camera_left_m=8.0, **EMPTY).plan()


def test_where_a_shifted_camera_looks_nothing_is_built():
    """Shift the camera to the side of a city street, where buildings would stand otherwise."""
    street = Street(seed=1, road="city_2_lanes", vehicles_per_km=0.0, camera_left_m=-17.0, **EMPTY)
    assert not rules.before_camera(street.plan(), street.eye().viewpoint())


@pytest.mark.slow
@pytest.mark.parametrize("road", names())
def test_every_kind_of_road_is_a_scene_within_its_budget(road):
    for seed, mount in ((1, "front"), (2, "rear")):
        street = Street(seed=seed, road=road, camera_mount=mount)
        scene = street()
        check_description(road, scene)
        assert street.light_groups() == scene.light_groups()
        triangles, size = stored(scene.models)
        assert triangles < BUDGET and size < BYTES


@pytest.mark.slow
@pytest.mark.parametrize("group", sorted(TRIANGLES))
def test_no_thing_has_more_triangles_than_the_budget_counts(group):
    rng = np.random.default_rng(5)
    for _ in range(12):
        thing = draw(group, rng)
        if group == "rider":
            continue  # the count includes the vehicle
        for detail, most in zip(("near", "middle", "far"), TRIANGLES[group]):
            count = sum(len(p.faces) for p in build(thing, detail).parts)
            assert count <= most, (thing, detail)


def test_a_road_file_is_a_street_named_by_its_content(tmp_path):
    path = tmp_path / "crest.xodr"
    write(file_of(kind("country_crest", 1)), path)
    fields = dict(seed=1, vehicles_per_km=4.0, **EMPTY)
    street = Street(road=str(path), **fields)
    assert tuple(street.input_files()) == (path,) and not tuple(Street(**fields).input_files())
    street.check_files()
    # the written road file gives the same street as the kind, up to rounding of poses
    kept = Street(road="country_crest", **fields).plan()
    for one, other in zip(street.plan().standing, kept.standing, strict=True):
        assert one.foot.thing == other.foot.thing
        assert one.pose == pytest.approx(other.pose, abs=1e-6)
    with pytest.raises(CatalogError, match="gone.xodr cannot be read"):
        Street(road=str(tmp_path / "gone.xodr")).check_files()
    with pytest.raises(ConfigError, match="s_m is set, .* kind 'village'; .* scene.road=town.xodr"):
        Street(road="village", s_m=4.0)

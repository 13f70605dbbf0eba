"""The country road and the tunnel: ranges, visible objects, names, determinism, and clear
errors.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from isethdr_scenes.night_drive import NightDrive
from isethdr_scenes.placement import OWN_LAMPS, eye, oncoming_lamp
from isethdr_scenes.tunnel import Tunnel

from isethdr_core.conformance.scene import check_description
from isethdr_core.errors import ConfigError
from isethdr_core.physics.photometry import luminance

SEEDS = range(60)
CLASSES = [NightDrive, Tunnel]


@pytest.fixture(scope="module")
def built():
    """Return the scenes with few things: oncoming car, car ahead, truck, and few of the others.

    The default road with all its things takes six seconds.
    """
    few = NightDrive(vehicles=(3, 3), people=(2, 2), animals=(1, 1), trees=(4, 4))
    return {NightDrive: few(), Tunnel: Tunnel()()}


def angle_deg(a, b, seen_from):
    a, b = (np.asarray(p, float) - seen_from for p in (a, b))
    return np.degrees(np.arccos(np.clip(a @ b / np.linalg.norm(a) / np.linalg.norm(b), -1, 1)))


def tangents(camera, points):
    """Return picture positions (right, up) of world points, as tangents, and their depths, m."""
    ahead = np.subtract(camera.target_m, camera.position_m)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    d = np.asarray(points, float) - camera.position_m
    depth = d @ ahead
    return d @ right / depth, d @ np.cross(right, ahead) / depth, depth


@pytest.mark.parametrize("seed", SEEDS)
def test_ranges_are_respected(seed):
    drive = NightDrive(seed=seed)
    _, spots = drive.plan()
    by_name = {s.name: s for s in spots}
    for field, name in (
        ("oncoming_m", "car oncoming"),
        ("ahead_m", "car ahead"),
        ("truck_m", "truck parked"),
        ("cyclist_m", "bicycle"),
        ("deer_m", "stag"),
    ):
        low, high = getattr(drive, field)
        assert low <= by_name[name].s_m <= high
    for field, categories in (
        ("vehicles", ("car", "truck", "bus")),
        ("people", ("person",)),
        ("animals", ("deer",)),
        ("street_lamps", ("street lamp",)),
    ):
        low, high = getattr(drive, field)
        assert low <= sum(s.category in categories for s in spots) <= high
    low, high = drive.trees
    planted = sum(s.recipe[0] == "plant" for s in spots)
    assert low - 2 <= planted <= high + 2  # four kinds by rounded shares
    assert len(by_name) == len(spots)


@pytest.mark.parametrize("seed", SEEDS)
def test_pedestrian_walks_close_beside_the_oncoming_headlamp_and_is_not_hidden(seed):
    drive = NightDrive(seed=seed)
    ground, spots = drive.plan()
    person, car = ({s.name: s for s in spots}[n] for n in ("pedestrian", "car oncoming"))
    seen_from = eye(ground, drive.camera_height_m)
    lamp = oncoming_lamp(ground, car.s_m)
    apart = angle_deg(ground.on(person.s_m, person.y_m, 0.7), lamp, seen_from)
    low, high = drive.pedestrian_beside_deg
    # the range is that of the horizontal angle; the heights differ by half a degree
    assert low - 0.05 <= apart <= high + 0.4
    corner = ground.on(car.s_m - 2.2, car.y_m + 0.94)  # outer front corner of the car
    shoulder = ground.on(person.s_m, person.y_m - 0.25)
    bearing = [np.degrees(np.arctan2(*(p - seen_from)[1::-1])) for p in (shoulder, corner)]
    assert bearing[0] > bearing[1]


@pytest.mark.parametrize("cls", CLASSES)
@pytest.mark.parametrize("seed", range(10))
def test_vehicles_and_people_do_not_overlap(cls, seed):
    _, spots = cls(seed=seed).plan()
    half = {
        "car": (2.5, 1.0),
        "truck": (4.7, 1.3),
        "bus": (6.2, 1.3),
        "person": (0.4, 0.35),
        "deer": (0.9, 0.6),
    }
    boxes = [(s.name, s.s_m, s.y_m, *half[s.category]) for s in spots if s.category in half]
    for k, (a, sa, ya, la, wa) in enumerate(boxes):
        for b, sb, yb, lb, wb in boxes[k + 1 :]:
            assert abs(sa - sb) > la + lb or abs(ya - yb) > wa + wb, (a, b)


@pytest.mark.parametrize("cls", CLASSES)
def test_description_is_complete(built, cls):
    check_complete(cls.__name__, built[cls])


@pytest.mark.slow
def test_description_of_the_default_road_is_complete():
    check_complete("NightDrive", NightDrive()())


def check_complete(name, scene):
    """Check that a description defines all that it names, and the number of its triangles."""
    check_description(name, scene)
    assert scene.light_groups() == ("sky", "headlights", "other", "streetlights")
    used = {p.material for m in scene.models.values() for p in m.parts}
    assert used == set(scene.materials)
    assert {o.model for o in scene.objects} == set(scene.models)
    faces = sum(len(p.faces) for m in scene.models.values() for p in m.parts)
    assert faces < 1.3e6  # a limit on the renderer's memory


@pytest.mark.parametrize(
    "cls, wanted",
    [
        (
            NightDrive,
            (
                "car oncoming",
                "car ahead",
                "truck parked",
                "pedestrian",
                "bicycle",
                "rider",
                "stag",
                "street lamp 1",
            ),
        ),
        (Tunnel, ("car ahead", "car oncoming", "pedestrian", "luminaire 4 left")),
    ],
)
def test_camera_sees_what_the_scene_is_about(built, cls, wanted):
    scene = built[cls]
    half = np.tan(np.radians(scene.camera.horizontal_field_deg / 2))
    placed = {o.name: o for o in scene.objects}
    for name in wanted:
        pose = placed[name].pose
        v = np.concatenate([p.vertices for p in scene.models[placed[name].model].parts])
        x, y, depth = tangents(scene.camera, v @ pose[:3, :3].T + pose[:3, 3])
        inside = (depth > 0) & (np.abs(x) < half) & (np.abs(y) < half / scene.camera.aspect)
        assert inside.mean() > 0.95, name


@pytest.mark.parametrize("cls", CLASSES)
def test_own_headlamps_are_out_of_the_picture_and_its_margin(built, cls):
    scene = built[cls]
    own = next(o for o in scene.objects if o.category == "own vehicle")
    v = (
        np.concatenate([p.vertices for p in scene.models[own.model].parts]) @ own.pose[:3, :3].T
        + own.pose[:3, 3]
    )
    _, y, depth = tangents(scene.camera, v)
    top = np.tan(np.radians(scene.camera.horizontal_field_deg / 2)) / scene.camera.aspect
    assert depth == pytest.approx(OWN_LAMPS[0], abs=0.1)
    assert (y < -1.2 * top).all()  # renderers add a margin of a tenth of the field on each side


def test_same_seed_same_arrays_and_another_seed_another_plan():
    small = {
        "vehicles": (1, 1),
        "people": (1, 1),
        "animals": (0, 0),
        "trees": (0, 6),
        "street_lamps": (0, 2),
    }
    a = NightDrive(seed=3, **small)()
    b = NightDrive(seed=3, **small)()
    for x, y in zip(a.objects, b.objects, strict=True):
        assert (x.name, x.model, x.category) == (y.name, y.model, y.category) and np.array_equal(
            x.pose, y.pose
        )
    for name, model in a.models.items():
        for p, q in zip(model.parts, b.models[name].parts, strict=True):
            assert (
                np.array_equal(p.vertices, q.vertices)
                and np.array_equal(p.faces, q.faces)
                and p.lamp == q.lamp
            )
    plans = [NightDrive(seed=k).plan()[1][0].s_m for k in range(5)]
    assert len(set(plans)) == 5


@pytest.mark.slow
def test_lights_are_switched_and_coloured_as_asked(built):
    kinds = {p.lamp.kind for m in built[NightDrive].models.values() for p in m.parts if p.lamp}
    assert (
        "brake" not in kinds
        and "reverse" not in kinds
        and {"indicator_rear", "tail", "low_beam"} <= kinds
    )
    halogen = NightDrive(
        vehicles=(2, 2),
        people=(1, 1),
        animals=(0, 0),
        trees=(0, 0),
        street_lamps=(1, 1),
        braking=True,
        headlamp_light="halogen",
        street_light="led_white",
    )()
    lamps = {p.lamp.kind: p.lamp for m in halogen.models.values() for p in m.parts if p.lamp}
    assert "brake" in lamps

    def blue_over_red(lamp):
        return float(lamp.spectrum.at(450) / lamp.spectrum.at(650))

    assert blue_over_red(lamps["low_beam"]) < 0.5 and blue_over_red(lamps["street"]) > 1.5


@pytest.mark.parametrize("cls", CLASSES)
def test_sky_at_weight_one_has_the_stated_luminance(built, cls):
    nm = np.arange(360.0, 831.0)
    assert luminance(built[cls].sky.at(nm), nm) == pytest.approx(
        cls().sky_luminance_cd_m2, rel=1e-9
    )


@pytest.mark.parametrize("seed", range(10))
def test_tunnel_exit_is_ahead_and_nothing_stands_in_the_walls(seed):
    tunnel = Tunnel(seed=seed)
    _, spots = tunnel.plan()
    by_name = {s.name: s for s in spots}
    end = by_name["tunnel"].recipe[3]
    assert tunnel.exit_m[0] <= end <= tunnel.exit_m[1]
    assert by_name["field"].recipe[2] == end
    for s in spots:
        if s.recipe[0] == "plant":
            assert s.s_m > end + 10
        elif s.category in ("car", "person"):
            assert s.s_m < end and abs(s.y_m) < 5.1


@pytest.mark.parametrize(
    "change, words",
    [
        ({"vehicles": (0, 2)}, "vehicles="),
        ({"people": (3, 2)}, "scene.people"),
        ({"trees": (0, 9999)}, "trees="),
        ({"oncoming_m": (3.0, 9.0)}, "oncoming_m="),
        ({"horizontal_field_deg": 170.0}, "scene.horizontal_field_deg=45"),
        ({"camera_height_m": 9.0}, "camera_height_m="),
    ],
)
def test_impossible_fields_of_the_road_say_what_to_type(change, words):
    with pytest.raises(ConfigError, match="expected .* type for example") as caught:
        replace(NightDrive(), **change).plan()
    assert words in str(caught.value)


def test_impossible_luminaires_say_what_to_type():
    with pytest.raises(ConfigError, match=r"luminaire_spacing_m=12"):
        Tunnel(luminaire_spacing_m=0.0).plan()


def test_what_two_scenes_share_is_built_once():
    """A scene of the same seed shares all meshes except those that follow the ground.

    Names, poses and lamps are separate.
    """
    few = {"vehicles": (1, 1), "people": (1, 1), "animals": (0, 0), "trees": (0, 0)}
    first = NightDrive(**few)()
    again = NightDrive(**few, headlamp_light="halogen")()
    shared = [
        name
        for name in first.models
        if first.models[name].parts[0].vertices is again.models[name].parts[0].vertices
    ]
    assert {name.rstrip("0123456789") for name in set(first.models) - set(shared)} == {
        "road",
        "field",
        "grass",
        "guard_rail",
    }
    lamps = [
        {
            p.lamp.spectrum.value
            for p in d.models["car0"].parts
            if p.lamp and p.lamp.group == "headlights"
        }
        for d in (first, again)
    ]
    assert lamps[0] != lamps[1]  # lamps are switched after models are built


@pytest.mark.parametrize("people, bicycles", [(1, 0), (2, 1)])
def test_a_bicycle_is_placed_with_its_rider_only(people, bicycles):
    drive = NightDrive(vehicles=(1, 1), people=(people, people), animals=(0, 0), trees=(0, 0))
    placed = [p.name for p in drive().objects]
    assert sum(name == "bicycle" for name in placed) == bicycles
    assert sum(name == "rider" for name in placed) == bicycles

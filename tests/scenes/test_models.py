"""Vehicles, people and animals: sizes, ground contact, positions of lamps, and materials."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes.geometry.mesh.piece import face_areas
from isethdr_scenes.geometry.road_users import cyclist, deer, person
from isethdr_scenes.geometry.surroundings import house, plants, roadside, tube
from isethdr_scenes.geometry.surroundings.ground import Ground
from isethdr_scenes.geometry.surroundings.road import field, road
from isethdr_scenes.geometry.vehicles import bus, car, car_shapes, truck
from isethdr_scenes.materials import MATERIALS
from scipy.spatial import cKDTree

MAKERS = {
    **{name: (lambda shape=shape: car.build(shape)) for name, shape in car_shapes.CARS.items()},
    "truck": truck.truck,
    "bus": bus.bus,
    "bicycle": lambda: cyclist.bicycle()[0],
    "rider": cyclist.rider,
    "pedestrian": person.pedestrian,
    "worker": lambda: person.pedestrian(person.LOOKS[3], 0.62),
    "child": lambda: person.pedestrian(person.LOOKS[4], 0.3),
    "stag": deer.deer,
    "hind": lambda: deer.deer(antlers=False, head_up=0.05),
    "street lamp": roadside.street_lamp,
    "marker post": roadside.marker_post,
    "luminaire": tube.luminaire,
    "house": house.house,
    "bush": plants.bush,
    "road": lambda: road(Ground(), 0, 60),
    "field": lambda: field(Ground(), 0, 60),
    "guard rail": lambda: roadside.guard_rail(Ground(), 0, 30, 5.6),
    "tunnel": lambda: tube.tunnel(Ground(0.0), -20, 40),
}
# models built by the same code as another model in `MAKERS`
LONG = {"hatchback", "suv", "van", "worker", "child", "hind"}
# smallest and largest length (x), width (y) and height (z), m
SIZES = {
    "sedan": ((4.4, 4.9), (1.8, 2.2), (1.3, 1.65)),
    "hatchback": ((3.9, 4.3), (1.75, 2.2), (1.4, 1.65)),
    "suv": ((4.4, 4.8), (1.85, 2.3), (1.6, 1.8)),
    "van": ((4.8, 5.2), (1.9, 2.4), (1.85, 2.1)),
    "truck": ((8, 9.5), (2.45, 3.1), (3.2, 4.0)),
    "bus": ((11, 12.5), (2.5, 3.1), (2.9, 3.4)),
    "bicycle": ((1.6, 1.9), (0.5, 0.8), (0.95, 1.15)),
    "pedestrian": ((0.4, 1.1), (0.4, 0.8), (1.7, 1.85)),
    "worker": ((0.4, 1.1), (0.4, 0.8), (1.65, 1.82)),
    "child": ((0.25, 0.8), (0.25, 0.6), (1.22, 1.4)),
    "stag": ((1.4, 2.2), (0.3, 1.2), (1.4, 2.0)),
    "street lamp": ((0.1, 0.4), (2.0, 3.2), (8.0, 8.5)),
    "house": ((9, 11), (7, 9), (7.5, 9.5)),
}


class Models(dict):
    """Models by name, each built at its first use."""

    def __missing__(self, name):
        self[name] = MAKERS[name]().model(name)
        return self[name]


@pytest.fixture(scope="module")
def models():
    return Models()


def some_quickly(names):
    """Return the names as test parameters; models that take long are marked slow."""
    return [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in names]


def corners(model):
    v = np.concatenate([p.vertices for p in model.parts])
    return v.min(0), v.max(0)


@pytest.mark.parametrize("name", some_quickly(sorted(SIZES)))
def test_size_is_plausible(models, name):
    low, high = corners(models[name])
    for k, (least, most) in enumerate(SIZES[name]):
        assert least <= high[k] - low[k] <= most, "xyz"[k]


@pytest.mark.parametrize(
    "name",
    some_quickly(["sedan", "truck", "bus", "bicycle", "pedestrian", "stag", *sorted(LONG)]),
)
def test_stands_on_the_ground(models, name):
    # 4 cm: hooves and treads are rounded, and marching cubes has steps of some mm
    assert corners(models[name])[0][2] == pytest.approx(0, abs=0.04)


@pytest.mark.parametrize("name", some_quickly(sorted(MAKERS)))
def test_parts_are_sound(models, name):
    for part in models[name].parts:
        assert part.material in MATERIALS
        assert np.isfinite(part.vertices).all() and part.faces.max() < len(part.vertices)
        if part.normals is not None:
            assert np.allclose(np.linalg.norm(part.normals, axis=1), 1, atol=1e-6)
            weight = face_areas(part)
            along = (weight * part.normals[part.faces].mean(1)).sum(1)
            # shading normals and faces agree about the outer side, except on thin triangles where a
            # sheet folds
            assert -along[along < 0].sum() < 0.02 * np.linalg.norm(weight, axis=1).sum(), part.name


@pytest.mark.parametrize("name", some_quickly(sorted(MAKERS)))
def test_lamps_face_their_axis(models, name):
    for part in (p for p in models[name].parts if p.lamp):
        vector = face_areas(part).sum(0)
        projected = vector @ np.array(part.lamp.axis)
        whole = np.linalg.norm(face_areas(part), axis=1).sum()
        assert np.linalg.norm(part.lamp.axis) == pytest.approx(1, abs=1e-12)
        # the mean face is within 60 degrees of the axis; a lamp that faces away cannot have its
        # intensity
        assert projected > 0.5 * whole > 0, part.name


@pytest.mark.parametrize("name", some_quickly(["sedan", "hatchback", "suv", "van", "truck", "bus"]))
def test_vehicle_has_glass_wheels_plates_and_a_lamp_of_each_kind_on_both_sides(models, name):
    model = models[name]
    assert {"glass", "tyre", "plate_white", "interior"} <= {p.material for p in model.parts}
    kinds = {p.lamp.kind for p in model.parts if p.lamp}
    assert {"low_beam", "position", "tail", "brake", "indicator_rear", "reverse"} <= kinds
    for kind in ("low_beam", "position", "tail"):
        y = [p.vertices[:, 1].mean() for p in model.parts if p.lamp and p.lamp.kind == kind]
        assert len(y) == 2 and sum(y) == pytest.approx(0, abs=0.03) and max(y) > 0.45, kind
    for part in (p for p in model.parts if p.lamp and p.lamp.kind == "low_beam"):
        assert 0.5 < part.vertices[:, 2].mean() < 1.2  # UN R48: 500 to 1200 mm above the ground
        assert part.vertices[:, 0].mean() > 0


@pytest.mark.parametrize("name", some_quickly(sorted(MAKERS)))
def test_no_two_lamps_share_a_name(models, name):
    lamps = [p.name for p in models[name].parts if p.lamp]
    assert len(lamps) == len(set(lamps))


def test_rider_reaches_pedals_and_grips(models):
    _, pedals, grips, _ = cyclist.bicycle()
    rider = np.concatenate([p.vertices for p in models["rider"].parts])
    for point in (*pedals, *grips):
        assert np.linalg.norm(rider - point, axis=1).min() < 0.08


def test_tunnel_is_open_at_its_exit_and_closed_behind(models):
    parts = {p.name: p for p in models["tunnel"].parts}
    # (faces, 3, xyz)
    corner = np.concatenate([p.vertices[p.faces] for p in models["tunnel"].parts])
    assert _hits(corner, (0, 0, 1.5), (1, 0, 0)) == 0
    # the end wall or the lining, and the skin behind it
    for direction in ((-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0.1, 1)):
        assert _hits(corner, (0.3, 0, 1.5), direction) == 2
    vault = parts["tunnel_lining"]
    inward = face_areas(vault) * ([0, 0, 1.5] - vault.vertices[vault.faces].mean(1)) * [0, 1, 1]
    assert (inward.sum(1) > 0).all()


def _hits(corner, origin, direction):
    """Return the number of triangles hit by a ray (Moeller and Trumbore, 1997)."""
    a = corner[:, 0]
    e1 = corner[:, 1] - corner[:, 0]
    e2 = corner[:, 2] - corner[:, 0]
    d = np.array(direction, float)
    p = np.cross(direction, e2)
    det = (e1 * p).sum(1)
    ok = np.abs(det) > 1e-12
    inv = 1 / np.where(ok, det, 1)
    t = np.array(origin) - a
    u = (t * p).sum(1) * inv
    q = np.cross(t, e1)
    v = (q @ d) * inv
    distance = (e2 * q).sum(1) * inv
    return int((ok & (u >= 0) & (v >= 0) & (u + v < 1) & (distance > 0)).sum())


@pytest.mark.parametrize("head_up", [1.0, 0.05])
def test_eyes_of_a_deer_look_out_of_its_head(head_up):
    """Eyes shine in headlamps only where they lie outside the skin."""
    parts = {p.material: p for p in deer.deer(head_up=head_up, turn=0.5 * head_up).model().parts}
    skin = parts["fur"]
    eyes = parts["eye_deer"]
    _, nearest = cKDTree(skin.vertices).query(eyes.vertices)
    out = np.einsum("nk,nk->n", eyes.vertices - skin.vertices[nearest], skin.normals[nearest])
    # a part of each eyeball is outside; vertices of the skin are 14 mm apart
    assert (out > 0).mean() > 0.25 and 0.006 < out.max() < 0.03

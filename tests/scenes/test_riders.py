"""Riders of bicycles, motorcycles and scooters: hands on the grips, feet where they belong."""

from __future__ import annotations

import numpy as np
import pytest
from isethdr_scenes import things
from isethdr_scenes.things.detail import extent_m
from isethdr_scenes.things.people import families as people
from isethdr_scenes.things.people.body import ANKLE_M, Body, spine
from isethdr_scenes.things.people.mounted import (
    BALL_M,
    LEANS_DEG,
    PALM_M,
    SEATED_M,
    SLIDES_M,
    STRETCHED,
    seated,
)
from isethdr_scenes.things.registry import RIDDEN
from isethdr_scenes.things.riding import RidingPosition

VEHICLES = [(group, family) for group in RIDDEN for family in things.names(group)]
# typical riding positions, to check also riders of vehicles that have no family of their own
POSITIONS = {
    "motorcycle": RidingPosition(
        (-0.2, 0, 0.81),
        ((0.25, 0.32, 1.06), (0.25, -0.32, 1.06)),
        ((-0.1, 0.26, 0.34), (-0.1, -0.26, 0.34)),
    ),
    "scooter": RidingPosition(
        (-0.2, 0, 0.79),
        ((0.3, 0.28, 1.03), (0.3, -0.28, 1.03)),
        ((0.15, 0.12, 0.29), (0.15, -0.12, 0.29)),
    ),
}
TOUCH_M = 0.03  # largest distance of hands from grips and of soles from pedals
SIZE_M = 0.03  # largest error of `Thing.size_m` that is promised


def vehicle(group, family, seed=0):
    return things.draw(group, np.random.default_rng([seed]), family)


def positions():
    drawn = [things.riding_position(vehicle(group, family)) for group, family in VEHICLES]
    return [*drawn, *POSITIONS.values()]


@pytest.mark.parametrize("height", [1.58, 1.75, 1.92])
def test_hands_and_feet_reach_and_bones_keep_their_lengths(height):
    for position in positions():
        body, at = seated(Body(height_m=height, stoop_deg=4.0), position)
        for k, side in enumerate("lr"):
            forearm = at[f"wrist_{side}"] - at[f"elbow_{side}"]
            palm = at[f"wrist_{side}"] + PALM_M * body.scale * forearm / np.linalg.norm(forearm)
            assert np.linalg.norm(palm - position.grips[k]) < TOUCH_M
            foot = at[f"foot_{side}"]
            across = np.array([-foot[2], 0.0, foot[0]])
            sole = at[f"ankle_{side}"] + body.scale * (BALL_M * foot - ANKLE_M * across)
            assert np.linalg.norm(sole - position.feet[k]) < TOUCH_M
            for a, b, length in (
                ("hip", "knee", body.thigh_m),
                ("knee", "ankle", body.shin_m),
                ("shoulder", "elbow", body.upper_arm_m),
                ("elbow", "wrist", body.forearm_m),
            ):
                apart = np.linalg.norm(at[f"{a}_{side}"] - at[f"{b}_{side}"])
                # 0.2 %: a limb that would have to be fully stretched is kept slightly bent
                assert apart == pytest.approx(length, rel=2e-3)
        over = at["pelvis"] - position.saddle
        assert 0.05 < over[2] < 0.15 and abs(over[1]) < 1e-9


def test_riders_slide_and_lean_as_little_as_they_must():
    """Compare with a search that computes the back for each slide and lean in turn."""
    leans = set()
    for position in positions():
        body, at = seated(Body(height_m=1.7, stoop_deg=4.0), position)
        arm = STRETCHED * (body.upper_arm_m + body.forearm_m + PALM_M * body.scale)
        saddle = np.array(position.saddle) + [0.0, 0.0, SEATED_M * body.scale * body.girth]
        tried = (
            (lean, spine(body, saddle + [slide, 0.0, 0.0], float(np.radians(lean))))
            for slide in SLIDES_M
            for lean in LEANS_DEG
        )
        lean, expected = next(
            (lean, back)
            for lean, back in tried
            if np.linalg.norm(np.array(position.grips[0]) - back["shoulder_l"]) <= arm
        )
        leans.add(lean)
        assert all(np.array_equal(at[name], joint) for name, joint in expected.items())
    assert len(leans) > 2


def test_the_mesh_of_a_rider_touches_grips_and_pedals():
    bicycle = vehicle("bicycle", "city_bicycle")
    rider = things.rider_of(bicycle, np.random.default_rng(1))
    mesh = things.build(rider, "near")
    position = things.riding_position(bicycle)
    for name, points in (("hand", position.grips), ("shoe", position.feet)):
        parts = [p.vertices for p in mesh.parts if p.name in (name, "sole")]
        for point in points:
            nearest = min(np.linalg.norm(v - point, axis=1).min() for v in parts)
            assert nearest < TOUCH_M + 0.011  # plus a sampling step of the surface


def test_a_rider_alone_has_the_box_that_it_states():
    bicycle = vehicle("bicycle", "city_bicycle")
    rider = things.rider_of(bicycle, np.random.default_rng(2))
    low, high = extent_m(things.build(rider, "far"))
    assert high - low == pytest.approx(rider.size_m, abs=SIZE_M)
    assert (low + high) / 2 == pytest.approx(rider.centre_m, abs=SIZE_M)
    assert rider.category == "person" and rider.vehicle == bicycle


def test_a_rider_with_the_vehicle_is_one_thing_on_the_ground():
    both = vehicle("rider", "city_bicycle", 3)
    mesh = things.build(both, "far")
    low, high = extent_m(mesh)
    assert high - low == pytest.approx(both.size_m, abs=SIZE_M)
    assert abs(low[2]) < 0.01
    assert {"tyre", "head"} <= {part.name for part in mesh.parts}


def test_nobody_rides_a_car():
    car = things.draw("car", np.random.default_rng(0))
    with pytest.raises(ValueError, match="group 'car' has no rider.*bicycle"):
        things.rider_of(car, np.random.default_rng(0))


@pytest.mark.slow
def test_thirty_five_riders_are_distinct():
    seen = set()
    for seed in range(48):
        group, family = VEHICLES[seed % len(VEHICLES)]
        ridden = vehicle(group, family, seed)
        rider = things.rider_of(ridden, np.random.default_rng([seed, 7]))
        mesh = things.build(rider, "far")
        seen.add((family, ridden.paint, frozenset((p.name, p.material) for p in mesh.parts)))
    # riders differ in the vehicle's family or paint, or in garments or their materials
    assert len(seen) >= 45


def test_a_bicycle_has_the_size_that_it_states():
    bicycle = vehicle("bicycle", "city_bicycle")
    low, high = extent_m(things.build(bicycle, "near"))
    assert high - low == pytest.approx(bicycle.size_m, abs=SIZE_M)
    assert abs(low[2]) < 0.01


def test_riders_keep_the_budget_of_people():
    rider = things.rider_of(vehicle("bicycle", "city_bicycle"), np.random.default_rng(4))
    for detail in ("middle", "far"):
        count = sum(len(part.faces) for part in things.build(rider, detail).parts)
        assert count <= people.TRIANGLES[detail]

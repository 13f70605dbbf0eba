"""Placement: the positions of all objects of a scene, computed from its seed before any mesh is
made.

Places are (s, y): s in metres along the road from the point below the camera, y in metres to the
left of the road's middle line. Random numbers are drawn in a fixed order, so that the same seed
gives the same places.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .geometry.surroundings.ground import EDGE_M, Ground

if TYPE_CHECKING:
    from .night_drive import NightDrive

OWN_LANE_M = -1.75  # middle of the camera's lane
# own headlamps: metres ahead of the camera, to either side, above the road
OWN_LAMPS = (2.0, 0.65, 0.65)
# headlamps of a car: ahead of its middle, to either side, above the road
CAR_LAMP = (2.25, 0.68, 0.70)
RAIL_Y_M = 5.6
RAIL_M = (26.0, 150.0)
LAMP_POST_Y_M = 6.4
LAMP_POST_FIRST_M = 62.0
LAMP_POST_STEP_M = 30.0
MARKER_POSTS_M = (22.0, 47.0, 72.0, 97.0, 122.0, 147.0)
MARKER_POST_Y_M = 5.1
# signs: kind, metres along the road and to its left
SIGNS = (("deer", 19.5, -5.4), ("limit", 44.0, 5.4))
SHRUBS = 40
SHRUB_M = (18.0, 130.0)
SHRUB_Y_M = (7.0, 10.0)
HOUSE = (96.0, -26.0)
HOUSE_TURN_DEG = 225.0  # the lit windows face the road and the camera
FAR_STEP_M = 0.09  # length of the coarser sections of vehicles beyond 40 m
SIDE_WALK_Y_M = EDGE_M - 0.25  # pedestrians walk on the paved shoulder

DRIVING = ("low_beam", "position", "tail", "marker", "sign")
BRAKING = ("brake", "brake_high")
PARKED = ("position", "tail", "marker", "indicator_front", "indicator_rear")
# share of all plants, least |y|, m
PLANTS = {
    "oak": (0.20, 13.0),
    "birch": (0.12, 13.0),
    "spruce": (0.33, 15.0),
    "bush": (0.35, 10.5),
}


@dataclass(frozen=True)
class Spot:
    """One object: its recipe (see `builders`), category, place, turn, and the kinds of its lamps
    that are on.
    """

    name: str
    recipe: tuple
    category: str
    s_m: float = 0.0
    y_m: float = 0.0
    turn_deg: float = 0.0
    scale: float = 1.0
    z_m: float | None = None  # height over the datum; None: on the ground
    lamps: tuple[str, ...] = ()


def eye(ground: Ground, camera_height_m: float) -> np.ndarray:
    """Return the camera's position in the world, m."""
    return ground.on(0.0, OWN_LANE_M, camera_height_m)


def bearing_deg(point: np.ndarray, seen_from: np.ndarray) -> float:
    """Return the horizontal angle at which one point is seen from another, to the left of +x."""
    d = np.asarray(point, float) - seen_from
    return float(np.degrees(np.arctan2(d[1], d[0])))


def oncoming_lamp(ground: Ground, s_m: float) -> np.ndarray:
    """Return the position (3,), m, of the headlamp of an oncoming car at `s_m` that is nearer to
    the roadside.
    """
    ahead, side, height = CAR_LAMP
    return ground.on(s_m - ahead, -OWN_LANE_M + side, height)


def walk_beside(ground: Ground, y_m: float, bearing: float, seen_from: np.ndarray) -> float:
    """Return the place s, 6 to 150 m, at which the camera sees a walker at a bearing. The bearing
    falls with s.

    Parameters
    ----------
    ground : road surface, on which the walker stands.
    y_m : distance of the walker to the left of the road's middle, m.
    bearing : angle to the left of +x at which the camera sees the walker, degrees.
    seen_from : (3,) place of the camera, m.
    """
    from scipy.optimize import brentq

    def beyond_deg(s_m: float) -> float:
        return bearing_deg(ground.on(s_m, y_m), seen_from) - bearing

    nearest = 6.0
    farthest = 150.0
    if beyond_deg(nearest) <= 0:
        return nearest
    if beyond_deg(farthest) > 0:
        return farthest
    return brentq(beyond_deg, nearest, farthest)


def traffic(drive: NightDrive, s: dict, rng: np.random.Generator) -> list[Spot]:
    """Return the vehicles: one ahead, one oncoming, one parked, and further ones up to a drawn
    number.

    Parameters
    ----------
    drive : the scene, for numbers of vehicles and brake lamps.
    s : places along the road by name, m.
    rng : random numbers of the draw.
    """
    count = rng.integers(drive.vehicles[0], drive.vehicles[1] + 1)
    paints = rng.permutation(["blue", "silver", "red", "green", "grey", "sand"])
    gaps = rng.uniform([18, 17, 17], [26, 24, 25])
    ahead = (*DRIVING, *BRAKING) if drive.braking else DRIVING
    spots = [
        Spot(
            "car oncoming",
            ("car", "suv", str(paints[0])),
            "car",
            s["oncoming"],
            -OWN_LANE_M,
            180,
            lamps=DRIVING,
        ),
        Spot(
            "car ahead",
            ("car", "sedan", str(paints[1])),
            "car",
            s["ahead"],
            OWN_LANE_M,
            lamps=ahead,
        ),
        Spot("truck parked", ("truck",), "truck", s["truck"], -6.0, lamps=PARKED),
        Spot(
            "van oncoming",
            ("car", "van", "white", FAR_STEP_M),
            "car",
            s["oncoming"] + gaps[0],
            -OWN_LANE_M,
            180,
            lamps=DRIVING,
        ),
        Spot(
            "car further ahead",
            ("car", "hatchback", str(paints[2]), FAR_STEP_M),
            "car",
            s["ahead"] + gaps[1],
            OWN_LANE_M,
            lamps=DRIVING,
        ),
        Spot(
            "bus oncoming",
            ("bus",),
            "bus",
            s["oncoming"] + gaps[0] + gaps[2] + 8,
            -OWN_LANE_M,
            180,
            lamps=DRIVING,
        ),
    ]
    return spots[:count]


def living(drive: NightDrive, s: dict, rng: np.random.Generator) -> list[Spot]:
    """Return the people and animals: a walker next to the oncoming headlamps, a rider, a worker, a
    child and deer, up to drawn numbers.

    Parameters
    ----------
    drive : the scene, for numbers of people and animals.
    s : places along the road by name, m.
    rng : random numbers of the draw.
    """
    people = rng.integers(drive.people[0], drive.people[1] + 1)
    animals = rng.integers(drive.animals[0], drive.animals[1] + 1)
    turn = rng.uniform(-15, 15)
    phase = rng.uniform(0, 1, 3)
    further = rng.uniform(20, 45)
    look = int(rng.integers(0, 3))
    y = SIDE_WALK_Y_M
    spots = [
        Spot(
            "pedestrian",
            ("person", look, round(float(phase[0]), 2)),
            "person",
            s["pedestrian"],
            y,
            180 + turn,
        ),
        Spot(
            "bicycle",
            ("bicycle",),
            "bicycle",
            s["cyclist"],
            -3.75,
            lamps=("bike_front", "bike_tail"),
        ),
        Spot("rider", ("rider",), "person", s["cyclist"], -3.75),
        Spot(
            "worker",
            ("person", 3, round(float(phase[1]), 2)),
            "person",
            s["truck"] - 9.5,
            -5.0,
            160,
        ),
        Spot(
            "child",
            ("person", 4, round(float(phase[2]), 2)),
            "person",
            s["pedestrian"] + further,
            y,
            180 - turn,
        ),
    ]
    deer = [
        Spot("stag", ("deer", True, 1.0), "deer", s["deer"], -8.8, 118 + turn),
        Spot("hind", ("deer", False, 0.05), "deer", s["deer"] + 8, -11.2, 130 + turn),
        Spot("second hind", ("deer", False, 0.05), "deer", s["deer"] + 22, -13.0, 40 - turn),
    ]
    # the second person is the rider, who comes with a bicycle
    return spots[: people + 1 if people > 1 else people] + deer[:animals]


def plants(drive: NightDrive, rng: np.random.Generator) -> list[Spot]:
    """Return trees and bushes on both sides of the road, none in front of or inside the house."""
    spots = []
    total = int(rng.integers(drive.trees[0], drive.trees[1] + 1))
    for kind, (share, near_m) in PLANTS.items():
        for k in range(round(share * total)):
            s = rng.uniform(20, 230)
            y = rng.choice([-1.0, 1.0]) * (near_m + rng.gamma(1.6, 7))
            turn = rng.uniform(0, 360)
            scale = rng.uniform(0.75, 1.2)
            if y < 0 and abs(s - HOUSE[0]) < 16 and y > HOUSE[1] - 10:
                y = -y
            spots.append(
                Spot(
                    f"{kind} {k}",
                    ("plant", kind),
                    "tree" if kind != "bush" else "vegetation",
                    s,
                    y,
                    turn,
                    scale,
                )
            )
    return spots


def furniture(drive: NightDrive, ground: Ground, rng: np.random.Generator) -> list[Spot]:
    """Return the fixed objects (road, land, grass, guard rail, street lamps, posts, signs, a house)
    and the headlamps of the camera's car.

    Parameters
    ----------
    drive : the scene, for the number of street lamps.
    ground : road surface.
    rng : random numbers of the draw.
    """
    lamps = int(rng.integers(drive.street_lamps[0], drive.street_lamps[1] + 1))
    posts = [LAMP_POST_FIRST_M + k * LAMP_POST_STEP_M for k in range(lamps)]
    return [
        Spot("road", ("road", ground), "road"),
        Spot("field", ("field", ground), "vegetation"),
        Spot("grass", ("grass", ground), "vegetation"),
        Spot("guard rail", ("guard_rail", ground, *RAIL_M, RAIL_Y_M), "guard rail"),
        Spot(
            "own headlamps",
            ("own_headlamps", *OWN_LAMPS),
            "own vehicle",
            0.0,
            OWN_LANE_M,
            lamps=DRIVING,
        ),
        Spot("house", ("house",), "building", *HOUSE, HOUSE_TURN_DEG, lamps=("window",)),
        *(
            Spot(
                f"street lamp {k}",
                ("street_lamp",),
                "street lamp",
                s,
                LAMP_POST_Y_M,
                180,
                lamps=("street",),
            )
            for k, s in enumerate(posts)
        ),
        *(
            Spot(f"marker post {k} {side}", ("marker_post",), "post", s, y)
            for k, s in enumerate(MARKER_POSTS_M)
            for side, y in (("left", MARKER_POST_Y_M), ("right", -MARKER_POST_Y_M))
        ),
        *(Spot(f"sign {kind}", ("sign", kind), "sign", s, y) for kind, s, y in SIGNS),
    ]


def shrubs(drive: NightDrive, s: dict) -> list[Spot]:
    """Return shrubs on both verges, none next to the deer or in front of them, none in the lay-by
    of the truck.
    """
    rng = np.random.default_rng([drive.seed, SHRUBS])
    spots = []
    for k in range(min(SHRUBS, drive.trees[0])):
        at = rng.uniform(*SHRUB_M)
        y = rng.choice([-1.0, 1.0]) * rng.uniform(*SHRUB_Y_M)
        turn = rng.uniform(0, 360)
        scale = rng.uniform(0.5, 1.1)
        by_deer = y < 0 and at < s["deer"] + 26
        in_lay_by = y < 0 and abs(at - s["truck"]) < 16
        if not (by_deer or in_lay_by):
            spots.append(Spot(f"shrub {k}", ("shrub",), "vegetation", at, y, turn, scale))
    return spots


def plan(drive: NightDrive) -> tuple[Ground, list[Spot]]:
    """Return the ground and the spots of all objects of a `night_drive`; the same seed gives the
    same plan.
    """
    rng = np.random.default_rng(drive.seed)
    s = {
        name: float(rng.uniform(*getattr(drive, f"{name}_m")))
        for name in ("oncoming", "ahead", "cyclist", "deer", "truck")
    }
    beside = float(rng.uniform(*drive.pedestrian_beside_deg))
    ground = Ground(
        float(rng.uniform(*drive.curvature_per_m)), drive.seed, (s["truck"] - 14, s["truck"] + 12)
    )
    seen_from = eye(ground, drive.camera_height_m)
    lamp_bearing = bearing_deg(oncoming_lamp(ground, s["oncoming"]), seen_from)
    s["pedestrian"] = walk_beside(ground, SIDE_WALK_Y_M, lamp_bearing + beside, seen_from)
    return ground, traffic(drive, s, rng) + living(drive, s, rng) + furniture(
        drive, ground, rng
    ) + plants(drive, rng) + shrubs(drive, s)

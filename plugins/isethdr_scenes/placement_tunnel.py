"""Placement: the positions of all objects of a tunnel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .geometry.surroundings.ground import Ground
from .geometry.surroundings.tube import LUMINAIRE_M, LUMINAIRE_Z_M, WALKWAY_M
from .placement import BRAKING, DRIVING, OWN_LAMPS, OWN_LANE_M, PLANTS, Spot

if TYPE_CHECKING:
    from .tunnel import Tunnel

CLOSED_M = -80.0  # place of the dark end behind the camera
OUTSIDE_M = 220.0  # length of the land beyond the exit
WALKWAY_Y_M = 4.9


def plan(tunnel: Tunnel) -> tuple[Ground, list[Spot]]:
    """Return the ground and the spots of all objects of a `tunnel`; the same seed gives the same
    plan.
    """
    rng = np.random.default_rng(tunnel.seed)
    s = {
        name: float(rng.uniform(*getattr(tunnel, f"{name}_m")))
        for name in ("exit", "ahead", "oncoming", "pedestrian")
    }
    paints = rng.permutation(["blue", "silver", "red", "green", "grey", "sand"])
    look = int(rng.integers(0, 3))
    phase = round(float(rng.uniform(0, 1)), 2)
    ground = Ground(0.0, tunnel.seed)
    ahead = (*DRIVING, *BRAKING) if tunnel.braking else DRIVING
    spots = [
        Spot(
            "car ahead",
            ("car", "hatchback", str(paints[0])),
            "car",
            s["ahead"],
            OWN_LANE_M,
            lamps=ahead,
        ),
        Spot(
            "car oncoming",
            ("car", "sedan", str(paints[1])),
            "car",
            s["oncoming"],
            -OWN_LANE_M,
            180,
            lamps=DRIVING,
        ),
        Spot(
            "pedestrian",
            ("person", look, phase),
            "person",
            s["pedestrian"],
            -WALKWAY_Y_M,
            z_m=WALKWAY_M,
        ),
        Spot("tunnel", ("tunnel", ground, CLOSED_M, s["exit"]), "tunnel"),
        Spot("road", ("road", ground, CLOSED_M, s["exit"] + OUTSIDE_M), "road"),
        Spot("field", ("field", ground, s["exit"], s["exit"] + OUTSIDE_M), "vegetation"),
        Spot(
            "own headlamps",
            ("own_headlamps", *OWN_LAMPS),
            "own vehicle",
            0.0,
            OWN_LANE_M,
            lamps=DRIVING,
        ),
    ]
    places = np.arange(CLOSED_M / 4, s["exit"] - 2, tunnel.luminaire_spacing_m)
    spots += [
        Spot(
            f"luminaire {k} {side}",
            ("luminaire",),
            "street lamp",
            float(p),
            y,
            turn_deg,
            z_m=LUMINAIRE_Z_M,
            lamps=("tunnel",),
        )
        for k, p in enumerate(places)
        for side, y, turn_deg in (("left", LUMINAIRE_M, 0.0), ("right", -LUMINAIRE_M, 180.0))
    ]
    return ground, spots + _trees(tunnel, s["exit"], rng)


def _trees(tunnel: Tunnel, exit_m: float, rng: np.random.Generator) -> list[Spot]:
    kinds, shares = zip(*((kind, share) for kind, (share, _) in PLANTS.items()))
    spots = []
    for k in range(int(rng.integers(tunnel.trees[0], tunnel.trees[1] + 1))):
        kind = str(rng.choice(kinds, p=np.array(shares) / sum(shares)))
        s = exit_m + rng.uniform(15, OUTSIDE_M - 15)
        y = rng.choice([-1.0, 1.0]) * rng.uniform(10, 45)
        spots.append(
            Spot(
                f"{kind} {k}",
                ("plant", kind),
                "tree" if kind != "bush" else "vegetation",
                s,
                y,
                rng.uniform(0, 360),
                rng.uniform(0.75, 1.2),
            )
        )
    return spots

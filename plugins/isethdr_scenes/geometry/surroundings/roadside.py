"""Roadside furniture: guard rail, marker post and street lamp."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, lit, pose
from ..mesh.primitives import box, grid, tube
from .ground import Ground

TILT_DEG = 5.0  # tilt of the axis of a luminaire towards the road
# profile of a W-beam in metres: distance towards the road, height
W_BEAM = (
    (0, -0.155),
    (0.03, -0.15),
    (0.08, -0.115),
    (0.08, -0.075),
    (0.015, -0.03),
    (0.015, 0.03),
    (0.08, 0.075),
    (0.08, 0.115),
    (0.03, 0.15),
    (0, 0.155),
)


def guard_rail(ground: Ground, start_m: float, end_m: float, y: float) -> Assembly:
    """Return a W-beam guard rail on posts, facing the road, with both ends bent down.

    Parameters
    ----------
    ground : the ground that carries the posts.
    start_m : start along the road, m.
    end_m : end along the road, m.
    y : lateral position in metres, positive to the left.
    """
    m = Assembly("guard_rail")
    face = float(np.sign(-y))
    profile = np.array(W_BEAM)
    s = np.arange(start_m, end_m + 0.01, 1.0)
    ramp = np.clip(np.minimum(s - start_m, end_m - s) / 6, 0, 1)
    middle = ground.height(s, np.full_like(s, y)) + 0.15 + 0.45 * ramp
    along, out = np.meshgrid(s, profile[:, 0], indexing="ij")
    m.add(
        grid(
            ground.points(along, y + face * out, middle[:, None] + profile[None, :, 1]),
            "beam",
            "galvanised",
        )
    )
    for k, q in enumerate(np.arange(start_m + 2, end_m, 2.0)):
        z = float(np.interp(q, s, middle))
        post = box((0, 0, 0), (0.10, 0.055, 1.0), "post", "galvanised")
        m.add(post.moved(ground.place(q, y - face * 0.06, z=z - 0.42)))
        if k % 6 == 0:
            reflector = box(
                (-0.02, 0, 0), (0.01, 0.06, 0.09), "reflector", "reflector_amber", 0.003
            )
            m.add(reflector.moved(ground.place(q, y + face * 0.03, z=z)))
    return m


def marker_post() -> Assembly:
    """Return a delineator post of 1 m with a black band and a reflector that faces -x."""
    return Assembly("marker_post").add(
        box((0, 0, 0.5), (0.10, 0.12, 1.0), "post", "lamp_white", 0.03),
        box((0, 0, 0.80), (0.104, 0.124, 0.20), "band", "plastic_black", 0.03),
        box((-0.053, 0, 0.80), (0.006, 0.05, 0.15), "reflector", "post_reflector", 0.002),
    )


def street_lamp(name: str = "street_lamp", tall: float = 8.0, reach: float = 1.8) -> Assembly:
    """Return a street lamp. Its pole stands at the origin, its arm reaches towards +y over the
    road, and its luminaire emits downwards.

    Parameters
    ----------
    name : name of the assembly.
    tall : height of the luminaire, m.
    reach : length of the arm, m.
    """
    tilt = np.radians(TILT_DEG)
    t = np.linspace(0, np.pi / 2, 9)
    arm = np.stack([0 * t, reach * (1 - np.cos(t)), tall - 0.9 + 0.9 * np.sin(t)], 1)
    m = Assembly(name).add(
        tube([(0, 0, -0.2), (0, 0, 1.0)], 0.095, "base", "galvanised", 14),
        tube([(0, 0, 1.0), (0, 0, tall - 0.9)], [0.075, 0.05], "pole", "galvanised", 12),
        tube(arm, 0.038, "arm", "galvanised", 10),
    )
    m.add(
        box((0, reach + 0.32, tall + 0.02), (0.30, 0.78, 0.13), "luminaire", "galvanised", 0.055),
        box((0, 0, 0.55), (0.02, 0.10, 0.32), "hatch", "steel").moved(pose(x=-0.09)),
    )
    return m.add(
        *lit(
            box((0, reach + 0.36, tall - 0.047), (0.20, 0.50, 0.012), "street", "lamp_white"),
            "street",
            (0.0, np.sin(tilt), -np.cos(tilt)),
        )
    )

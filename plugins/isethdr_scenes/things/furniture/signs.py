"""Road signs on posts: warnings, priorities, prohibitions, mandatory signs and directions.

A sign faces +x, towards its viewers.
"""

from __future__ import annotations

from functools import lru_cache

from ...geometry.mesh.piece import Assembly
from ...geometry.mesh.primitives import box, tube
from ..ranges import drawn, generator, read
from ..thing import Detail, Thing
from .sign_faces import FILE, extent, face, sign_data

POST_M = 0.032  # radius of a post
FOOT_M = 0.4  # depth of a post below the ground
CLAMP_M = 0.024  # distance between post and panel
FACE_M = 0.012  # depth of all layers of a panel


def shares() -> dict[str, float]:
    """Return the signs with their shares."""
    return {name: float(entry["share"]) for name, entry in read(FILE)["signs"].items()}


def kind(name: str) -> str:
    """Return the kind of a sign: warning, priority, prohibition, mandatory or direction."""
    return sign_data(name)["kind"]


@lru_cache(maxsize=512)
def thing(family: str, variant: int) -> Thing:
    """Return a sign; its mesh is not built."""
    width, low, high = extent(family, sign_data(family)["half_width_m"])
    top = _bottom_m(family, variant) + high - low
    size = (2 * POST_M + CLAMP_M + FACE_M, max(width, 2 * POST_M), top)
    category = "stop sign" if family == "stop" else "sign"
    return Thing(family, variant, category, size, "sign")


def _bottom_m(family: str, variant: int) -> float:
    """Return the height of the lower edge of the panel, m."""
    return drawn(sign_data(family).get("bottom_m", "1.8 .. 2.2"), generator(family, variant))


def build(thing: Thing, detail: Detail) -> Assembly:
    """Return the mesh of a sign."""
    entry = sign_data(thing.family)
    radius = entry["half_width_m"]
    width, low, high = extent(thing.family, radius)
    length, _, top = thing.size_m
    middle = top - high
    post_x = POST_M - length / 2
    panel_x = post_x + POST_M + CLAMP_M
    wide = width > 1.0
    posts = (-0.3 * width, 0.3 * width) if wide else (0.0,)
    sides = {"near": 12, "middle": 8, "far": 5}[detail]
    out = Assembly(f"sign_{thing.family}")
    for y in posts:
        end = top - 0.06 if wide else middle + 0.25 * (top - middle)
        out.add(
            tube([(post_x, y, -FOOT_M), (post_x, y, end)], POST_M, "post", "galvanised", sides),
            box(
                (panel_x - CLAMP_M / 2, y, middle),
                (CLAMP_M, 0.10, 0.5 * (high - low)),
                "clamp",
                "galvanised",
            ),
        )
    return out.add(*face(thing.family, radius, (panel_x, 0.0, middle)))

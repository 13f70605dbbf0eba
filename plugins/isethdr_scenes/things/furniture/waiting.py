"""Bus stops: a shelter with glass walls, a bench, a lit panel and the stop's sign."""

from __future__ import annotations

from ...geometry.mesh.piece import Piece
from ...geometry.mesh.primitives import tube
from ..thing import Detail
from .parts import boxes, quads, shining
from .sign_faces import face

DEPTH_M = 1.6
TOP_M = 2.5
POST_Y_M = 0.5  # distance from the shelter to the post of the sign
PANEL_M = (1.1, 1.6)  # width and height of the lit panel
SIGN_TOP_M = 2.9
SIGN_RADIUS_M = 0.25


def bus_stop_size(n: dict) -> tuple[float, float, float]:
    """Return the size of a bus stop, m."""
    return DEPTH_M, n["length_m"] + POST_Y_M + SIGN_RADIUS_M, SIGN_TOP_M


def bus_stop(n: dict, detail: Detail) -> list[Piece]:
    """Return a shelter that is open towards +x, with a sign next to it.

    The lit panel closes the right end, as seen from the road.
    """
    length = n["length_m"]
    width = bus_stop_size(n)[1]
    # y of the shelter's ends
    low = -width / 2
    high = -width / 2 + length
    back = -DEPTH_M / 2
    front = DEPTH_M / 2
    posts = [
        (x, y, TOP_M / 2) for x in (back + 0.05, front - 0.35) for y in (low + 0.05, high - 0.05)
    ]
    middle = (low + high) / 2
    x = back + 0.05
    half = length / 2 - 0.1
    # the glass is one sheet, because thin glass needs no second side
    glass = [
        (x, middle + a * half, 1.2 + b * 0.95) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]
    pieces = [
        boxes((0, middle, TOP_M - 0.06), (DEPTH_M, length, 0.12), "roof", "metal_grey"),
        boxes(posts, (0.07, 0.07, TOP_M - 0.1), "post", "metal_grey"),
        quads([glass], "back", "glass"),
        boxes((back + 0.35, middle, 0.46), (0.4, 0.7 * length, 0.05), "seat", "wood"),
        boxes(
            [(back + 0.35, middle + s * 0.25 * length, 0.2) for s in (1, -1)],
            (0.3, 0.06, 0.5),
            "leg",
            "metal_grey",
        ),
    ]
    wide, tall = PANEL_M
    y = high - 0.15
    z = 0.4 + tall / 2
    pieces.append(boxes((0, y, z), (wide + 0.1, 0.16, tall + 0.1), "box", "metal_grey"))
    for side in (1, -1):
        at = y + side * 0.082
        corners = [
            (side * wide / 2, at, z - tall / 2),
            (-side * wide / 2, at, z - tall / 2),
            (-side * wide / 2, at, z + tall / 2),
            (side * wide / 2, at, z + tall / 2),
        ]
        panel = quads([corners], f"panel {side}", "lamp_white")
        pieces.append(shining(panel, "panel", (0.0, float(side), 0.0)))
    post_y = width / 2 - SIGN_RADIUS_M
    pieces.append(
        tube([(0, post_y, -0.3), (0, post_y, SIGN_TOP_M - 0.02)], 0.03, "post", "galvanised", 8)
    )
    at = (0.05, post_y, SIGN_TOP_M - SIGN_RADIUS_M)
    return pieces + face("halt", SIGN_RADIUS_M, at)

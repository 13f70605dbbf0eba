"""Round lamps in the front of a vehicle; a dipped beam is a lens of several modules (see
`lamps`).
"""

from __future__ import annotations

import numpy as np

from ...lamps import low_beam
from ..mesh.cutting import subdivide
from ..mesh.piece import Assembly, Piece, join, lit, shift
from ..mesh.primitives import lathe
from .body import Body

HOT_SHARE = 0.62  # radius of the hot spot's module, as a share of the lens
# the ring around it: sectors of the other modules, degrees from +y (left) over +z (up)
SECTORS = {
    "stray": (30, 150),
    "shoulder_right": (150, 198),
    "side_right": (198, 246),
    "middle": (246, 294),
    "side_left": (294, 342),
    "shoulder_left": (342, 390),
}


def round_lamp(
    body: Body,
    part: Piece | None,
    kind: str,
    tag: str,
    centre,
    radius: float,
    bezel=0.012,
    material="lamp_white",
):
    """Cut a chrome bezel and a round lens at `centre` (y, z) out of `part`, or out of the paint
    where None.

    `kind` is a lamp kind, `low_beam` for all modules of `LOW_BEAM`, or `reflector` for a dark one.
    Returns what is left of `part`.
    """

    def beyond(p, r):  # distance outside the circle; the rear of the body never counts
        u, _, z, y = body.at(p)
        return np.maximum(np.hypot(y - centre[0], z - centre[1]) - r, u - 0.6)

    name = f"{kind}.front_{tag}"
    if part is None:
        ring, rest = body.take(f"{name}.bezel", "chrome", beyond(None, radius + bezel)), None
    else:
        ring, rest = body.carve(part, f"{name}.bezel", "chrome", beyond(part, radius + bezel))
    body.parts = [p for p in body.parts if p is not ring]
    ring = subdivide(ring)  # a lens is smaller than the sheet's quads
    dark = kind in ("reflector", "low_beam")
    lens, _ = body.carve(
        ring, name, "chrome" if kind == "reflector" else material, beyond(ring, radius)
    )
    if not dark:
        body.parts = [p for p in body.parts if p is not lens] + lit(lens, kind, (1.0, 0.0, 0.0))
    if kind == "low_beam":
        _modules(body, lens, tag, centre, radius)
    return rest


def _modules(body, lens, tag, centre, radius):
    """Split a lens into the hot spot in the middle and the sectors of the ring around it."""
    body.parts = [p for p in body.parts if p is not lens]
    lens = subdivide(lens)
    y, z = (lens.vertices[:, 1:] - centre).T
    _, rest = body.carve(
        lens,
        f"low_beam.hot.{tag}",
        "lamp_white",
        np.hypot(y, z) - HOT_SHARE * radius,
        low_beam("hot"),
    )
    for module, (first, last) in SECTORS.items():
        y, z = (rest.vertices[:, 1:] - centre).T
        a, b = np.radians([first, last])
        outside = np.maximum(y * np.sin(a) - z * np.cos(a), z * np.cos(b) - y * np.sin(b))
        _, rest = body.carve(
            rest, f"low_beam.{module}.{tag}", "lamp_white", outside, low_beam(module)
        )


def own_headlamps(
    forward_m: float, half_track_m: float, height_m: float, radius: float = 0.05
) -> Assembly:
    """Return the two dipped beams of the camera's own car: bare lenses, so that nothing blocks the
    view.

    The model's origin is on the road below the camera.
    """
    out, r = Assembly("own_headlamps"), HOT_SHARE * radius
    for tag, side in (("left", 1), ("right", -1)):
        at = shift(forward_m, side * half_track_m, height_m)
        lenses = {"hot": lathe([(r, 0), (0.001, 0.001)], "hot", "lamp_white", 20, "x")}
        lenses |= {
            m: lathe([(radius, -0.001), (r, 0)], m, "lamp_white", 8, "x", np.radians(turn))
            for m, turn in SECTORS.items()
        }
        for module, lens in lenses.items():
            name = f"low_beam.{module}.{tag}"
            out.add(join([lens.moved(at)], name).named(name, lamp=low_beam(module)))
    return out

"""Round lamps in the front of a vehicle."""

from __future__ import annotations

import numpy as np

from ...lamps import lamp
from ..mesh.cutting import subdivide
from ..mesh.piece import Assembly, Piece, join, lit, shift
from ..mesh.primitives import lathe
from .body import Body


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

    `kind` is a lamp kind, or `reflector` for a dark one.
    Returns what is left of `part`.
    """

    def beyond(p, r):  # distance outside the circle; the rear of the body never counts
        u, _, z, y = body.at(p)
        return np.maximum(np.hypot(y - centre[0], z - centre[1]) - r, u - 0.6)

    name = f"{kind}.front_{tag}"
    if part is None:
        ring = body.take(f"{name}.bezel", "chrome", beyond(None, radius + bezel))
        remaining = None
    else:
        ring, remaining = body.carve(part, f"{name}.bezel", "chrome", beyond(part, radius + bezel))
    body.parts = [p for p in body.parts if p is not ring]
    ring = subdivide(ring)  # a lens is smaller than the sheet's quads
    lens, _ = body.carve(
        ring, name, "chrome" if kind == "reflector" else material, beyond(ring, radius)
    )
    if kind != "reflector":
        body.parts = [p for p in body.parts if p is not lens] + lit(lens, kind, (1.0, 0.0, 0.0))
    return remaining


def own_headlamps(
    forward_m: float, half_track_m: float, height_m: float, radius: float = 0.05
) -> Assembly:
    """Return the two dipped beams of the camera's own car: bare lenses, so that nothing blocks the
    view.

    The model's origin is on the road below the camera.
    """
    out = Assembly("own_headlamps")
    for tag, side in (("left", 1), ("right", -1)):
        at = shift(forward_m, side * half_track_m, height_m)
        name = f"low_beam.{tag}"
        lens = lathe([(radius, 0), (0.001, 0.001)], name, "lamp_white", 24, "x")
        beam = lamp("low_beam", (1.0, 0.0, 0.0))
        out.add(join([lens.moved(at)], name).named(name, lamp=beam))
    return out

"""Round lamps in the front of a vehicle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...lamps import lamp
from ..mesh.cutting import subdivide
from ..mesh.piece import Assembly, Piece, join, lit, shift
from ..mesh.primitives import lathe
from .body import Body


@dataclass(frozen=True)
class RoundLamp:
    """A round lens in a chrome bezel at the front of a vehicle."""

    kind: str  # kind of the lamp, or `reflector` for one that does not emit
    tag: str  # `left` or `right`, for its name
    centre_m: tuple[float, float]  # y and z of the middle of the lens
    radius_m: float  # radius of the lens
    bezel_m: float = 0.012  # width of the bezel
    material: str = "lamp_white"  # material of the lens


def round_lamp(body: Body, part: Piece | None, shape: RoundLamp) -> Piece | None:
    """Cut a round lamp out of a body. Return the rest of `part`, or None.

    Parameters
    ----------
    body : body that is cut and gets the lamp.
    part : piece that the lamp is cut out of; None: the paint.
    shape : kind, side, place, radius and material of the lamp.
    """

    def beyond(
        p: Piece, r: float | np.ndarray
    ) -> np.ndarray:  # distance outside the circle, m; positive at the rear of the body
        u, _, z, y = body.at(p)
        return np.maximum(np.hypot(y - shape.centre_m[0], z - shape.centre_m[1]) - r, u - 0.6)

    name = f"{shape.kind}.front_{shape.tag}"
    rim_m = shape.radius_m + shape.bezel_m
    if part is None:
        ring = body.take(f"{name}.bezel", "chrome", beyond(None, rim_m))
        remaining = None
    else:
        ring, remaining = body.carve(part, f"{name}.bezel", "chrome", beyond(part, rim_m))
    if body.shell.coarse and shape.kind == "reflector":
        return remaining
    body.parts = [p for p in body.parts if p is not ring]
    ring = subdivide(ring)  # a lens is smaller than the sheet's quads
    material = "chrome" if shape.kind == "reflector" else shape.material
    lens, _ = body.carve(ring, name, material, beyond(ring, shape.radius_m))
    if shape.kind != "reflector":
        others = [p for p in body.parts if p is not lens]
        body.parts = others + lit(lens, shape.kind, (1.0, 0.0, 0.0))
    return remaining


def own_headlamps(
    forward_m: float, half_track_m: float, height_m: float, radius: float = 0.05
) -> Assembly:
    """Return the two dipped beams of the camera's own car, as lenses without a car.

    So nothing blocks the view. The origin of the model is on the road below the camera.

    Parameters
    ----------
    forward_m : distance of the lenses ahead of the camera, m.
    half_track_m : half the distance between both lamps, m.
    height_m : height of the lamps above the road, m.
    radius : radius of the lenses, m.
    """
    out = Assembly("own_headlamps")
    for tag, side in (("left", 1), ("right", -1)):
        at = shift(forward_m, side * half_track_m, height_m)
        name = f"low_beam.{tag}"
        lens = lathe([(radius, 0), (0.001, 0.001)], name, "lamp_white", 24, "x")
        beam = lamp("low_beam", (1.0, 0.0, 0.0))
        out.add(join([lens.moved(at)], name).named(name, lamp=beam))
    return out

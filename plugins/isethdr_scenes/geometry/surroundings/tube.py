"""A road tunnel: walls and vault, walkways, portal, and the luminaires under its ceiling."""

from __future__ import annotations

import numpy as np

from isethdr_core.scene import Opening

from ..mesh.piece import Assembly, Piece, flat, lit
from ..mesh.primitives import box, grid
from .ground import EDGE_M, Ground

HALF_WIDTH_M = 5.4  # half the clear width
SPRING_M = 2.6  # height at which the vault begins
TOP_M = 5.6  # height of the crown of the vault
SKIN_M = 0.3  # thickness of the lining and of the road's bed
WALKWAY_M = 0.15  # height of the walkways along both walls
PORTAL_M = 9.0  # radius of the portal wall
LUMINAIRE_M = 2.2  # distance of the luminaires to either side of the middle
LUMINAIRE_Z_M = 4.75  # height of the luminaires above the datum
TILT_DEG = 5.0  # tilt of the axis of a luminaire towards the middle


def section(n: int = 24) -> np.ndarray:
    """Return the inner outline (k, 2) of (y, z), m, from the foot of the left wall over the vault
    to the foot of the right wall.
    """
    t = np.linspace(0, np.pi, n)
    vault = np.stack([HALF_WIDTH_M * np.cos(t), SPRING_M + (TOP_M - SPRING_M) * np.sin(t)], 1)
    return np.concatenate([[(HALF_WIDTH_M, -0.4)], vault, [(-HALF_WIDTH_M, -0.4)]])


def tunnel(ground: Ground, start_m: float, end_m: float) -> Assembly:
    """Return a tunnel with a closed dark end and an open portal. Its faces look inwards.

    Parameters
    ----------
    ground : course of the road.
    start_m : place of the closed end along the road, m.
    end_m : place of the open end along the road, m.
    """
    outline = section()
    s = np.arange(start_m, end_m + 0.1, 2.0)
    s[-1] = end_m

    skin = np.arange(start_m - SKIN_M, end_m + 0.1, 4.0)
    skin[-1] = end_m
    bulge = outline + SKIN_M * np.sign(outline - [0, SPRING_M / 2])

    def sheet(low: int, high: int, name: str, material: str) -> Piece:
        """Return the strip of the lining between two indices of the outline."""
        along, k = np.meshgrid(s, np.arange(low, high + 1), indexing="ij")
        return grid(ground.points(along, outline[k, 0], outline[k, 1]), name, material)

    last = len(outline) - 1
    m = Assembly("tunnel").add(
        sheet(0, 1, "wall", "tunnel_tile"),
        sheet(1, last - 1, "vault", "tunnel_lining"),
        sheet(last - 1, last, "wall", "tunnel_tile"),
    )
    for side in (1, -1):
        y = side * np.array([EDGE_M - 0.02, EDGE_M, EDGE_M + 0.02, HALF_WIDTH_M])
        z = np.array([-0.3, WALKWAY_M - 0.02, WALKWAY_M, WALKWAY_M])
        order = slice(None) if side > 0 else slice(None, None, -1)
        along, k = np.meshgrid(s, np.arange(4)[order], indexing="ij")
        m.add(flat(grid(ground.points(along, y[k], z[k]), "walkway", "concrete")))
    # A dark skin surrounds the tunnel. Smooth shading lets some light paths leave the lining at its
    # back. They end at the skin; without it they would reach the sky.
    along, k = np.meshgrid(skin, np.arange(len(bulge)), indexing="ij")
    m.add(grid(ground.points(along, bulge[k, 0], bulge[k, 1]), "skin", "gap", close_v=True))
    m.add(_end_wall(ground, skin[0], bulge))
    return m.add(_end_wall(ground, start_m, outline), _portal(ground, end_m, outline))


def _end_wall(ground: Ground, s: float, outline: np.ndarray) -> Piece:
    rim = ground.points(s, outline[:, 0], outline[:, 1])
    middle = np.broadcast_to(rim.mean(0), rim.shape)
    return grid(np.stack([middle, rim], 0), "end", "gap", close_v=True)


def _portal(ground: Ground, s: float, outline: np.ndarray) -> Piece:
    """Return the wall around the mouth. It keeps light of the sky off the back of the lining."""
    direction = outline - [0, SPRING_M / 2]
    outer = direction * (PORTAL_M / np.linalg.norm(direction, axis=1, keepdims=True)) + [
        0,
        SPRING_M / 2,
    ]
    ring = np.stack([outline, outer], 0)
    return grid(ground.points(s, ring[..., 0], ring[..., 1]), "portal", "concrete")


def mouth(ground: Ground, end_m: float) -> Opening:
    """Return the open end of a tunnel at `end_m` along the road, as high as its crown."""
    right = ground.points(end_m, -HALF_WIDTH_M)
    across = ground.points(end_m, HALF_WIDTH_M) - right
    return Opening(tuple(right.tolist()), tuple(across.tolist()), (0.0, 0.0, TOP_M))


def luminaire() -> Assembly:
    """Return one luminaire of the left row, at the origin. It emits downwards, tilted towards -y.

    A luminaire of the right row is the same, turned by 180 degrees.
    """
    tilt = np.radians(TILT_DEG)
    axis = (0.0, -np.sin(tilt), -np.cos(tilt))
    return Assembly("luminaire").add(
        box((0, 0, 0.07), (1.3, 0.26, 0.12), "housing", "galvanised", 0.03),
        *lit(box((0, 0, 0), (1.2, 0.20, 0.012), "tunnel", "lamp_white"), "tunnel", axis),
    )

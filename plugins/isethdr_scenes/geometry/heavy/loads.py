"""Loads of trucks and trailers: box, curtain sides, tank, tipping trough, flatbed with crates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..mesh.piece import Assembly, flat, pose
from ..mesh.primitives import box, grid, lathe, tube
from .shapes import Load


@dataclass(frozen=True)
class Place:
    """Place and paint of a load: x of its front and rear end, z of its floor and top, half its
    width, all in m.
    """

    x0: float
    x1: float
    z0: float
    z1: float
    half: float
    paint: str
    seed: int = 0

    @property
    def middle(self) -> float:
        """Return x of the middle, m."""
        return (self.x0 + self.x1) / 2

    @property
    def length(self) -> float:
        """Return the length, m."""
        return self.x0 - self.x1


def add_load(m: Assembly, load: Load, place: Place) -> None:
    """Add a load.

    Parameters
    ----------
    m : assembly that gets the load.
    load : kind of load, a key of `LOADS`.
    place : where the load lies on the vehicle, and its paint and seed.
    """
    LOADS[load](m, place)


def _box(m: Assembly, p: Place) -> None:
    """Add a box with ribs, rails and two rear doors with their bars."""
    tall = p.z1 - p.z0
    zc = (p.z0 + p.z1) / 2
    m.add(box((p.middle, 0, zc), (p.length, 2 * p.half - 0.02, tall), "cargo", p.paint, 0.02))
    for s in (1, -1):
        for x in np.arange(p.x1 + 0.06, p.x0, 0.75):
            at = (x, s * (p.half - 0.003), zc)
            m.add(box(at, (0.035, 0.014, tall - 0.1), "rib", p.paint))
        for z in (p.z0 + 0.04, p.z1 - 0.04):
            m.add(box((p.middle, s * (p.half - 0.02), z), (p.length, 0.05, 0.08), "rail", "alloy"))
        door = (p.x1 - 0.012, s * 0.5 * p.half, zc)
        m.add(box(door, (0.02, 0.97 * p.half, tall - 0.12), "rear_door", p.paint))
        for y in (0.18, 0.76):
            path = [
                (p.x1 - 0.03, s * y * p.half, p.z0 + 0.1),
                (p.x1 - 0.03, s * y * p.half, p.z1 - 0.1),
            ]
            m.add(tube(path, 0.013, "door_bar", "steel", 6))


def _curtain(m: Assembly, p: Place) -> None:
    """Add curtain sides with straps, a roof, a sill, posts at the corners and rear doors."""
    tall = p.z1 - p.z0
    zc = (p.z0 + p.z1) / 2
    inside = (p.length - 0.02, 2 * p.half - 0.06, tall - 0.02)
    m.add(box((p.middle, 0, zc), inside, "cargo", p.paint, 0.02))
    m.add(box((p.middle, 0, p.z1 - 0.05), (p.length, 2 * p.half - 0.01, 0.10), "roof", "alloy"))
    m.add(box((p.middle, 0, p.z0 + 0.05), (p.length, 2 * p.half - 0.01, 0.12), "sill", "steel"))
    for s in (1, -1):
        for x in np.arange(p.x1 + 0.35, p.x0 - 0.2, 0.62):
            at = (x, s * (p.half - 0.022), zc)
            m.add(box(at, (0.045, 0.012, tall - 0.16), "strap", "plastic_black"))
        for x in (p.x0 - 0.03, p.x1 + 0.03):
            post = (x, s * (p.half - 0.03), zc)
            m.add(box(post, (0.07, 0.07, tall), "post", "alloy"))
        door = (p.x1 - 0.012, s * 0.5 * p.half, zc)
        m.add(box(door, (0.02, 0.97 * p.half, tall - 0.12), "rear_door", "box_white"))
        path = [(p.x1 - 0.03, s * 0.2, p.z0 + 0.1), (p.x1 - 0.03, s * 0.2, p.z1 - 0.1)]
        m.add(tube(path, 0.013, "door_bar", "steel", 6))


def _tank(m: Assembly, p: Place) -> None:
    """Add an elliptical tank with hoops, a gangway and hatches on top, and a ladder at its rear."""
    gangway = 0.10
    tall = p.z1 - p.z0 - gangway
    zc = p.z0 + tall / 2
    half = p.half - 0.01
    ends = np.linspace(0, np.pi / 2, 7)
    dome = 0.28
    left = [(np.sin(a), p.x1 + dome - dome * np.cos(a)) for a in ends]
    right = [(np.cos(a), p.x0 - dome + dome * np.sin(a)) for a in ends]
    profile = [(max(r, 1e-3), x) for r, x in left + right]
    shape = lathe(profile, "tank", p.paint, 40, "x")
    m.add(shape.moved(pose(z=zc, scale=(1, half, tall / 2))))
    for x in np.linspace(p.x1 + dome, p.x0 - dome, 5):
        hoop = lathe([(1.005, x - 0.03), (1.005, x + 0.03)], "hoop", "steel", 40, "x")
        m.add(hoop.moved(pose(z=zc, scale=(1, half, tall / 2))))
    m.add(box((p.middle, 0, p.z1 - 0.06), (p.length - 1.0, 0.55, 0.05), "gangway", "galvanised"))
    for x in np.linspace(p.x1 + 0.9, p.x0 - 0.9, 4):
        m.add(box((x, 0, p.z1 - 0.05), (0.5, 0.5, 0.10), "hatch", "steel", 0.02))
    for s in (1, -1):
        m.add(box((p.middle, s * 0.5, p.z0 + 0.06), (p.length - 0.5, 0.14, 0.24), "saddle"))
        hose = [(p.x1 + 0.6, s * (half - 0.1), p.z0), (p.x0 - 0.6, s * (half - 0.1), p.z0)]
        m.add(tube(hose, 0.07, "hose_pipe", "plastic_black", 10))
        rail = [(p.x1 + 0.02, s * 0.2, p.z0 - 0.1), (p.x1 + 0.02, s * 0.2, p.z1 - 0.03)]
        m.add(tube(rail, 0.016, "ladder", "galvanised", 6))
    for z in np.arange(p.z0, p.z1 - 0.05, 0.3):
        m.add(box((p.x1 + 0.02, 0, z), (0.03, 0.4, 0.03), "rung", "galvanised"))


def _tipper(m: Assembly, p: Place) -> None:
    """Add a trough with ribbed walls, a canopy over the cab, and a heap of gravel."""
    tall = p.z1 - p.z0
    wall = p.z0 + 0.80 * tall
    top = p.half - 0.01
    foot = top - 0.14
    section = np.array(
        [(foot, p.z0), (top, wall), (top - 0.06, wall), (foot - 0.06, p.z0 + 0.08)], float
    )
    ring = np.concatenate([section, section[::-1] * [-1, 1]])
    ends = [np.column_stack([np.full(len(ring), x), ring]) for x in (p.x0 - 0.05, p.x1 + 0.10)]
    m.add(flat(grid(np.stack(ends), "trough", p.paint, close_v=True, smooth=False)))
    m.add(box((p.middle, 0, p.z0 + 0.04), (p.length - 0.1, 2 * foot, 0.08), "floor", p.paint))
    front = (p.x0 - 0.05, 0, (p.z0 + p.z1) / 2)
    m.add(box(front, (0.08, 2 * top, tall), "front_wall", p.paint))
    m.add(box((p.x0 + 0.28, 0, p.z1 - 0.03), (0.75, 2 * top - 0.1, 0.06), "canopy", p.paint))
    gate = (p.x1 + 0.05, 0, (p.z0 + wall) / 2)
    m.add(box(gate, (0.08, 2 * top - 0.06, wall - p.z0), "tailgate", p.paint))
    lean = np.degrees(np.arctan2(top - foot, wall - p.z0))
    for s in (1, -1):
        for x in np.arange(p.x1 + 0.5, p.x0 - 0.2, 0.7):
            rib = box((0, 0, 0), (0.09, 0.06, wall - p.z0 - 0.02), "rib", p.paint)
            turn = np.eye(4)
            angle = np.radians(-s * lean)
            turn[1:3, 1:3] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            turn[:3, 3] = x, s * ((top + foot) / 2 - 0.02), (p.z0 + wall) / 2
            m.add(rib.moved(turn))
        m.add(box((p.middle, s * (top - 0.03), wall), (p.length - 0.1, 0.06, 0.08), "lip", p.paint))
    rng = np.random.default_rng(p.seed)
    x = np.linspace(p.x1 + 0.2, p.x0 - 0.2, 22)
    y = np.linspace(-top + 0.1, top - 0.1, 12)
    heap = np.sin(np.pi * np.linspace(0, 1, 22))[:, None] * np.sin(np.pi * np.linspace(0, 1, 12))
    z = wall - 0.28 + 0.40 * heap + 0.025 * rng.normal(size=heap.shape)
    points = np.stack(np.broadcast_arrays(x[:, None], y[None, :], z), -1)
    m.add(grid(points, "gravel", "gravel"))


def _flatbed(m: Assembly, p: Place) -> None:
    """Add a flatbed with low side boards, a headboard and crates."""
    rng = np.random.default_rng(p.seed)
    m.add(box((p.middle, 0, p.z0 + 0.06), (p.length, 2 * p.half - 0.02, 0.12), "bed", "wood"))
    head = (p.x0 - 0.04, 0, (p.z0 + p.z1) / 2)
    m.add(box(head, (0.08, 2 * p.half - 0.04, p.z1 - p.z0), "headboard", p.paint))
    board = 0.42
    for s in (1, -1):
        at = (p.middle, s * (p.half - 0.03), p.z0 + 0.12 + board / 2)
        m.add(box(at, (p.length - 0.1, 0.04, board), "board", p.paint))
        for x in np.linspace(p.x1 + 0.05, p.x0 - 0.15, 5):
            post = (x, s * (p.half - 0.035), p.z0 + 0.12 + board / 2)
            m.add(box(post, (0.08, 0.06, board + 0.06), "post", "steel"))
    gate = (p.x1 + 0.03, 0, p.z0 + 0.12 + board / 2)
    m.add(box(gate, (0.04, 2 * p.half - 0.08, board), "tailgate", p.paint))
    x = p.x0 - 0.35
    room = p.z1 - p.z0 - 0.2
    while x > p.x1 + 1.5:
        long = float(rng.uniform(0.8, 1.4))
        if rng.random() < 0.75:
            tall = float(rng.uniform(0.45, 0.95)) * room
            wide = float(rng.uniform(1.0, 2 * p.half - 0.4))
            material = ("wood", "cloth_grey", "paint_green", "box_white")[int(rng.integers(4))]
            at = (x - long / 2, 0, p.z0 + 0.12 + tall / 2)
            m.add(box(at, (long, wide, tall), "crate", material, 0.01))
            m.add(box(at, (0.05, wide + 0.01, tall + 0.01), "strap", "paint_orange"))
        x -= long + 0.15


LOADS: dict[Load, Callable[[Assembly, Place], None]] = {
    "box": _box,
    "curtain": _curtain,
    "tank": _tank,
    "tipper": _tipper,
    "flatbed": _flatbed,
}

"""The outer skin of a vehicle: profiles and a plan outline lofted into one smooth sheet.

In all modules of vehicles u is the distance from the front end, m: x = length / 2 - u.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mesh.cutting import curve
from ..mesh.piece import Piece
from ..mesh.primitives import grid

ENDS_M = 0.6  # length of either end, out of which lamps are cut
THINNED = 4  # between the ends, a coarse shell has only every fourth section


@dataclass(frozen=True)
class Shell:
    """Shape of a body. Profiles are ((u, z), ...) in metres.

    `upper` is the roof line, and `belt` is the shoulder line.
    """

    length: float
    width: float
    upper: tuple
    belt: tuple
    clearance: float = 0.17
    lean: float = 0.36  # inward lean of the cabin, per metre of height
    crown: float = 3.2  # exponent of the cabin section; higher values are boxier
    # radius of the corners in plan, radius in profile, flat share of the end face
    front_round: tuple = (0.34, 0.14, 0.78)
    rear_round: tuple = (0.28, 0.12, 0.82)
    sweep: tuple = (0.10, 0.06)  # plan curvature of front and rear, 1/m
    soft: float = 0.035  # rounding of the profile corners
    step: float = 0.055  # spacing of the sections
    flare: float = 0.018  # height of the bulge around the wheels
    # whether there are fewer sections between both ends, for vehicles that are far away; the ends
    # stay fine, because lamps are cut out of them
    coarse: bool = False

    def profiles(self) -> tuple[Callable[..., Any], Callable[..., Any]]:
        """Return the roof line and the shoulder line as functions of u."""
        return curve(self.upper, self.soft), curve(self.belt, self.soft)


def _half_width(s: Shell, u: np.ndarray) -> np.ndarray:
    out = np.ones_like(u)
    for d, (r, _, share) in ((u, s.front_round), (s.length - u, s.rear_round)):
        t = np.clip(d / r, 0, 1)
        out *= share + (1 - share) * np.sqrt(np.maximum(0, 1 - (1 - t) ** 2.3))
    return s.width / 2 * out


def _stations(s: Shell) -> np.ndarray:
    a = max(s.front_round[:2])
    ends = a * (1 - np.cos(np.linspace(0, np.pi / 2, 15)))
    b = max(s.rear_round[:2])
    rear = s.length - b * (1 - np.cos(np.linspace(0, np.pi / 2, 15)))[::-1]
    mid = np.linspace(a, s.length - b, int((s.length - a - b) / s.step) + 2)[1:-1]
    if s.coarse:
        at_ends = (mid < ENDS_M) | (mid > s.length - ENDS_M)
        mid = mid[at_ends | (np.arange(len(mid)) % THINNED == 0)]
    return np.concatenate([ends, mid, rear])


def loft(shell: Shell, axles: Sequence[float] = (), tyre: float = 0.33) -> Piece:
    """Return the closed skin of a body, with smooth normals and a bulge around each wheel.

    Parameters
    ----------
    shell : measures of the body.
    axles : distances of the axles from the front end, m.
    tyre : radius of the tyres, m.
    """
    s = shell
    upper, belt = s.profiles()
    u = _stations(s)
    zt = upper(u)
    zs = belt(u)
    zb = np.full(len(u), s.clearance)
    w = _half_width(s, u)
    for d, (_, r, share) in ((u, s.front_round), (s.length - u, s.rear_round)):
        t = np.clip(d / r, 0, 1)
        e = 1 - (1 - share) * 0.55 * (1 - np.sqrt(np.maximum(0, 1 - (1 - t) ** 2)))
        mid = 0.5 * (zb + zs)
        zt = mid + (zt - mid) * e
        zs = mid + (zs - mid) * e
        zb = mid + (zb - mid) * e
    q = np.linspace(0, 1, 24)
    side = curve(
        [
            (0, 0.86),
            (0.05, 0.935),
            (0.14, 0.968),
            (0.3, 0.985),
            (0.5, 1.0),
            (0.72, 0.998),
            (0.86, 0.982),
            (1, 0.945),
        ],
        0.03,
    )(q)
    y1 = w[:, None] * side
    z1 = zb[:, None] + (zs - zb)[:, None] * q
    cy, cz = _superellipse(s.crown, 20, 15)
    h = (zt - zs)[:, None]
    z2 = zs[:, None] + h * cz
    y2 = w[:, None] * side[-1] * cy * (1 - s.lean * np.maximum(h, 0) * cz)
    y2[:, -1] = 0
    y0 = y1[:, :1] * np.linspace(0, 1, 6)[None, :-1]
    y = np.concatenate([y0, y1, y2], 1)
    z = np.concatenate([np.repeat(zb[:, None], 5, 1), z1, z2], 1)
    uu = np.repeat(u[:, None], y.shape[1], 1)
    p = np.stack([uu, y, z], -1)
    front = _cap(p[0], -1)
    rear = _cap(p[-1], 1)[::-1]
    p = np.concatenate([front, p, rear])
    full = np.concatenate([p, (p * [1, -1, 1])[:, -2:0:-1]], 1)
    full[..., 1] += np.sign(full[..., 1]) * _bulge(s, full, axles, tyre)
    t = full[..., 0] / s.length
    blend = lambda k: k * k * (3 - 2 * k)
    bend = s.sweep[0] * blend(np.clip(1 - 2 * t, 0, 1)) - s.sweep[1] * blend(
        np.clip(2 * t - 1, 0, 1)
    )
    full[..., 0] += bend * full[..., 1] ** 2
    full[..., 0] = s.length / 2 - full[..., 0]
    return grid(full, "body", "paint", close_v=True)


def _cap(loop: np.ndarray, sign: int) -> np.ndarray:
    mid = np.array([loop[0, 0], 0, 0.5 * (loop[:, 2].min() + loop[:, 2].max())])
    k = np.linspace(0, 1, 12)[:-1][:, None, None]
    p = mid + (loop - mid) * k
    p[..., 0] += sign * 0.025 * (1 - k[..., 0] ** 2)
    return p


def _bulge(s: Shell, p: np.ndarray, axles: Sequence[float], tyre: float) -> np.ndarray:
    out = np.zeros(p.shape[:2])
    for a in axles:
        r = np.hypot(p[..., 0] - a, p[..., 2] - tyre)
        side = np.abs(p[..., 1]) > 0.6 * s.width / 2
        out += side * s.flare * np.exp(-(((r - tyre - 0.06) / 0.07) ** 2))
    return out


def _superellipse(n: float, up: int, across: int) -> tuple[np.ndarray, np.ndarray]:
    """Return y and z of points on y^n + z^n = 1, from (1, 0) to (0, 1), without the first.

    The points are denser towards the corner y = z. `up` points lead to it and `across` from it.
    """
    corner = 0.5 ** (1 / n)
    t = np.linspace(0, 1, up + 1)[1:]
    z = corner * (1 - (1 - t) ** 1.6)
    y = corner * (1 - np.linspace(0, 1, across + 1)[1:] ** 1.6)
    other = lambda k: (1 - k**n) ** (1 / n)
    return np.concatenate([other(z), y]), np.concatenate([z, other(y)])

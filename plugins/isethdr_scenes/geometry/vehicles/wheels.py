"""Wheels and licence plates."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import mirrored, shift
from ..mesh.primitives import box, grid, lathe


def wheel(x, y, radius, width, rim=0.66, spokes=5, name="wheel", style="alloy"):
    """Return a wheel standing on z = 0 with its face towards +y (towards -y when y < 0)."""
    w, r, d = width / 2, radius, radius * rim
    tyre = [
        (d, -w * 0.82),
        (d + 0.25 * (r - d), -w),
        (r - 0.035, -w * 0.96),
        (r - 0.008, -w * 0.78),
        (r, -w * 0.5),
        (r, w * 0.5),
        (r - 0.008, w * 0.78),
        (r - 0.035, w * 0.96),
        (d + 0.25 * (r - d), w),
        (d, w * 0.82),
    ]
    parts = [
        lathe(tyre, "tyre", "tyre", 40),
        lathe(
            [
                (d, w * 0.82),
                (d * 1.0, w * 0.92),
                (d * 0.93, w * 0.88),
                (d * 0.9, w * 0.2),
                (d * 0.88, -w * 0.8),
            ],
            "barrel",
            "alloy",
            40,
        ),
    ]
    if style == "steel":
        parts += [
            lathe(
                [
                    (d * 0.92, w * 0.3),
                    (d * 0.8, w * 0.5),
                    (d * 0.55, w * 0.05),
                    (d * 0.5, w * 0.35),
                    (d * 0.3, w * 0.4),
                    (0.001, w * 0.4),
                ],
                "disc",
                "steel",
                32,
            )
        ]
        holes = 8
        for k in range(holes):
            a = 2 * np.pi * k / holes
            parts.append(
                lathe([(0.13 * d, 0), (0.001, 0.004)], "hole", "gap", 12).moved(
                    shift(np.sin(a) * 0.7 * d, w * 0.3, np.cos(a) * 0.7 * d)
                )
            )
    else:
        parts.append(lathe([(d * 0.90, -w * 0.1), (0.001, -w * 0.1)], "brake", "lamp_dark", 32))
        parts.append(lathe([(d * 0.62, w * 0.15), (0.2 * d, w * 0.15)], "brake_disc", "steel", 32))
        for k in range(spokes):
            a = 2 * np.pi * k / spokes
            for fork in (-0.11, 0.11):
                s = np.linspace(0.12, 0.95, 6)
                ang = a + fork * s * 1.3
                c = np.stack([np.sin(ang) * s * d, w * (0.62 + 0.22 * s), np.cos(ang) * s * d], -1)
                t = (
                    np.stack([np.cos(ang), 0 * ang, -np.sin(ang)], -1)
                    * (0.055 + 0.02 * s)[:, None]
                    * d
                )
                low = np.array([0, -0.28 * w, 0])
                ring = np.stack([c - t + low, c - t * 0.75, c + t * 0.75, c + t + low], 1)
                parts.append(grid(ring, "spoke", "alloy", close_v=True, smooth=False))
        parts.append(
            lathe(
                [(d * 0.24, w * 0.5), (d * 0.22, w * 0.72), (d * 0.16, w * 0.78), (0.001, w * 0.8)],
                "hub",
                "alloy",
                20,
            )
        )
    m = np.eye(4)
    m[:3, 3] = x, y, radius
    out = []
    for p in parts:
        p = mirrored(p) if y < 0 else p
        out.append(p.moved(m).named(f"{name}.{p.name}"))
    return out


def plate(x, z, facing, width=0.52, height=0.112, ink=7, seed=0):
    """Return a licence plate with meaningless dark glyphs; facing is +1 (front) or -1 (rear)."""
    rng = np.random.default_rng(seed)
    out = [box((x, 0, z), (0.012, width, height), "plate", "plate_white", 0.004)]
    for y in (np.arange(ink) - (ink - 1) / 2) * width / (ink + 1.5):
        xx = x + facing * 0.007
        for dy, dz, w, h in (
            (-0.018, 0, 0.011, 0.07),
            (0.018, 0, 0.011, 0.07),
            (0, 0.03, 0.036, 0.011),
            (0, 0, 0.036, 0.011),
            (0, -0.03, 0.036, 0.011),
        ):
            if rng.random() < 0.7:
                out.append(box((xx, y + dy, z + dz), (0.003, w, h), "plate.ink", "plate_ink"))
    return out

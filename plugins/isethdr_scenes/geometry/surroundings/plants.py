"""Trees, bushes and grass."""

from __future__ import annotations

import numpy as np

from ..mesh.piece import Assembly, Piece, join, unit
from ..mesh.primitives import Stem, tube, tubes

BEND = 0.25  # distance of a leaf's side corners behind its stalk and tip / width of the leaf
BOUGH_STEPS = 6
BOUGH_LIFT = 0.06  # added to the direction at each step, upwards


def cards(
    centres: np.ndarray,
    normals: np.ndarray,
    along: np.ndarray,
    size_m: tuple[float | np.ndarray, float | np.ndarray],
    name: str,
    material: str,
) -> Piece:
    """Return leaves as one piece. Each leaf is a kite of two triangles with a fold between them.

    Parameters
    ----------
    centres, normals, along : (n, 3): the points where the leaves begin, m; the directions that the
        leaves face; their directions from there to the tip.
    size_m : length and width of the leaves, m; each is a number, or (n,).
    name, material : name and material of the piece.
    """
    n = len(centres)
    along = unit(along - normals * (along * normals).sum(1, keepdims=True))
    side = np.cross(normals, along)
    l, w = (np.broadcast_to(size, n)[:, None] for size in size_m)
    v = np.stack(
        [
            centres,
            centres + along * l * 0.45 + side * w / 2 - normals * w * BEND,
            centres + along * l,
            centres + along * l * 0.45 - side * w / 2 - normals * w * BEND,
        ],
        1,
    ).reshape(-1, 3)
    k = 4 * np.arange(n)[:, None]
    return Piece(
        name,
        v,
        np.concatenate([k + [0, 2, 1], k + [0, 3, 2]]),
        material,
        np.repeat(unit(normals), 4, 0),
    )


def _bough(
    rng: np.random.Generator,
    start: np.ndarray,
    heading: np.ndarray,
    length: float,
    radius: float,
    wander: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the path (points, 3) of a bough and its radii, m.

    At each step its direction gets a random change of size `wander` and turns upwards.
    """
    p = start
    d = heading
    out = [start]
    for _ in range(BOUGH_STEPS):
        d = unit(d + rng.normal(size=3) * wander + [0, 0, BOUGH_LIFT])
        p = p + d * length / BOUGH_STEPS
        out.append(p)
    return np.array(out), radius * np.linspace(1, 0.55, BOUGH_STEPS + 1)


def broadleaf(
    name: str = "tree", height: float = 9.0, leaves: int = 26000, seed: int = 0, bark: str = "bark"
) -> Assembly:
    """Return a deciduous tree: trunk and three generations of boughs, with leaves around the last.

    Parameters
    ----------
    name : name of the assembly.
    height : approximate height of the tree, m.
    leaves : number of leaves.
    seed : seed of boughs and leaves.
    bark : name of the material of the wood.
    """
    rng = np.random.default_rng(seed)
    wood = []
    twigs = []

    def grow(
        start: np.ndarray, heading: np.ndarray, length: float, radius: float, generation: int
    ) -> None:
        path, r = _bough(rng, start, heading, length, radius, 0.12 if generation else 0.05)
        wood.append(Stem(path, r, max(4, 10 - 2 * generation)))
        if generation >= 3:
            twigs.append(path)
            return
        for k in range((9, 5, 5)[generation]):
            t = rng.uniform(0.35, 1.0) if generation else 0.34 + 0.66 * (k + rng.uniform(0, 1)) / 9
            i = min(int(t * (len(path) - 1)), len(path) - 2)
            at = path[i] + (t * (len(path) - 1) - i) * (path[i + 1] - path[i])
            d = unit(path[i + 1] - path[i])
            turn = 2.4 * k + rng.uniform(-0.5, 0.5)
            e = unit(np.cross(d, [0.3, 0.5, 0.81] if abs(d[2]) < 0.9 else [1.0, 0, 0]))
            q = np.cos(turn) * e + np.sin(turn) * np.cross(d, e)
            spread = np.radians(rng.uniform(35, 65))
            grow(
                at,
                unit(d * np.cos(spread) + q * np.sin(spread)),
                length * rng.uniform(0.42, 0.62),
                r[i] * 0.55,
                generation + 1,
            )

    grow(np.array([0, 0, -0.1]), np.array([0, 0, 1.0]), height * 0.62, height * 0.024, 0)
    pts = np.concatenate(twigs)
    pick = rng.integers(0, len(pts), leaves)
    c = pts[pick] + rng.normal(size=(leaves, 3)) * 0.035 * height
    normal = unit(
        rng.normal(size=(leaves, 3)) * 0.8 + [0, 0, 0.7] + 0.5 * unit(c - [0, 0, height * 0.6])
    )
    size = rng.uniform(0.10, 0.19, leaves)
    light = rng.random(leaves) < 0.35
    args = lambda m: (
        c[m],
        normal[m],
        rng.normal(size=(m.sum(), 3)) - [0, 0, 0.4],
        (size[m], size[m] * 0.7),
    )
    return Assembly(name).add(
        tubes(wood, "wood", bark),
        cards(*args(~light), "leaves", "leaf"),
        cards(*args(light), "leaves.light", "leaf_light"),
    )


def conifer(
    name: str = "conifer", height: float = 11.0, needles: int = 30000, seed: int = 0
) -> Assembly:
    """Return a spruce: whorls of drooping boughs with sprays of needles.

    Parameters
    ----------
    name : name of the assembly.
    height : height of the trunk, m.
    needles : number of sprays of needles.
    seed : seed of boughs and needles.
    """
    rng = np.random.default_rng(seed)
    trunk = [(0, 0, -0.1), (0.02, 0, height * 0.5), (0, 0, height)]
    wood = [Stem(trunk, [height * 0.018, height * 0.011, 0.01], 9)]
    pts = []
    dirs = []
    z = 0.09 * height
    while z < height * 0.985:
        k = 1 - z / height
        for _ in range(int(5 + 4 * k)):
            a = rng.uniform(0, 6.28)
            l = height * (0.015 + 0.25 * k**0.9) * rng.uniform(0.8, 1.1)
            t = np.linspace(0, 1, 7)[:, None]
            out = np.array([np.cos(a), np.sin(a), 0])
            path = (
                [0, 0, z]
                + out * l * t
                + np.array([0, 0, 1.0]) * l * (0.10 * t - (0.42 * k + 0.05) * t**2 + 0.12 * t**4)
            )
            wood.append(Stem(path, 0.012 * height * k * 0.25 + 0.006, 4))
            m = int(max(8, 40 * l))
            u = np.sqrt(rng.uniform(0.02, 1, m))
            side = (
                np.cross(out, [0, 0, 1]) * (rng.uniform(-1, 1, m) * 0.34 * l * (1.1 - u))[:, None]
            )
            at = np.stack([np.interp(u, t[:, 0], path[:, i]) for i in range(3)], 1)
            pts.append(at + side + rng.normal(size=(m, 3)) * [0.02, 0.02, 0.03] * l)
            dirs.append(out + 1.2 * side / l + rng.normal(size=(m, 3)) * 0.35 - [0, 0, 0.15])
        z += height * 0.017 * (1 + 0.8 * k)
    pts = np.concatenate(pts)
    dirs = unit(np.concatenate(dirs))
    pick = rng.integers(0, len(pts), needles)
    normal = unit(rng.normal(size=(needles, 3)) * 0.45 + [0, 0, 1])
    c = pts[pick] + rng.normal(size=(needles, 3)) * 0.05
    return Assembly(name).add(
        tubes(wood, "wood", "bark"),
        cards(
            c,
            normal,
            dirs[pick] + rng.normal(size=c.shape) * 0.3,
            (rng.uniform(0.16, 0.34, needles), rng.uniform(0.035, 0.07, needles)),
            "needles",
            "needle",
        ),
    )


def bush(name: str = "bush", size: float = 1.3, leaves: int = 5000, seed: int = 0) -> Assembly:
    """Return a bush: a lumpy shell of leaves on a few stems.

    Parameters
    ----------
    name : name of the assembly.
    size : approximate size, m; its longest radius is at most 0.58 of it.
    leaves : number of leaves.
    seed : seed of lumps and leaves.
    """
    rng = np.random.default_rng(seed)
    d = unit(rng.normal(size=(leaves, 3)))
    lumps = np.array([unit(rng.normal(size=3)) for _ in range(7)])
    r = (
        size
        * (0.42 + 0.16 * np.maximum(0, (d @ lumps.T) ** 3).max(1))
        * rng.uniform(0.7, 1.0, leaves)
    )
    c = d * r[:, None] * [1, 1, 0.8]
    c[:, 2] = np.abs(c[:, 2]) + 0.05
    n = unit(d + rng.normal(size=d.shape) * 0.6)
    stems = [
        tube(
            [
                (0, 0, 0),
                p * 0.25 * size * [1, 1, 0.3] + [0, 0, 0.2 * size],
                p * 0.3 * size * [1, 1, 0.3] + [0, 0, 0.3 * size],
            ],
            [0.02, 0.014, 0.006],
            "stem",
            "bark",
            5,
        )
        for p in lumps[:5]
    ]
    return Assembly(name).add(
        cards(c, n, rng.normal(size=d.shape), (0.09, 0.06), "leaves", "leaf_light"),
        join(stems, "stem"),
    )


def grass(
    points: np.ndarray, name: str = "grass", height: float = 0.28, seed: int = 0, dry: float = 0.25
) -> Assembly:
    """Return blades of grass. Each is bent in its middle and narrows to a tip.

    Parameters
    ----------
    points : (n, 3) roots of the blades, m.
    name : name of the assembly.
    height : nominal height of the blades, m; each blade has 0.4 to 1.2 times this height.
    seed : seed of the blades.
    dry : share of dry blades, 0 to 1.
    """
    rng = np.random.default_rng(seed)
    n = len(points)
    a = rng.uniform(0, 6.28, n)
    h = height * rng.uniform(0.4, 1.2, n)
    lean = np.stack([np.cos(a), np.sin(a), 0 * a], 1) * (h * rng.uniform(0.15, 0.7, n))[:, None]
    side = np.stack([-np.sin(a), np.cos(a), 0 * a], 1) * rng.uniform(0.003, 0.007, n)[:, None]
    up = np.stack([0 * h, 0 * h, h], 1)
    mid = points + up * 0.6 + lean * 0.35
    v = np.stack(
        [
            points - side,
            points + side,
            mid + side * 0.7,
            mid - side * 0.7,
            points + up * 0.95 + lean,
        ],
        1,
    )
    nrm = unit(unit(np.cross(side, up)) + [0, 0, 0.8])
    k = 5 * np.arange(n)[:, None]
    f = np.stack([k + [0, 1, 2], k + [0, 2, 3], k + [3, 2, 4]], 1)
    isdry = rng.random(n) < dry
    out = Assembly(name)
    for m, mat in ((~isdry, "grass"), (isdry, "grass_dry")):
        vv = v[m].reshape(-1, 3)
        ff = (f[: m.sum()]).reshape(-1, 3)
        out.add(Piece(mat, vv, ff, mat, np.repeat(nrm[m], 5, 0)))
    return out

"""Cutting: split a sheet exactly along the zero line of a scalar field, and the outlines to cut
along.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .piece import Piece, compact, face_areas, flat, unit

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


def cut(part: Piece, value: np.ndarray) -> tuple[Piece, Piece, np.ndarray]:
    """Split along value = 0 (one value per vertex) -> (negative side, positive side, seam).

    The seam is (k, 2, 2, 3): segments of the cut line, each end with position and normal.
    """
    value = np.where(np.abs(value) < 1e-7, 1e-7, value)
    v = part.vertices
    n = part.normals
    f = part.faces
    neg = value[f] < 0
    count = neg.sum(1)
    lone = np.where(count == 1, np.argmax(neg, 1), np.argmin(neg, 1))
    mixed = (count == 1) | (count == 2)
    t = f[mixed]
    row = np.arange(len(t))
    a, b, c = (t[row, (lone[mixed] + k) % 3] for k in range(3))

    def crossing(p: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        w = (value[p] / (value[p] - value[q]))[:, None]
        return v[p] + w * (v[q] - v[p]), unit(n[p] + w * (n[q] - n[p]))

    vab, nab = crossing(a, b)
    vac, nac = crossing(a, c)
    base = len(v)
    ab = base + row
    ac = base + len(t) + row
    tip = np.stack([a, ab, ac], 1)
    quad = np.concatenate([np.stack([ab, b, c], 1), np.stack([ab, c, ac], 1)])
    tip_neg = count[mixed] == 1
    allv = np.concatenate([v, vab, vac])
    alln = np.concatenate([n, nab, nac])
    two = np.concatenate([tip_neg, tip_neg])
    inside = np.concatenate([f[count == 3], tip[tip_neg], quad[~two]])
    outside = np.concatenate([f[count == 0], tip[~tip_neg], quad[two]])
    seam = np.stack([np.stack([vab, nab], 1), np.stack([vac, nac], 1)], 1)
    seam[tip_neg] = seam[tip_neg][:, ::-1]
    return (
        compact(replace(part, vertices=allv, faces=inside, normals=alln)),
        compact(replace(part, vertices=allv, faces=outside, normals=alln)),
        seam,
    )


def hem(seam: np.ndarray, shift: float | np.ndarray, name: str, material: str) -> Piece:
    """Return the strip from a seam to its copy moved by `shift`: a vector, or a distance along the
    normals, m.

    Parameters
    ----------
    seam : (n, 2, 2, 3) segments: both ends of each, as a point, m, and its normal.
    shift : vector (3,), m, or a distance along the normals, m.
    name : name of the piece.
    material : name of the material.
    """
    p = seam[:, :, 0]
    n = seam[:, :, 1]
    q = p + (n * shift if np.isscalar(shift) else np.asarray(shift, float))
    v = np.stack([p[:, 0], p[:, 1], q[:, 1], q[:, 0]], 1).reshape(-1, 3)
    k = 4 * np.arange(len(p))[:, None]
    strip = Piece(name, v, np.concatenate([k + [0, 1, 2], k + [0, 2, 3]]), material)
    # a segment along `shift` sweeps nothing
    solid = np.linalg.norm(face_areas(strip), axis=1) > 1e-12
    return flat(replace(strip, faces=strip.faces[solid]))


def polygon(points: ArrayLike, r: float = 0.0) -> Callable[..., Any]:
    """Signed distance (negative inside) to a closed 2-D polygon grown by r with round corners."""
    a = np.asarray(points, float)
    b = np.roll(a, -1, 0)

    def distance(p: np.ndarray, q: np.ndarray) -> np.ndarray:
        x, y = (np.asarray(c, float) for c in (p, q))
        nearest2 = np.full(x.shape, np.inf)
        odd = np.zeros(x.shape, bool)
        for (ax, ay), (bx, by) in zip(a, b):  # edge by edge: few numbers at a time
            ex = bx - ax
            ey = by - ay
            wx = x - ax
            wy = y - ay
            k = np.clip((wx * ex + wy * ey) / max(ex * ex + ey * ey, 1e-12), 0, 1)
            dx = wx - k * ex
            dy = wy - k * ey
            np.minimum(nearest2, dx * dx + dy * dy, out=nearest2)
            if ay != by:
                odd ^= ((ay > y) != (by > y)) & (x < ax + wy / (by - ay) * ex)
        d = np.sqrt(nearest2)
        return np.where(odd, -d, d) - r

    return distance


def curve(points: Sequence[tuple[float, float]], sigma: float = 0.0) -> Callable[..., Any]:
    """Function through (x, y) points, corners rounded by a Gaussian of width sigma."""
    from scipy.ndimage import gaussian_filter1d

    x, y = np.asarray(points, float).T
    t = np.linspace(x[0], x[-1], 2000)
    s = np.interp(t, x, y)
    if sigma:
        s = gaussian_filter1d(s, sigma / (t[1] - t[0]), mode="nearest")
    return lambda q: np.interp(q, t, s)


def subdivide(piece: Piece) -> Piece:
    """Return the piece with every face split into four at the middles of its edges."""
    v = piece.vertices
    n = piece.normals
    f = piece.faces
    edges = np.sort(f[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1)
    keys, ids = np.unique(edges[:, 0] * len(v) + edges[:, 1], return_inverse=True)
    pairs = np.stack(np.divmod(keys, len(v)), 1)
    ids = ids.reshape(-1, 3) + len(v)
    a, b, c = f.T
    ab, bc, ca = ids.T
    faces = np.concatenate(
        [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    )
    return replace(
        piece,
        faces=faces,
        vertices=np.concatenate([v, v[pairs].mean(1)]),
        normals=np.concatenate([n, unit(n[pairs].mean(1))]),
    )

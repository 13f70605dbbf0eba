"""Cutting: split a sheet exactly along the zero line of a scalar field.

Functions such as `polygon` return fields whose zero lines are the outlines of cuts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from .piece import Piece, face_sizes, flat, unit

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

REACH_M = 1.0  # twice the length of the longest face that is cut
BLOCK = 2048  # number of points whose distances are computed at a time
# Number of edges in a group of a polygon. Points that are far from a group skip all its edges.
EDGES = 8
ROUNDING = 1 + 1e-9  # factor that exceeds the rounding error of any squared distance
ROUNDING_M = 1e-6  # length that exceeds the rounding error of any distance
SLACK_M = 1e-9  # length that exceeds the rounding error of any point where an edge is crossed
LEAST_M = 1e-7  # least size of a value at a vertex; smaller ones count as this distance outside
# corners of a face in order, starting from its first, second and third corner
TURNS = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])


def cut(part: Piece, value: np.ndarray) -> tuple[Piece, Piece, np.ndarray]:
    """Split a piece along the line where `value` is 0. A vertex that no face uses stays on its
    side.

    Parameters
    ----------
    part : piece with normals.
    value : (vertices,) values that change sign at the cut.

    Returns
    -------
    The piece where `value` is negative, the piece where it is positive, and the seam (k, 2, 2, 3):
    both ends of each segment of the cut line, each end as position, m, and normal.
    """
    both = _sides(part, value, ("inside", "outside"))
    return both.inside, both.outside, both.seam()


def halves(part: Piece, value: np.ndarray) -> tuple[Piece, Piece]:
    """Return both pieces of `cut`, without the seam."""
    both = _sides(part, value, ("inside", "outside"))
    return both.inside, both.outside


def inside_of(part: Piece, value: np.ndarray) -> Piece:
    """Return the piece of `cut` where `value` is negative."""
    return _sides(part, value, ("inside",)).inside


def outside_of(part: Piece, value: np.ndarray) -> Piece:
    """Return the piece of `cut` where `value` is positive."""
    return _sides(part, value, ("outside",)).outside


class _Sides(NamedTuple):
    """Both sides of a cut, and the ends of its line."""

    inside: Piece
    outside: Piece
    ends: np.ndarray  # (2 k, 3) first ends of all segments, then their last ends, m
    normals: np.ndarray  # (2 k, 3) normals at these ends
    swapped: np.ndarray  # (k,) whether both ends of a segment change places in the seam

    def seam(self) -> np.ndarray:
        """Return the seam (k, 2, 2, 3) of the cut."""
        k = len(self.swapped)
        seam = np.empty((k, 2, 2, 3))
        for end, rows in enumerate((slice(k), slice(k, None))):
            seam[:, end, 0] = self.ends[rows]
            seam[:, end, 1] = self.normals[rows]
        seam[self.swapped] = seam[self.swapped][:, ::-1]
        return seam


def _sides(part: Piece, value: np.ndarray, wanted: tuple[str, ...]) -> _Sides:
    """Return the sides of `cut` that are wanted: `inside` and `outside`.

    A side that is not wanted is the whole piece.

    Parameters
    ----------
    part : piece with normals.
    value : (vertices,) values that change sign at the cut.
    wanted : names of the wanted sides.
    """
    below = value <= -LEAST_M
    v = part.vertices
    n = part.normals
    f = part.faces
    neg = below.view(np.int8).take(f)
    count = neg[:, 0] + neg[:, 1] + neg[:, 2]
    mixed = np.flatnonzero((count == 1) | (count == 2))
    tip_neg = count.take(mixed) == 1
    # true for the corner that lies alone on its side of the cut
    alone = neg.take(mixed, 0) == tip_neg[:, None]
    lone = alone[:, 1] + 2 * alone[:, 2]
    k = len(mixed)
    row = np.arange(k)
    a, b, c = f.take(mixed[:, None] * 3 + TURNS.take(lone, 0)).T
    # both ends of the cut in each face: the first on the edge a-b, the second on the edge a-c
    p = np.concatenate([a, a])
    q = np.concatenate([b, c])
    value_p = _not_zero(value.take(p))
    w = (value_p / (value_p - _not_zero(value.take(q))))[:, None]
    v_p = v.take(p, 0)
    n_p = n.take(p, 0)
    ends = v_p + w * (v.take(q, 0) - v_p)
    end_normals = unit(n_p + w * (n.take(q, 0) - n_p))
    ab = len(v) + row
    ac = ab + k
    tip = np.stack([a, ab, ac], 1)
    quad = np.concatenate([np.stack([ab, b, c], 1), np.stack([ab, c, ac], 1)])
    two = np.concatenate([tip_neg, tip_neg])

    def side(own: np.ndarray, corners: int, tips: np.ndarray, quads: np.ndarray) -> Piece:
        # every vertex of a side, and every end of the line, is in a face of that side
        rows = np.flatnonzero(own)
        number = np.empty(len(v) + 2 * k, np.int64)
        number[rows] = np.arange(len(rows))
        number[len(v) :] = np.arange(len(rows), len(rows) + 2 * k)
        whole = f.take(np.flatnonzero(count == corners), 0)
        return Piece(
            part.name,
            np.concatenate([v.take(rows, 0), ends]),
            number.take(np.concatenate([whole, tip[tips], quad[quads]])),
            part.material,
            np.concatenate([n.take(rows, 0), end_normals]),
            part.lamp,
        )

    inside = side(below, 3, tip_neg, ~two) if "inside" in wanted else part
    outside = side(~below, 0, ~tip_neg, two) if "outside" in wanted else part
    return _Sides(inside, outside, ends, end_normals, tip_neg)


def _not_zero(value: np.ndarray) -> np.ndarray:
    """Return values with `LEAST_M` in place of smaller sizes."""
    return np.where(np.abs(value) < LEAST_M, LEAST_M, value)


def hem(seam: np.ndarray, shift: float | np.ndarray, name: str, material: str) -> Piece:
    """Return the strip between a seam and a shifted copy of the seam.

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
    # a segment that is parallel to `shift` sweeps no area
    solid = face_sizes(strip) > 1e-12
    return flat(replace(strip, faces=strip.faces[solid]))


class Within(NamedTuple):
    """A mesh out of which a region is cut, and the borders of the region other than the polygon.

    The value at a vertex matters only in faces with a vertex where it is negative. The value is at
    least the distance to the polygon less `grow_m`, and at least `beside` less `grow_m`.
    """

    faces: np.ndarray  # (m, 3) indices of the points
    beside: np.ndarray  # (n,) distance of the points from the other borders, m, negative inside
    grow_m: float = 0.0  # distance by which the region is grown, m


class Outline(Protocol):
    """The signed distance to a 2-D polygon."""

    def __call__(self, p: np.ndarray, q: np.ndarray, within: Within | None = None) -> np.ndarray:
        """Return the signed distance of points to the polygon, m, in the shape of `p`.

        Parameters
        ----------
        p : first coordinate of the points, m.
        q : second coordinate, m.
        within : sheet of these points (n,); points of faces that the region does not touch get
            the value `REACH_M`. None: the distance is computed for all points.
        """


def polygon(points: ArrayLike, r: float = 0.0) -> Outline:
    """Return the signed distance, m, to a grown 2-D polygon, as a function of two coordinates.

    The distance is negative inside. Points further than `REACH_M` from the box around the grown
    polygon get the value `REACH_M`. This does not change a cut along the zero line, because no face
    is that long.

    Parameters
    ----------
    points : (n, 2) corners of the closed polygon, m.
    r : distance by which it is grown, with round corners, m.
    """
    a = np.asarray(points, float)
    b = np.roll(a, -1, 0)
    reach = REACH_M + r
    left, low = a.min(0).tolist()
    right, high = a.max(0).tolist()

    def in_box(x: np.ndarray, y: np.ndarray, margin: float) -> np.ndarray:
        across = (x > left - margin) & (x < right + margin)
        return across & (y > low - margin) & (y < high + margin)

    def distance(p: np.ndarray, q: np.ndarray, within: Within | None = None) -> np.ndarray:
        x, y = (np.asarray(c, float).ravel() for c in (p, q))
        d = np.full(x.shape, reach)
        inside = in_box(x, y, reach)
        if within is not None:
            margin = within.grow_m + ROUNDING_M
            negative = in_box(x, y, r + margin) & (within.beside < margin)
            inside &= _of_faces_with(negative, within.faces)
        near = np.flatnonzero(inside)
        for first in range(0, len(near), BLOCK):  # blocks small enough for the processor's cache
            some = near[first : first + BLOCK]
            d[some] = _signed_distance(a, b, x.take(some), y.take(some))
        return d.reshape(np.shape(p)) - r

    return distance


def _of_faces_with(some: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return which vertices (n,) are in a face with one of `some` vertices (n,).

    Parameters
    ----------
    some : (n,) whether a vertex is one of them.
    faces : (m, 3) indices of the corners of each face.
    """
    a, b, c = some.view(np.int8).take(faces).T
    out = np.zeros(len(some), bool)
    out[faces.take(np.flatnonzero(a | b | c), 0)] = True
    return out


def _signed_distance(a: np.ndarray, b: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the distance (n,) to a polygon, negative inside, m.

    Parameters
    ----------
    a : (k, 2) first ends of its edges, m.
    b : (k, 2) last ends, m.
    x : (n,) first coordinate of the points, m.
    y : (n,) second coordinate, m.
    """
    edges = np.concatenate([a, b], 1)
    if len(edges) <= 2 * EDGES:
        d = np.sqrt(_squared_distance(edges, x, y))
        return np.where(_is_odd(edges, x, y), -d, d)
    groups = [edges[first : first + EDGES] for first in range(0, len(edges), EDGES)]
    bound2 = ROUNDING * np.min([(x - k) ** 2 + (y - m) ** 2 for k, m in a[::EDGES]], 0)
    nearest2 = np.full(x.shape, np.inf)
    odd = np.zeros(x.shape, bool)
    for group in groups:
        ends = group.reshape(-1, 2)
        left, low = ends.min(0)
        right, high = ends.max(0)
        # distances of the points outside the box around these edges, along both axes
        dx = np.maximum(np.maximum(left - x, x - right), 0)
        dy = np.maximum(np.maximum(low - y, y - high), 0)
        near = np.flatnonzero(dx * dx + dy * dy <= bound2)
        nearest = _squared_distance(group, x.take(near), y.take(near))
        nearest2[near] = np.minimum(nearest2.take(near), nearest)
        level = np.flatnonzero((dy == 0) & (x <= right + SLACK_M))
        odd[level] ^= _is_odd(group, x.take(level), y.take(level))
    d = np.sqrt(nearest2)
    return np.where(odd, -d, d)


def _squared_distance(edges: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the squared distance (n,) to the nearest edge, m2.

    Parameters
    ----------
    edges : (k, 4) both ends of the edges, m.
    x : (n,) first coordinate of the points, m.
    y : (n,) second coordinate, m.
    """
    ax, ay, bx, by = edges.T[:, :, None]
    ex = bx - ax
    ey = by - ay
    wx = x - ax
    wy = y - ay
    # place of the nearest point on each edge, from 0 to 1
    k = wx * ex
    d2 = wy * ey
    k += d2
    k /= np.maximum(ex * ex + ey * ey, 1e-12)
    np.maximum(k, 0, out=k)
    np.minimum(k, 1, out=k)
    np.multiply(k, ex, out=d2)
    wx -= d2
    wx *= wx
    k *= ey
    wy -= k
    wy *= wy
    wx += wy
    return wx.min(0)


def _is_odd(edges: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return whether the line from each point (n,) towards +x crosses an odd number of edges.

    Parameters
    ----------
    edges : (k, 4) both ends of the edges, m.
    x : (n,) first coordinate of the points, m.
    y : (n,) second coordinate, m.
    """
    ax, ay, bx, by = edges[edges[:, 1] != edges[:, 3]].T[:, :, None]
    crossed = (ay > y) != (by > y)  # whether a point is between the heights of both ends
    crossed &= x < ax + (y - ay) / (by - ay) * (bx - ax)
    return np.logical_xor.reduce(crossed, 0)


def curve(points: Sequence[tuple[float, float]], sigma: float = 0.0) -> Callable[..., Any]:
    """Return a function that interpolates (x, y) points, with rounded corners.

    Parameters
    ----------
    points : (x, y), with x increasing.
    sigma : standard deviation of the Gaussian that rounds the corners, in the unit of x; 0: sharp
        corners.
    """
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

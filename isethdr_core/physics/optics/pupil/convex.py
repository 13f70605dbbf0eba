"""Convex shapes of a pupil: their intersections, images under linear maps, and chords."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Number of level lines across a shape. They give bounds of its extent along x, and of the height of
# its image under a linear map.
LEVELS = 512

# ((xx, xy), (yx, yy)) of a linear map of the pupil plane
Matrix = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Convex:
    """The intersection of half-planes, discs and ellipses, between the levels `low` and `high`.

    A half-plane (nx, ny, d) holds the points with nx x + ny y <= d. A disc is (x, y, radius). An
    ellipse (x, y, matrix) is the image of the unit disc under a linear map, moved to the centre (x,
    y). `low` and `high` are bounds of y.
    """

    planes: tuple[tuple[float, float, float], ...] = ()
    discs: tuple[tuple[float, float, float], ...] = ()
    low: float = -np.inf
    high: float = np.inf
    ellipses: tuple[tuple[float, float, Matrix], ...] = ()

    def __and__(self, other: Convex) -> Convex:
        """Return the intersection of two shapes."""
        return Convex(
            self.planes + other.planes,
            self.discs + other.discs,
            max(self.low, other.low),
            min(self.high, other.high),
            self.ellipses + other.ellipses,
        )

    def is_empty(self, lines: int = 512) -> bool:
        """Return whether none of `lines` evenly spaced level lines cuts the shape."""
        if self.low >= self.high:
            return True
        left, right = self.chords(
            self.low + (np.arange(lines) + 0.5) / lines * (self.high - self.low)
        )
        return not np.any(left < right)

    def within(self, box: np.ndarray) -> Convex:
        """Return the shape without those half-planes and discs that contain a whole box.

        Inside the box, the shape stays the same, and its chords take less time.

        Parameters
        ----------
        box : (low, high, left, right), bounds of y and of x.
        """
        low, high, left, right = box
        planes = tuple(
            (nx, ny, d)
            for nx, ny, d in self.planes
            if not max(nx * left, nx * right) + max(ny * low, ny * high) <= d
        )
        discs = tuple(
            (x, y, r)
            for x, y, r in self.discs
            if not max(x - left, right - x) ** 2 + max(y - low, high - y) ** 2 <= r * r
        )
        return Convex(planes, discs, self.low, self.high, self.ellipses)

    def sides(self) -> tuple[float, float]:
        """Return bounds (left, right) of x over the shape.

        A corner or the side of a disc may lie between two level lines. The bounds are therefore
        wider than the chords by the largest step from one chord to the next. They are infinite if
        `low` or `high` is, or if fewer than two level lines cut the shape.
        """
        if not np.isfinite(self.high - self.low):
            return -np.inf, np.inf
        left, right = self.chords(np.linspace(self.low, self.high, LEVELS))
        hit = left < right
        if hit.sum() < 2:
            return -np.inf, np.inf
        spare = max(np.abs(np.diff(side[hit])).max() for side in (left, right))
        return float(left[hit].min() - spare), float(right[hit].max() + spare)

    def chords(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return where horizontal lines at `y` enter and leave the shape: (left, right).

        A line misses the shape where left >= right. `low` and `high` are ignored.
        """
        left = np.full(y.shape, -np.inf)
        right = np.full(y.shape, np.inf)
        for xc, yc, r in self.discs:
            half = np.sqrt(np.maximum(r * r - (y - yc) ** 2, 0.0))
            left = np.maximum(left, xc - half)
            right = np.minimum(right, xc + half)
        for xc, yc, ((xx, xy), (yx, yy)) in self.ellipses:
            height2 = yx**2 + yy**2
            middle = xc + (xx * yx + xy * yy) / height2 * (y - yc)
            half = (
                abs(xx * yy - xy * yx) / height2 * np.sqrt(np.maximum(height2 - (y - yc) ** 2, 0.0))
            )
            left = np.maximum(left, middle - half)
            right = np.minimum(right, middle + half)
        for nx, ny, d in self.planes:
            if abs(nx) < 1e-12:
                right = np.where(ny * y <= d, right, -np.inf)
            elif nx > 0:
                right = np.minimum(right, (d - ny * y) / nx)
            else:
                left = np.maximum(left, (d - ny * y) / nx)
        return left, right

    def contains(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return whether the points (x, y), broadcast, lie inside."""
        inside = np.ones(np.broadcast_shapes(np.shape(x), np.shape(y)), bool)
        for xc, yc, r in self.discs:
            inside &= (x - xc) ** 2 + (y - yc) ** 2 <= r * r
        for xc, yc, ((xx, xy), (yx, yy)) in self.ellipses:
            u = yy * (x - xc) - xy * (y - yc)
            v = xx * (y - yc) - yx * (x - xc)
            inside &= u**2 + v**2 <= (xx * yy - xy * yx) ** 2
        for nx, ny, d in self.planes:
            inside &= nx * x + ny * y <= d
        return inside

    def mapped(self, matrix: Matrix) -> Convex:
        """Return the image of the shape under a linear map about the origin.

        Parameters
        ----------
        matrix : ((xx, xy), (yx, yy)), invertible: (x, y) goes to (xx x + xy y, yx x + yy y).
        """
        forward = np.asarray(matrix, float)
        inverse = np.linalg.inv(forward)
        low, high = self._mapped_height(forward)
        planes = tuple((*map(float, (nx, ny) @ inverse), d) for nx, ny, d in self.planes)
        round_ones = [(x, y, ((r, 0.0), (0.0, r))) for x, y, r in self.discs]
        ellipses = tuple(
            (
                *map(float, forward @ (x, y)),
                tuple(tuple(map(float, row)) for row in forward @ np.asarray(own)),
            )
            for x, y, own in (*round_ones, *self.ellipses)
        )
        return Convex(planes=planes, low=low, high=high, ellipses=ellipses)

    def _mapped_height(self, forward: np.ndarray) -> tuple[float, float]:
        """Return bounds (low, high) of y over the image of the shape under a linear map.

        They are exact if the map keeps level lines level. Otherwise they follow from `LEVELS`
        levels: the largest y of the image is a concave function of the level in the shape, so that
        it exceeds the largest sampled value by at most the largest step between two neighbouring
        levels.
        """
        yx, yy = forward[1]
        if yx == 0.0:
            return tuple(map(float, sorted((yy * self.low, yy * self.high))))
        level = np.linspace(self.low, self.high, LEVELS)
        left, right = self.chords(level)
        hit = left < right
        if hit.sum() < 2:  # fewer than two levels cut the shape: too thin to pass light
            return 0.0, 0.0
        bounds = []
        for sign in (-1, 1):
            most = sign * yy * level[hit] + np.maximum(
                sign * yx * left[hit], sign * yx * right[hit]
            )
            bounds.append(sign * float(most.max() + np.abs(np.diff(most)).max()))
        return bounds[0], bounds[1]

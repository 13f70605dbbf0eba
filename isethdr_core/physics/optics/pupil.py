"""Pupil: blades, dust and scratches of an aperture, averaged exactly over the cells of any grid.

Every shape is convex, so a horizontal line cuts it in one chord. A raster adds the two ends of each
chord to a row of differences, and one cumulative sum fills all shapes: exact along x, a few lines
per cell along y. Overlapping dirt multiplies: `opening` expands the product of all transmissions
into a sum over shapes and their intersections. Lengths in millimetres, origin on the axis, x right,
y down as in the image.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import prod
from typing import Any, NamedTuple

import numpy as np

MOST_TERMS = 20000  # terms of `opening`; to compute them takes seconds
GAUSS = (0.5 - 1 / 12**0.5, 0.5 + 1 / 12**0.5)  # places of the two-point rule, of equal weights
# parts of a row in which a side turns, for each `apart` by which the side leaves a straight line:
# without them dirty pupils err three times as much, with 10 as much
TURN = 4.0
# the lower of two places of equal weights that integrate a half disc, and straight lines, exactly
HALF_DISC = (1 - (1 - np.pi**2 / 16) ** 0.5) / 2
PLACES = np.array(GAUSS)[:, None]  # (place, part of a row)
WITHIN_A_ROW = np.array([[HALF_DISC], [1 - HALF_DISC]])
# level lines across a shape; they bound its sides, and the height of its image under a linear map
LEVELS = 512

# ((xx, xy), (yx, yy)) of a linear map of the pupil plane
Matrix = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class Convex:
    """The intersection of half-planes (nx, ny, d): nx x + ny y <= d, of discs (x, y, radius) and of
    ellipses, within `low` <= y <= `high`.

    An ellipse (x, y, matrix) is the image of the unit disc under a linear map, moved to the centre
    (x, y).
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
        """Return whether none of `lines` level lines across the shape's height cuts it."""
        if self.low >= self.high:
            return True
        left, right = self.chords(
            self.low + (np.arange(lines) + 0.5) / lines * (self.high - self.low)
        )
        return not np.any(left < right)

    def within(self, box: np.ndarray) -> Convex:
        """Return the shape without the half-planes and discs that hold all of a box.

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
        """Return bounds (left, right) of x over the shape; infinite where too few level lines hit.

        Level lines leave a corner or a disc's side between two of them: the bounds lie farther out
        by the largest step from one line to the next.
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
        """Return where horizontal lines at `y` enter and leave the shape; left >= right where they
        miss it.
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

        They are exact where level lines stay level. Else y of the image is a concave function of
        the level in the shape: its maximum lies above no straight line through two neighbouring
        levels, continued by one more.
        """
        yx, yy = forward[1]
        if yx == 0.0:
            return tuple(map(float, sorted((yy * self.low, yy * self.high))))
        level = np.linspace(self.low, self.high, LEVELS)
        left, right = self.chords(level)
        hit = left < right
        if hit.sum() < 2:  # thinner than two levels: no light
            return 0.0, 0.0
        bounds = []
        for sign in (-1, 1):
            most = sign * yy * level[hit] + np.maximum(
                sign * yx * left[hit], sign * yx * right[hit]
            )
            bounds.append(sign * float(most.max() + np.abs(np.diff(most)).max()))
        return bounds[0], bounds[1]


def disc(x: float, y: float, radius: float) -> Convex:
    """Return a disc.

    Parameters
    ----------
    x, y : centre, mm.
    radius : radius, mm.
    """
    return Convex(discs=((x, y, radius),), low=y - radius, high=y + radius)


def blades(radius: float, count: int, rotation_deg: float = 0.0, rounding: float = 0.0) -> Convex:
    """Return an iris whose corners lie on a circle.

    Each blade's edge is an arc between two corners, of curvature `rounding` / `radius`.

    Parameters
    ----------
    radius : radius of the circle through the corners, mm.
    count : number of blades; fewer than three make the full circle.
    rotation_deg : angle by which the iris is turned, degrees.
    rounding : 0: straight edges. 1: the circle itself.
    """
    if not 0.0 <= rounding <= 1.0:
        raise ValueError(f"rounding {rounding!r}; expected 0 (straight blades) to 1 (a circle)")
    if count < 3:
        return disc(0.0, 0.0, radius)
    angle = np.radians(rotation_deg) + 2 * np.pi * (np.arange(count) + 0.5) / count
    near = radius * np.cos(np.pi / count)
    half = radius * np.sin(np.pi / count)
    if rounding < 1e-6:
        planes = tuple((np.cos(a), np.sin(a), near) for a in angle)
        corners = radius * np.sin(angle + np.pi / count)
        return Convex(planes=planes, low=float(corners.min()), high=float(corners.max()))
    arc = radius / rounding
    centre = near - np.sqrt(arc**2 - half**2)
    discs = tuple((centre * np.cos(a), centre * np.sin(a), arc) for a in angle)
    return Convex(discs=discs, low=-radius, high=radius)


def strip(x: float, y: float, length: float, width: float, angle_rad: float) -> Convex:
    """Return a rectangle centred on (x, y), its length along `angle_rad`.

    Parameters
    ----------
    x, y : centre, mm.
    length, width : sides of the rectangle, mm.
    angle_rad : direction of the length, from x towards y, radians.
    """
    angle = angle_rad + np.pi / 2 * np.arange(4)
    reach = np.array([length, width, length, width]) / 2
    planes = tuple(
        (np.cos(a), np.sin(a), r + np.cos(a) * x + np.sin(a) * y) for a, r in zip(angle, reach)
    )
    tall = (length * abs(np.sin(angle_rad)) + width * abs(np.cos(angle_rad))) / 2
    return Convex(planes=planes, low=y - tall, high=y + tall)


@dataclass(frozen=True)
class Dust:
    """Statistics of the grains of dust on a pupil."""

    per_mm2: float  # mean number
    radius_um: float  # median; radii are log-normal
    spread: float = 0.5  # sigma of the logarithm of the radius
    loss: tuple[float, float] = (0.5, 1.0)  # least and most amplitude lost in a grain, uniform


@dataclass(frozen=True)
class Scratches:
    """Statistics of the scratches on a pupil: straight lines in parallel groups."""

    per_mm2: float  # mean number
    width_um: float  # widths are 0.5 to 1.5 of it
    length_um: float  # lengths are 0.4 to 1.6 of it
    loss: tuple[float, float] = (0.3, 1.0)  # least and most amplitude lost in a scratch, uniform
    together: int = 1  # scratches in a group
    spacing_um: float = 0.0  # distances in a group are 0.5 to 1.5 of it
    direction_deg: float = 0.0  # least direction of a group; 0 along x
    direction_range_deg: float = 180.0  # directions are uniform over this range


def dirt(radius: float, dust: Dust, scratches: Scratches, seed: int) -> list[tuple[Convex, float]]:
    """Draw dust and scratches over the square around a pupil, as exact shapes.

    Counts have a Poisson distribution, positions are uniform. The same arguments give the same
    dirt.

    Parameters
    ----------
    radius : radius of the pupil, mm.
    dust, scratches : their statistics.
    seed : seed of the random numbers.

    Returns
    -------
    list of (shape, loss of amplitude transmission).
    """
    rng = np.random.default_rng(seed)
    square = 4 * radius**2
    out = []
    for _ in range(rng.poisson(dust.per_mm2 * square)):
        x, y = rng.uniform(-radius, radius, 2)
        out.append(
            (
                disc(x, y, 1e-3 * dust.radius_um * rng.lognormal(0, dust.spread)),
                rng.uniform(*dust.loss),
            )
        )
    for _ in range(rng.poisson(scratches.per_mm2 * square / scratches.together)):
        x, y = rng.uniform(-radius, radius, 2)
        angle = None
        across = 0.0
        for number in range(scratches.together):
            length = 1e-3 * scratches.length_um * rng.uniform(0.4, 1.6)
            width = 1e-3 * scratches.width_um * rng.uniform(0.5, 1.5)
            if angle is None:
                angle = np.radians(
                    scratches.direction_deg
                ) + scratches.direction_range_deg / 180 * rng.uniform(0, np.pi)
            loss = rng.uniform(*scratches.loss)
            if number:
                across += 1e-3 * scratches.spacing_um * rng.uniform(0.5, 1.5)
            out.append(
                (
                    strip(
                        x - across * np.sin(angle), y + across * np.cos(angle), length, width, angle
                    ),
                    loss,
                )
            )
    return out


def opening(aperture: Convex, losses: list[Any]) -> list[tuple[Convex, float]]:
    """Expand aperture x product of (1 - loss) over all dirt into a sum of (shape, weight), each 1 x
    weight inside.

    A loss may be complex: 1 - a exp(i phase) of a grain that passes the amplitude a, retarded.

    Raises
    ------
    ValueError : where so much dirt overlaps that the sum has more than `MOST_TERMS`.
    """
    return weighted(
        overlaps(aperture, [shape for shape, _ in losses]), [loss for _, loss in losses]
    )


def overlaps(aperture: Convex, dirt: Sequence[Any]) -> list[tuple[Convex, tuple[int, ...]]]:
    """Return every way in which shapes of dirt overlap within the aperture: (intersection,
    indices); raises as `opening`.
    """
    return list(_overlaps(aperture, tuple(dirt)))


@lru_cache(maxsize=16)
def _overlaps(aperture: Convex, dirt: tuple[Convex, ...]) -> list:
    """Return `overlaps`; shapes whose bounds lie apart are not looked at closely, and borders of
    one that lie beyond the other are left out: they cost time in every chord.
    """
    overlaps: list[tuple[Convex, tuple[int, ...]]] = [(aperture, ())]
    bounds = np.array([[aperture.low, aperture.high, -np.inf, np.inf]])
    for index, shape in enumerate(dirt):
        if len(overlaps) > MOST_TERMS:
            raise ValueError(
                f"the aperture's dirt overlaps in more than {MOST_TERMS} ways; expected less or"
                " smaller dirt"
            )
        own = np.array([shape.low, shape.high, *shape.sides()])
        near = np.ones(len(overlaps), bool)
        for low, high in ((0, 1), (2, 3)):
            near &= (bounds[:, low] < own[high]) & (own[low] < bounds[:, high])
        shared = []
        for place in np.flatnonzero(near):
            part, shapes_inside = overlaps[place]
            both = part.within(own) & shape
            if both.is_empty():
                continue
            overlaps.append((both, (*shapes_inside, index)))
            inner = np.maximum(bounds[place], own)
            inner[1::2] = np.minimum(bounds[place], own)[1::2]
            shared.append(inner)
        if shared:
            bounds = np.concatenate([bounds, shared])
    return overlaps


def weighted(
    overlapping: list[tuple[Convex, tuple[Any, ...]]], losses: list[Any]
) -> list[tuple[Convex, float]]:
    """Return the sum of (shape, weight) that `opening` describes, from its `overlaps` and the loss
    of every shape of dirt.
    """
    return [
        (part, prod((-losses[i] for i in covering), start=1.0)) for part, covering in overlapping
    ]


def energy(aperture: Convex, losses: Sequence[Any], strips: int = 4000) -> float:
    """Return the integral of the squared amplitude, mm2: squares of products are products of
    squares, so areas suffice.

    Parameters
    ----------
    aperture : the open pupil, mm.
    losses : list of (shape, loss) of the dirt; loss is 1 - amplitude transmission.
    strips : level lines per shape over which chords are integrated.
    """
    # heights by cosine: exact for discs, whose chords end in a root
    total = 0.0
    angle = (np.arange(strips) + 0.5) * np.pi / strips
    for shape, weight in opening(aperture, [(s, 1 - (1 - loss) ** 2) for s, loss in losses]):
        left, right = shape.chords(
            (shape.high + shape.low - (shape.high - shape.low) * np.cos(angle)) / 2
        )
        total += (
            weight
            * (shape.high - shape.low)
            / 2
            * float(np.maximum(right - left, 0.0) @ np.sin(angle))
            * np.pi
            / strips
        )
    return total


def transmission(
    aperture: Convex, losses: list[tuple[Convex, float]], x: np.ndarray, y: np.ndarray
) -> np.ndarray:
    """Return the amplitude transmission at points: 0 outside, the product of (1 - loss) inside.

    Parameters
    ----------
    aperture : the open pupil, mm.
    losses : list of (shape, loss) of the dirt; loss is 1 - amplitude transmission.
    x, y : points of the pupil plane, mm; any shapes that broadcast.
    """
    a = aperture.contains(x, y).astype(float)
    for shape, loss in losses:
        a = a * (1 - loss * shape.contains(x, y))
    return a


def strip_blocks(
    terms: list[tuple[Convex, float]], y0: float, step: float, count: int, most: float
) -> list[slice]:
    """Return blocks of horizontal strips, from the top down, with about `most` chords each, so that
    the memory of chords does not grow with the number of shapes and strips.

    Parameters
    ----------
    terms : list of (shape, weight).
    y0 : lower border of the first strip, in the unit of the shapes.
    step : height of a strip, same unit.
    count : number of strips.
    most : chords of a block, one per shape and strip.
    """
    bounds = np.array([(shape.low, shape.high) for shape, _ in terms]) - y0
    first, last = np.clip(bounds / step, 0, count).T
    total = float((last - first).sum())
    blocks = min(count, max(1, int(np.ceil(total / most))))
    # as many chords above every border as below it
    edges = np.linspace(0, count, 16 * blocks + 1).astype(int)
    above = np.array([np.clip(edge - first, 0, last - first).sum() for edge in edges])
    shares = np.linspace(0, total, blocks + 1)[1:-1]
    borders = [0, *edges[np.searchsorted(above, shares)], count]
    return [slice(int(a), int(b)) for a, b in zip(borders, borders[1:]) if a < b]


def chord_ends(
    terms: list[tuple[Convex, complex]],
    y0: float,
    step: float,
    count: int,
    places: Sequence[float] = (0.5,),
    block: slice | None = None,
) -> Iterator[tuple[slice, np.ndarray, np.ndarray, np.ndarray]]:
    """Yield (strip, left, right, weight) of chords through horizontal strips, for all terms.

    Parameters
    ----------
    terms : list of (shape, weight).
    y0 : lower border of the first strip, in the unit of the shapes.
    step : height of a strip, same unit.
    count : number of strips.
    places : positions of chords within a strip, and their weights. If a shape fills only a part of
        the strip's height, the chords lie in that part, and their weights sum to its share:
        horizontal edges are exact.
    block : strips to take, one of `strip_blocks`; None: all.
    """
    start, stop = (0, count) if block is None else (block.start, block.stop)
    for shape, weight in terms:
        # one strip more on either side, for rounding; strips that miss the shape have no height
        first, last = (np.clip((bound - y0) / step, 0, count) for bound in (shape.low, shape.high))
        k = np.arange(max(int(first) - 1, start), min(int(last) + 2, stop))
        if not len(k):
            continue
        top = np.maximum(y0 + k * step, shape.low)
        bottom = np.minimum(y0 + (k + 1) * step, shape.high)
        for place in places:
            left, right = shape.chords(top + place * (bottom - top))
            hit = (left < right) & (top < bottom)
            yield k[hit], left[hit], right[hit], ((bottom - top) / step * weight / len(places))[hit]


class Chords(NamedTuple):
    """Level lines through the shapes of a pupil, cut into rows."""

    left: np.ndarray  # unit of the shapes
    right: np.ndarray
    weight: np.ndarray  # amplitude x the part of a row that the chord stands for
    level: np.ndarray  # rows from the top


def gauss_chords(
    term: tuple[Convex, float], y0: float, step: float, count: int, block: slice, apart: float
) -> Chords:
    """Return the chords of one shape at Gauss's two places in every row, or every part of a row.

    Gauss's places are those in the root of the distance to the nearer end of the shape: chords of a
    round shape grow with that root, and chords of straight sides are as exact. Fields of an image
    turn with the places of the ends of chords. Rows are therefore divided where a side is so
    slanted that the ends move by more than `apart` within a row, as beside the ends of a round
    shape, and where a side turns, as at the corners of a blade.

    Parameters
    ----------
    term : (shape, weight).
    y0 : top of the first row, in the unit of the shapes.
    step : height of a row, same unit.
    count : number of rows.
    block : rows to take, one of `strip_blocks`.
    apart : largest distance along x, same unit, between the ends of chords that follow each other.
    """
    shape, weight = term
    border = _row_borders(shape, y0, step, count, block)
    if len(border) < 2:
        return Chords(*np.empty((4, 0)))
    parts = np.ceil(_moves(shape, border) / apart).clip(1).astype(np.intp)
    height = shape.high - shape.low
    if len(parts) == 1 == parts[0] and border[1] - border[0] == height:
        # all of the shape lies in one row
        level = shape.low + WITHIN_A_ROW * height
        share = np.full((2, 1), 0.5 * height)
    else:
        level, share = _levels(shape, border, parts)
    left, right = shape.chords(level)
    hit = left < right
    return Chords(left[hit], right[hit], share[hit] * (weight / step), (level[hit] - y0) / step)


def _row_borders(shape: Convex, y0: float, step: float, count: int, block: slice) -> np.ndarray:
    """Return the levels between the rows that a shape fills, from its lower to its upper end."""
    first, last = (np.clip((bound - y0) / step, 0, count) for bound in (shape.low, shape.high))
    row = np.arange(max(int(first) - 1, block.start), min(int(last) + 2, block.stop) + 1)
    border = np.clip(y0 + row * step, shape.low, shape.high)
    begin = max(int(np.searchsorted(border, shape.low, "right")) - 1, 0)
    return border[begin : int(np.searchsorted(border, shape.high)) + 1]


def _levels(shape: Convex, border: np.ndarray, parts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (level, share), each (2, part), of Gauss's two places in every part of the rows.

    Parameters
    ----------
    shape : whose nearer end the places are counted from.
    border : levels between rows.
    parts : number of parts of each row.

    Returns
    -------
    The levels, and the height that each of them stands for; both in the unit of the shape.
    """
    is_nearer_low = border[:-1] - shape.low < shape.high - border[1:]
    from_low = np.sqrt(border - shape.low)
    from_high = np.sqrt(shape.high - border)
    near = np.where(is_nearer_low, from_low[:-1], from_high[1:])  # roots of distances
    length = np.where(is_nearer_low, from_low[1:], from_high[:-1]) - near
    end = np.where(is_nearer_low, shape.low, shape.high)
    sign = np.where(is_nearer_low, 1.0, -1.0)
    if parts.max() > 1:
        before = np.repeat(np.cumsum(parts) - parts, parts)
        length = np.repeat(length / parts, parts)
        near = np.repeat(near, parts) + (np.arange(len(before)) - before) * length
        end = np.repeat(end, parts)
        sign = np.repeat(sign, parts)
    root = near + PLACES * length
    return end + sign * root**2, root * length


def _moves(shape: Convex, border: np.ndarray) -> np.ndarray:
    """Return by how much the ends of chords move within each row between the levels `border`; where
    a side turns, `TURN` times by how much it leaves a straight line.
    """
    ends = np.array(shape.chords(border))
    steps = ends[:, 1:] - ends[:, :-1]
    if not np.isfinite(ends).all():  # no chord there: nothing that moves
        steps[~(np.isfinite(ends[:, 1:]) & np.isfinite(ends[:, :-1]))] = 0.0
    moves = np.abs(steps).max(axis=0)
    if len(moves) > 1:
        turns = TURN * np.abs(steps[:, 1:] - steps[:, :-1]).max(axis=0)
        np.maximum(moves[1:], turns, out=moves[1:])
        np.maximum(moves[:-1], turns, out=moves[:-1])
    return moves


def raster(
    terms: list[tuple[Convex, complex]], x: np.ndarray, y: np.ndarray, strips: int = 2
) -> np.ndarray:
    """Return the mean amplitude transmission of each cell of a grid.

    Parameters
    ----------
    terms : list of (shape, weight), as `opening` returns.
    x, y : evenly spaced cell centres, mm.
    strips : level strips per cell, with two chords each at Gauss's places: the mean over y is exact
        to the fourth power of their height, along x it is exact.

    Returns
    -------
    (y, x) float32 array, 0 to 1; complex64 where a weight is complex.
    """
    real = not any(isinstance(weight, complex) for _, weight in terms)
    dtype = np.float32 if real else np.complex64
    dx = x[1] - x[0]
    dy = y[1] - y[0]
    sub = strips
    position = []
    change = []
    for k, left, right, weight in chord_ends(terms, y[0] - dy / 2, dy / sub, len(y) * sub, GAUSS):
        for end, sign in ((left, 1), (right, -1)):
            cell = np.clip((end - x[0]) / dx + 0.5, 0.0, len(x))
            whole_cells = cell.astype(np.intp)
            start = (k // sub) * (len(x) + 2) + whole_cells
            position += [start, start + 1]
            change += [
                sign * weight / sub * (1 - (cell - whole_cells)),
                sign * weight / sub * (cell - whole_cells),
            ]
    ends = np.zeros(len(y) * (len(x) + 2), dtype)
    if position:
        np.add.at(ends, np.concatenate(position), np.concatenate(change).astype(dtype))
    ends = ends.reshape(len(y), len(x) + 2)
    np.cumsum(ends, axis=1, out=ends)
    ends = ends[:, : len(x)]
    return np.maximum(ends, 0.0, out=ends) if real else ends  # float32 sums leave +-1e-7

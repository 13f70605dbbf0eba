"""Lamps as spots: points in front of the lamp with the same luminous intensity, for the variant
without a compiler.

Mitsuba has no area light with a beam, and one written in Python costs more than the rest of a
scalar rendering. Its spot light with a projected picture is compiled code. Here a lamp becomes one
spot for its beam and a few for its Lambertian floor; a large lamp is cut into several pieces first.
The extent of the lamp is lost: shadows have no penumbrae, and light close to the lamp is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from .placed_lamps import LAMBERTIAN_COS, PlacedLamp, beam

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import IntensityTable

PIECE_M = 0.3  # largest piece of a lamp that one spot replaces; larger lamps become several spots
# distance of a spot in front of the foremost point of its piece, so that the piece does not shade
# the spot
CLEAR_M = 2e-3
WIDEST_DEG = 88.0  # widest half angle of a spot; a Lambertian lamp has 0.12 % of its flux beyond
# Half angles of the cone of a lamp with a table. The first cone that loses at most LOST_LIGHT of
# the light is used. Texels are 0.1 and 0.6 degrees wide on the axis.
TABLE_DEG = (40.0, 80.0)
OF_TABLE = 1024  # number of texels across the picture of a table
LOST_LIGHT = 0.03  # largest share of light lost beyond the cone of a table
# Number of texels across the picture of a beam and of a Lambertian floor. The error is 0.5 % where
# a beam is steepest.
NARROW = 128
WIDE = 512


@dataclass(frozen=True, eq=False)
class Spot:
    """A point light about an axis: its luminous intensity is `peak_cd` x picture. The coordinates
    of the picture are tangents, up to that of `cutoff_deg`.
    """

    lamp: int  # index into the lamps
    point: np.ndarray  # (3,) m
    frame: np.ndarray  # (3, 3) columns: x and y of the picture, axis
    cutoff_deg: float  # half angle of the cone
    peak_cd: float  # largest luminous intensity
    picture: np.ndarray  # (n, n) float32, largest value 1; y along the columns, x along the rows
    radius_m: float  # radius of the piece of lamp that the spot replaces

    def candela(self, directions: np.ndarray) -> np.ndarray:
        """Return candela towards (..., 3) unit vectors, by the nearest texel."""
        x, y, z = np.moveaxis(directions @ self.frame, -1, 0)
        inside = z > np.cos(np.radians(self.cutoff_deg))
        scale = len(self.picture) / 2 / np.tan(np.radians(self.cutoff_deg)) / np.where(inside, z, 1)
        at = lambda v: np.clip(
            (v * scale + len(self.picture) / 2).astype(int), 0, len(self.picture) - 1
        )
        return np.where(inside, self.peak_cd * self.picture[at(y), at(x)], 0)


def spots(lamps: list[PlacedLamp]) -> list[Spot]:
    """Return the spots of all lamps that shine."""
    return [
        s
        for number, lamp in enumerate(lamps)
        if lamp.peak_cd_m2 > 0
        for s in (*_beam(number, lamp), *_floor(number, lamp))
    ]


def _beam(number: int, lamp: PlacedLamp) -> Iterator[Any]:
    if lamp.cos_inner <= LAMBERTIAN_COS:
        return
    if lamp.grid is not None:
        yield from _with_table(number, lamp)
        return
    cutoff = min(float(np.degrees(np.arccos(lamp.cos_outer))) + 1e-3, WIDEST_DEG)
    frame = _frame(lamp.axis)
    direction = _directions(cutoff, NARROW) @ frame.T
    pattern = (
        beam(direction @ lamp.axis, lamp.cos_inner, lamp.cos_outer)
        * lamp.peak_cd_m2
        / (1 + lamp.floor)
    )
    for area, centre, corners in _pieces(lamp.triangles, lambda areas: np.zeros((len(areas), 3))):
        facing = np.zeros(direction.shape[:2])
        for chunk in np.array_split(area, max(1, len(area) // 64)):
            facing += np.maximum(direction @ chunk.T, 0).sum(-1)
        yield from _spot(number, centre, corners, _Cone(frame, cutoff, *_scaled(pattern * facing)))


def _with_table(number: int, lamp: PlacedLamp) -> Iterator[Any]:
    """Yield one spot with the pattern of the table for each piece of the lamp. The luminous
    intensity of the lamp is divided in proportion to the areas of the pieces projected on the axis.
    """
    axis = lamp.grid.axis
    frame = np.stack([lamp.grid.left, lamp.grid.up, axis], 1)
    cone = cone_deg(lamp.lamp.table)
    peak, picture = _table_picture(lamp.lamp.table)
    pieces = list(_pieces(lamp.triangles, lambda areas: np.zeros((len(areas), 3))))
    shown = np.array([np.maximum(area @ axis, 0).sum() for area, _, _ in pieces])
    for (_, centre, corners), share in zip(pieces, shown / shown.sum()):
        candela = float(share * lamp.lamp.intensity_cd * peak)
        yield from _spot(number, centre, corners, _Cone(frame, cone, candela, picture))


@cache
def cone_deg(table: IntensityTable) -> float:
    """Return the half angle, degrees, of the cone of a table's spot: the narrowest of `TABLE_DEG`
    that loses at most `LOST_LIGHT` of the light, or the widest.
    """
    enough = (cone for cone in TABLE_DEG if lost_beyond(table, cone) <= LOST_LIGHT)
    return next(enough, TABLE_DEG[-1])


@cache
def lost_beyond(table: IntensityTable, cone: float) -> float:
    """Return the share of a table's light outside the square picture of a spot with the half angle
    `cone`, degrees.
    """
    left, up = np.meshgrid(np.arange(-89.5, 90), np.arange(-89.5, 90))
    a, b = np.radians([left, up])
    light = table.at(left, up) * np.cos(b)
    ahead = np.cos(b) * np.cos(a)
    widest = np.maximum(np.abs(np.cos(b) * np.sin(a)), np.abs(np.sin(b)))
    outside = widest > ahead * np.tan(np.radians(cone))
    return float(light[outside].sum() / max(light.sum(), 1e-300))


@cache
def _table_picture(table: IntensityTable) -> tuple[float, np.ndarray]:
    """Return the largest value and the picture of a table. All lamps with this table share them."""
    x, y, z = np.moveaxis(_directions(cone_deg(table), OF_TABLE), -1, 0)
    return _scaled(table.at(np.degrees(np.arctan2(x, z)), np.degrees(np.arcsin(y))))


def _floor(number: int, lamp: PlacedLamp) -> Iterator[Any]:
    """Yield one spot for each set of faces of a piece with similar directions. The spot stands for
    a flat face with the sum of their area vectors.
    """
    level = lamp.peak_cd_m2 * (
        1.0 if lamp.cos_inner <= LAMBERTIAN_COS else lamp.floor / (1 + lamp.floor)
    )
    if level == 0:
        return
    for area, centre, corners in _pieces(lamp.triangles, lambda areas: np.round(2 * _unit(areas))):
        total = area.sum(0)
        yield from _spot(
            number,
            centre,
            corners,
            _Cone(_frame(_unit(total)), WIDEST_DEG, level * np.linalg.norm(total), _cosine()),
        )


class _Cone(NamedTuple):
    """The light of a spot."""

    frame: np.ndarray  # (3, 3): columns are left, up and axis
    cutoff_deg: float  # half angle of the cone
    peak_cd: float  # largest luminous intensity
    picture: np.ndarray  # relative intensity over the cone


def _spot(number: int, centre: np.ndarray, corners: np.ndarray, cone: _Cone) -> Iterator[Any]:
    """Yield the spot of a piece of a lamp, in front of all its corners; nothing if it is dark."""
    if cone.peak_cd > 0:
        frame = cone.frame
        ahead = ((corners - centre) @ frame[:, 2]).max() + CLEAR_M
        radius = np.linalg.norm(corners - centre, axis=-1).max()
        yield Spot(
            number,
            centre + ahead * frame[:, 2],
            frame,
            cone.cutoff_deg,
            float(cone.peak_cd),
            cone.picture,
            float(radius),
        )


def _scaled(candela: np.ndarray) -> tuple[float, np.ndarray]:
    peak = candela.max()
    return peak, (candela / peak if peak > 0 else candela).astype(np.float32)


@cache
def _cosine() -> np.ndarray:
    """Return the picture of a Lambertian face, which all spots of such faces share."""
    return _scaled(_directions(WIDEST_DEG, WIDE)[..., 2])[1]


def _pieces(triangles: np.ndarray, facing_of: Callable[..., Any]) -> Iterator[Any]:
    """Yield (area vectors, centre, corners) of the triangles in each cell of at most PIECE_M that
    also agree in `facing_of` of their area vectors. Large triangles are subdivided first.
    """
    while True:
        longest = np.linalg.norm(triangles - np.roll(triangles, 1, 1), axis=2).max(1)
        large = longest > PIECE_M
        if not large.any():
            break
        a, b, c = np.moveaxis(triangles[large], 1, 0)
        ab = (a + b) / 2
        bc = (b + c) / 2
        ca = (c + a) / 2
        quarters = [np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        triangles = np.concatenate([triangles[~large], *quarters])
    area = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2
    middle = triangles.mean(1)
    span = middle.max(0) - middle.min(0)
    cells = np.maximum(np.ceil(span / PIECE_M), 1)
    cell = np.minimum((middle - middle.min(0)) / np.maximum(span, 1e-12) * cells, cells - 1).astype(
        int
    )
    _, piece = np.unique(np.concatenate([cell, facing_of(area)], 1), axis=0, return_inverse=True)
    size = np.linalg.norm(area, axis=1)
    for k in range(piece.max() + 1):
        mine = piece.ravel() == k
        if size[mine].sum() > 0:
            yield (
                area[mine],
                np.average(middle[mine], 0, size[mine]),
                triangles[mine].reshape(-1, 3),
            )


def _directions(cutoff_deg: float | np.ndarray, count: int) -> np.ndarray:
    """Return (count, count, 3) unit vectors through the texel centres of a spot's picture, in its
    own axes.
    """
    tangent = ((np.arange(count) + 0.5) / count * 2 - 1) * np.tan(np.radians(cutoff_deg))
    y, x = np.meshgrid(tangent, tangent, indexing="ij")
    return _unit(np.stack([x, y, np.ones_like(x)], -1))


def _frame(axis: np.ndarray) -> np.ndarray:
    side = np.cross(np.eye(3)[np.argmin(np.abs(axis))], axis)
    side /= np.linalg.norm(side)
    return np.stack([side, np.cross(axis, side), axis], 1)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300)

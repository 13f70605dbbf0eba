"""Spatial light sampling: the probability with which a shadow ray aims at a lamp, by the light that
the lamp sends to the surfaces nearby.

A street at night has a hundred lamps, and two or three of them light a tile. Before rendering, all
lamps are therefore tested from a few points that the camera sees in each block of tiles, and from
one further surface point that a random ray from each of those meets. The test gives the light that
would arrive, and whether something blocks it. The points of a block decide how paths choose lamps
at their first surface in this block. The points of a cell of the world decide for all further
surfaces in the cell. Each point has one vote. A quarter of the probability is shared equally among
all lamps, so that none is left out. Where a shadow ray chooses among candidates, candidates on
lamps that were blocked from the points count less.

References
----------
Shirley, Wang, Zimmerman 1996, ACM Trans. Graph. 15, 1 (choice of lamps by place; here occlusion
counts as well).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import sparse

from ..paths.camera_rays import stream
from ..paths.device_memory import aligned
from .near_lamps import NearLamps, near_list

if TYPE_CHECKING:
    from ..paths.camera_rays import Camera
    from ..paths.hits import HitTables
    from ..paths.surface_tables import SurfaceTables
    from ..world.view import View
    from .lamp_tables import LampTables

ACROSS = 64  # number of blocks across the picture, unless it has fewer tiles across
POINTS = 8  # number of tested points of each block
CELLS = 32, 12  # number of cells of the world: sectors around the camera, and rings of distance
# Nearest and farthest distance of the rings. Their radii grow by a constant factor.
RINGS_M = 1.0, 300.0
# Number of slots per lamp of a group. One of them belongs to the lamp itself, so that a quarter of
# the probability is the same for all lamps.
SLOTS = 4
MOST_TRIED = 1 << 24  # largest number of (point, lamp) pairs tested at once
CLEAR_M = 1e-3  # distance of a point from its surface
# Smallest clear share of a candidate, also where its lamp was blocked from all tested points. With
# 1,000 lamps among boxes the noise of the median tile changes by 3 % from 0.03 to 0.1.
LEAST_CLEAR = 0.05


class PlaceLight(NamedTuple):
    """Light of the lamps at the tested points of each place, (place, lamp)."""

    votes: np.ndarray  # sum over the points of the lamp's share in the light of its group
    clear_share: np.ndarray  # share of the lamp's light that nothing blocks; 1 where unknown


class Chances:
    """Device tables of the probabilities of lamps at each place. Places are the blocks of the
    picture, then the cells of the world.

    A group has a list of lamps, `slots` (place, slot); all slots are equally likely. `chance`
    (place, lamp) is the share of slots that a lamp has. It is 0 in blocks where the lamp is `near`:
    each path there sends it a shadow ray in any case. `clear` (place, lamp) is the share of the
    lamp's light that is expected to arrive, at least `LEAST_CLEAR`.
    """

    def __init__(
        self,
        camera: Camera,
        view: View,
        members: Sequence[list[Any]],
        strength: np.ndarray,
        known: PlaceLight,
    ) -> None:
        """Make the tables.

        Parameters
        ----------
        camera : `Camera` on the device.
        view : tiles of the frame.
        members : numbers of the lamps of each group.
        strength : (lamp,) weights of the lamps at places without votes.
        known : light of the lamps at the tested points.
        """
        side, across, down = blocks_of(view)
        places = places_of(view)
        chance = np.zeros((places, len(strength)))
        self.slots = []
        self.count = []
        blocks = across * down
        lists = []
        for mine in map(np.array, members):
            # for a group without lamps; never read
            slots = np.zeros((1, 1), int)
            near_lamps = None
            if len(mine):
                voted = known.votes[:, mine]
                own = slots_of(voted, strength[mine])
                has_votes = voted[:blocks].any(1)
                near_lamps = near_list(has_votes, own[:blocks], shares_of(own[:blocks], len(mine)))
                own[:blocks] = near_lamps.slots
                share = shares_of(own, len(mine))
                slots = mine[own]
                # if all lamps are near, none is left to choose: the slots then hold lamps that
                # count as 0
                listed = np.arange(near_lamps.lamps.shape[1]) < near_lamps.length[:, None]
                share[np.nonzero(listed)[0], near_lamps.lamps[listed]] = 0.0
                chance[:, mine] = share
            lists.append(near_lamps)
            self.slots.append(mi.UInt32(aligned(slots, np.uint32)))
            self.count.append(dr.opaque(mi.UInt32, slots.shape[1]))
        self.chance = mi.Float(aligned(chance, np.float32))
        clear = np.maximum(known.clear_share, LEAST_CLEAR)
        self.clear = mi.Float(aligned(clear, np.float32))
        self.lamps = dr.opaque(mi.UInt32, len(strength))
        self.side, self.across, self.first_cell = (
            dr.opaque(mi.UInt32, n) for n in (side, across, across * down)
        )
        self.origin = camera.origin
        self.near = NearLamps(lists, members, blocks)
        dr.eval(self.chance, self.clear, *self.slots)

    def block(self, row: Any, column: Any) -> Any:
        """Return the place of tiles, from their rows and columns in the complete grid."""
        return row // self.side * self.across + column // self.side

    def cell(self, p: Any) -> Any:
        """Return the place of points of the world."""
        return self.first_cell + cell_of(p - self.origin)

    def pick(self, g: int, along: Any, place: Any, active: Any) -> Any:
        """Return the number of a lamp of group number `g`, drawn by its probability at `place`.

        Neighbouring lamps usually have neighbouring numbers. Values of `along` from equal parts of
        its range therefore spread over the lamps.

        Parameters
        ----------
        g : number of the light group.
        along : random number, at least 0 and below 1.
        place : number of the place.
        active : lanes that take part.
        """
        count = self.count[g]
        slot = dr.minimum(mi.UInt32(along * mi.Float(count)), count - 1)
        return dr.gather(mi.UInt32, self.slots[g], place * count + slot, active)

    def of(self, lamp: Any, place: Any, active: Any) -> Any:
        """Return the probability of a lamp at `place`.

        Parameters
        ----------
        lamp : number of the lamp.
        place : number of the place.
        active : lanes that take part.
        """
        return dr.gather(mi.Float, self.chance, place * self.lamps + lamp, active)

    def clear_share(self, lamp: Any, place: Any, active: Any) -> Any:
        """Return the share of a lamp's light that is expected to arrive at `place`.

        Parameters
        ----------
        lamp : number of the lamp.
        place : number of the place.
        active : lanes that take part.
        """
        return dr.gather(mi.Float, self.clear, place * self.lamps + lamp, active)


def cell_of(distance: Any) -> Any:
    """Return the number of the cell at the horizontal displacement `distance` from the camera."""
    around, rings = CELLS
    turn = dr.atan2(distance.y, distance.x) / (2 * dr.pi) + 0.5
    ring = dr.log(
        dr.maximum(dr.sqrt(distance.x * distance.x + distance.y * distance.y), RINGS_M[0])
        / RINGS_M[0]
    ) * (rings / np.log(RINGS_M[1] / RINGS_M[0]))
    return dr.minimum(mi.UInt32(turn * around), around - 1) * rings + dr.minimum(
        mi.UInt32(ring), rings - 1
    )


def votes(places: int, place: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Return the sum (place, lamp) of the votes of all points. The vote of a point is the share of
    each lamp in the light of the point, so that bright points do not count more.

    Parameters
    ----------
    places : number of places.
    place : (point,) place of each point.
    light : (point, lamp) that arrives at the points.
    """
    return _summed(places, place, light.sum(1, dtype=float)) @ light


def _summed(places: int, place: np.ndarray, level: np.ndarray) -> sparse.csr_array:
    """Return the matrix (place, point) that sums over the points of each place and divides each
    point by its `level` (point,). `place` (point,) is the place of each point. Points of level 0 do
    not count.
    """
    weight = np.divide(1.0, level, out=np.zeros(len(level)), where=level > 0)
    return sparse.csr_array((weight, (place, np.arange(len(place)))), (places, len(place)))


def places_of(view: View) -> int:
    """Return the number of places: blocks of the picture, and cells of the world."""
    _, across, down = blocks_of(view)
    return across * down + CELLS[0] * CELLS[1]


def blocks_of(view: View) -> tuple[int, int, int]:
    """Return the number of tiles along the side of a block, and the numbers of blocks across and
    down the complete grid. They do not depend on which tiles are left out.
    """
    rows, columns = view.whole
    side = max(1, round(columns / ACROSS))
    return side, -(-columns // side), -(-rows // side)


def slots_of(light: np.ndarray, strength: np.ndarray) -> np.ndarray:
    """Return the lamp (place, slot) that each slot holds. Each lamp gets one slot. The other slots
    are shared in proportion to `light` (place, lamp), or to `strength` at places without light.
    """
    count = light.shape[1]
    ends = np.cumsum(np.where(light.sum(1, keepdims=True) > 0, light, strength), axis=1)
    ends /= ends[:, -1:]
    at = (np.arange((SLOTS - 1) * count) + 0.5) / ((SLOTS - 1) * count)
    place = np.arange(len(light))[:, None]
    slots = (
        np.searchsorted((ends + place).ravel(), (at + place).ravel()).reshape(len(light), -1)
        - place * count
    )
    return np.hstack([np.tile(np.arange(count), (len(light), 1)), np.clip(slots, 0, count - 1)])


def shares_of(slots: np.ndarray, count: int) -> np.ndarray:
    """Return the share of slots (place, slot) that each of `count` lamps holds (place, lamp)."""
    places, per_place = slots.shape
    return (
        np.bincount(
            (np.arange(places)[:, None] * count + slots).ravel(), minlength=places * count
        ).reshape(places, count)
        / per_place
    )


def light_at_points(
    scene: Any,
    hits: HitTables,
    camera: Camera,
    view: View,
    surfaces: SurfaceTables,
    lamps: LampTables,
) -> PlaceLight:
    """Test all lamps from points of all places. Occluded lamps give no light.

    Parameters
    ----------
    scene : scene of Mitsuba, for shadows.
    hits : `HitTables` of the scene.
    camera : `Camera` on the device.
    view : tiles of the frame.
    surfaces : `SurfaceTables` of the scene.
    lamps : tables of the lamps. Each lamp is treated as a point at its middle, with a distance of
        at least its own size.
    """
    side, across, down = blocks_of(view)
    points = across * down * POINTS
    placed = lamps.placed
    middle = np.array(
        [np.average(p.triangles.mean(1), axis=0, weights=areas(p.triangles)) for p in placed]
    )
    reach = [np.linalg.norm(p.triangles - c, axis=-1).max() for p, c in zip(placed, middle)]
    table = _Bounds(
        mi.Point3f(*(mi.Float(np.float32(middle[:, k])) for k in range(3))),
        mi.Float(np.float32(reach)),
        mi.Float(np.float32([p.area_m2 for p in placed])),
    )
    step = max(1, MOST_TRIED // len(placed))
    places = places_of(view)
    # votes, light with and without occlusion
    sums = np.zeros((3, places, len(placed)))
    for start in range(0, points, step):
        number = dr.arange(mi.UInt32, min(step, points - start)) + start
        rng = stream(mi.UInt32(0), number, "blocks")
        block = number // POINTS
        row, column = (
            n * side + dr.minimum(mi.UInt32(rng.next_float32() * side), side - 1)
            for n in (block // across, block % across)
        )
        ray = camera.ray(
            row, column, mi.Point2u(rng.next_uint32(), rng.next_uint32()), mi.Spectrum(0)
        )
        first = _met(scene, hits, surfaces, ray)
        around = mi.warp.square_to_cosine_hemisphere(
            mi.Point2f(rng.next_float32(), rng.next_float32())
        )
        onwards = mi.Ray3f(
            first.point + first.normal * CLEAR_M,
            mi.Frame3f(first.normal).to_world(around),
            0.0,
            mi.Spectrum(0),
        )
        second = _met(scene, hits, surfaces, onwards, first.lit)
        lit = [_tried(scene, lamps, table, met) for met in (first, second)]
        cells = [
            across * down + np.array(cell_of(met.point - camera.origin), int)
            for met in (first, second)
        ]
        for place, found in zip((np.array(block, int), *cells), (lit[0], *lit), strict=True):
            for mine in lamps.members:
                sums[:, :, mine] += _known(places, place, *(light[:, mine] for light in found))
    clear_share = np.divide(sums[1], sums[2], out=np.ones_like(sums[1]), where=sums[2] > 0)
    return PlaceLight(sums[0], clear_share)


def _known(
    places: int, place: np.ndarray, arriving: np.ndarray, in_the_open: np.ndarray
) -> np.ndarray:
    """Return sums (3, place, lamp) over the points of each place: votes, light with occlusion, and
    light without occlusion. Light is relative to all light of the group at the point without
    occlusion.

    Parameters
    ----------
    places : number of places.
    place : (point,) place of each point.
    arriving : (point, lamp) light of the lamps of one group.
    in_the_open : (point, lamp) the same without occlusion.
    """
    summed = _summed(places, place, in_the_open.sum(1, dtype=float))
    return np.stack([votes(places, place, arriving), summed @ arriving, summed @ in_the_open])


class _Bounds(NamedTuple):
    """A sphere around each lamp, on the device."""

    middle: mi.Point3f  # centre of the sphere, m
    reach_m: mi.Float  # radius of the sphere
    area_m2: mi.Float  # area of the lamp


class _Met(NamedTuple):
    """Surface points, on the device."""

    point: mi.Point3f  # m
    normal: mi.Normal3f
    lit: mi.Bool  # whether the ray met such a point


def _met(
    scene: Any, hits: HitTables, surfaces: SurfaceTables, ray: Any, active: Any = True
) -> _Met:
    """Return the points on diffuse or rough surfaces that rays meet first, with normals towards the
    origin of the ray.
    """
    si, shape = hits.meet(scene, ray, mi.Bool(active))
    lit = active & si.is_valid()
    lit &= surfaces.is_smooth(surfaces.material_at(shape, lit), lit)
    normal = mi.Normal3f(si.n * dr.sign(dr.dot(si.n, si.to_world(si.wi))))
    hit = _Met(mi.Point3f(si.p), normal, lit)
    dr.eval(*hit)
    return hit


def _tried(
    scene: Any, lamps: LampTables, bounds: _Bounds, met: _Met
) -> tuple[np.ndarray, np.ndarray]:
    """Return the light of all lamps (point, lamp), with and without occlusion."""
    count = len(lamps.placed)
    pair = dr.arange(mi.UInt32, dr.width(met.lit) * count)
    point = pair // count
    lamp = pair % count
    p, n, lit = (dr.gather(type(v), v, point) for v in met)
    away = dr.gather(mi.Float, bounds.reach_m, lamp)
    way = dr.gather(mi.Point3f, bounds.middle, lamp) - p
    far = dr.norm(way)
    way /= dr.maximum(far, CLEAR_M)
    light = (
        lamps.luminance(lamp, -way)
        * dr.gather(mi.Float, bounds.area_m2, lamp)
        * dr.maximum(dr.dot(way, n), 0)
        / dr.square(dr.maximum(far, away))
    )
    if lamps.fog is not None:
        light *= lamps.fog.along(far)
    possible = lit & (light > 0)
    clear = possible & ~scene.ray_test(
        mi.Ray3f(p + n * CLEAR_M, way, dr.maximum(far - 1.05 * away, 0), 0.0, mi.Spectrum(0)),
        possible,
    )
    shown = lambda where: np.array(dr.select(where, light, 0)).reshape(-1, count)
    return shown(clear), shown(possible)


def areas(triangles: np.ndarray) -> np.ndarray:
    """Return the areas of triangles (n, 3, 3)."""
    return (
        np.linalg.norm(
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
        )
        / 2
    )

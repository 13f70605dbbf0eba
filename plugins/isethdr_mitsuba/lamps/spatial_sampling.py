"""Chances: how likely a lamp is to be looked at from a surface, by what it sends to such places.

A hundred lamps stand in a street at night, and two or three light a tile. So from a few points that
the camera sees in each block of tiles, and one that each of those sees, all lamps are tried once:
how much would come from there, and whether anything stands between. Points of a block tell how
lamps are chosen from the first surface of a path there, points of a cell of the world from further
ones; each has one vote. A quarter of the chances goes to all lamps alike: none is left out. (Many
lamps chosen by place: Shirley, Wang, Zimmerman 1996, ACM Trans. Graph. 15, 1; here with what hides
them.)
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from ..paths.camera_rays import stream
from ..paths.device_memory import aligned
from .near_lamps import NearLamps, near_list

ACROSS = 64  # blocks, where there are as many tiles
POINTS = 8  # of each block
CELLS = 32, 12  # of the world: directions around the camera, and rings of distance ...
RINGS_M = 1.0, 300.0  # ... from its first to its last, each so many times as far as the one before
# for each lamp of a group, one of which is its own: a quarter of the chances is the same for all
SLOTS = 4
MOST_TRIED = 1 << 24  # lamps from points, at once
CLEAR_M = 1e-3  # from a surface on


class Chances:
    """Device tables of the chances of lamps at each place: the blocks of the picture come first,
    then the cells of the world.

    A group has a list of lamps, `slots` (place, slot), each slot as likely as any other; `chance`
    (place, lamp) is the share of slots that a lamp has. It is 0 in blocks that a lamp is `near`:
    there it is looked at without chance.
    """

    def __init__(self, camera, view, members, strength, place, light):
        """`members` : numbers of each group's lamps. `strength` (lamp,) : what they go by where
        nothing is known. `light` (point, lamp) : what is, at `place` (point,).
        """
        side, across, down = blocks_of(view)
        places = across * down + CELLS[0] * CELLS[1]
        chance, self.slots, self.count = np.zeros((places, len(strength))), [], []
        blocks, lists = across * down, []
        for mine in map(np.array, members):
            slots, near = np.zeros((1, 1), int), None  # of a group without lamps: nothing reads it
            if len(mine):
                voted = votes(places, place, light[:, mine])
                own = slots_of(voted, strength[mine])
                known = voted[:blocks].any(1)
                near = near_list(known, own[:blocks], shares_of(own[:blocks], len(mine)))
                own[:blocks] = near.slots
                share, slots = shares_of(own, len(mine)), mine[own]
                # where all lamps are near, chance has none left: its slots hold some, which count
                # for nothing
                listed = np.arange(near.lamps.shape[1]) < near.length[:, None]
                share[np.nonzero(listed)[0], near.lamps[listed]] = 0.0
                chance[:, mine] = share
            lists.append(near)
            self.slots.append(mi.UInt32(aligned(slots, np.uint32)))
            self.count.append(dr.opaque(mi.UInt32, slots.shape[1]))
        self.chance, self.lamps = (
            mi.Float(aligned(chance, np.float32)),
            dr.opaque(mi.UInt32, len(strength)),
        )
        self.side, self.across, self.first_cell = (
            dr.opaque(mi.UInt32, n) for n in (side, across, across * down)
        )
        self.origin, self.near = camera.origin, NearLamps(lists, members, blocks)
        dr.eval(self.chance, *self.slots)

    def block(self, row, column):
        """Return the place of tiles, by their rows and columns in the whole grid."""
        return row // self.side * self.across + column // self.side

    def cell(self, p):
        """Return the place of points of the world."""
        return self.first_cell + cell_of(p - self.origin)

    def pick(self, g: int, rng, place, active):
        """Return the number of a lamp of group number `g`, drawn by its chance at `place`."""
        count = self.count[g]
        slot = dr.minimum(mi.UInt32(rng.next_float32() * mi.Float(count)), count - 1)
        return dr.gather(mi.UInt32, self.slots[g], place * count + slot, active)

    def of(self, lamp, place, active):
        """Return the chance of a lamp at `place`."""
        return dr.gather(mi.Float, self.chance, place * self.lamps + lamp, active)


def cell_of(away):
    """Return the number of the cell that lies `away` from the camera, along the ground."""
    around, rings = CELLS
    turn = dr.atan2(away.y, away.x) / (2 * dr.pi) + 0.5
    ring = dr.log(
        dr.maximum(dr.sqrt(away.x * away.x + away.y * away.y), RINGS_M[0]) / RINGS_M[0]
    ) * (rings / np.log(RINGS_M[1] / RINGS_M[0]))
    return dr.minimum(mi.UInt32(turn * around), around - 1) * rings + dr.minimum(
        mi.UInt32(ring), rings - 1
    )


def votes(places: int, place, light) -> np.ndarray:
    """Return the sum (place, lamp) of what points at `place` (point,) vote for: shares of their own
    light (point, lamp), so that a bright one has no more say.
    """
    out, whole = np.zeros((places, light.shape[1])), light.sum(1, keepdims=True)
    np.add.at(out, place, np.divide(light, whole, out=np.zeros(light.shape), where=whole > 0))
    return out


def blocks_of(view) -> tuple[int, int, int]:
    """Return the tiles along the side of a block, and the blocks across and down the whole grid:
    they are the same whatever is left out of it.
    """
    rows, columns = view.whole
    side = max(1, round(columns / ACROSS))
    return side, -(-columns // side), -(-rows // side)


def slots_of(light, strength) -> np.ndarray:
    """Return which lamp each slot holds (place, slot): each lamp has one, and the others in
    proportion to `light` (place, lamp), where it is dark `strength`.
    """
    count = light.shape[1]
    ends = np.cumsum(np.where(light.sum(1, keepdims=True) > 0, light, strength), axis=1)
    ends /= ends[:, -1:]
    at = (np.arange((SLOTS - 1) * count) + 0.5) / ((SLOTS - 1) * count)
    place = np.arange(len(light))[:, None]
    found = (
        np.searchsorted((ends + place).ravel(), (at + place).ravel()).reshape(len(light), -1)
        - place * count
    )
    return np.hstack([np.tile(np.arange(count), (len(light), 1)), np.clip(found, 0, count - 1)])


def shares_of(slots, count: int) -> np.ndarray:
    """Return the share of slots (place, slot) that each of `count` lamps holds (place, lamp)."""
    places, each = slots.shape
    return (
        np.bincount(
            (np.arange(places)[:, None] * count + slots).ravel(), minlength=places * count
        ).reshape(places, count)
        / each
    )


def light_at_points(scene, hits, camera, view, surfaces, lamps) -> tuple[np.ndarray, np.ndarray]:
    """Return (place, light): how much each lamp lights points (point, lamp), in one unit for all,
    and the place of each; what something hides lights nothing.

    `lamps` : LampTables. A lamp is taken for a point in its middle, no nearer than it is large.
    """
    side, across, down = blocks_of(view)
    points, placed = across * down * POINTS, lamps.placed
    middle = np.array(
        [np.average(p.triangles.mean(1), axis=0, weights=areas(p.triangles)) for p in placed]
    )
    reach = [np.linalg.norm(p.triangles - c, axis=-1).max() for p, c in zip(placed, middle)]
    table = (
        mi.Point3f(*(mi.Float(np.float32(middle[:, k])) for k in range(3))),
        mi.Float(np.float32(reach)),
        mi.Float(np.float32([p.area_m2 for p in placed])),
    )
    step, place, light = max(1, MOST_TRIED // len(placed)), [], []
    for start in range(0, points, step):
        number = dr.arange(mi.UInt32, min(step, points - start)) + start
        rng, block = stream(mi.UInt32(0), number, "blocks"), number // POINTS
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
            first[0] + first[1] * CLEAR_M,
            mi.Frame3f(first[1]).to_world(around),
            0.0,
            mi.Spectrum(0),
        )
        second = _met(scene, hits, surfaces, onwards, first[2])
        lit = [_tried(scene, lamps, *table, *met) for met in (first, second)]
        cells = [
            across * down + np.array(cell_of(met[0] - camera.origin), int)
            for met in (first, second)
        ]
        place += [np.array(block, int), *cells]
        light += [lit[0], *lit]
    return np.concatenate(place), np.concatenate(light)


def _met(scene, hits, surfaces, ray, active=True):
    """Return points of surfaces that light can be looked for from, their normals towards where rays
    come from, and where there are any.
    """
    si, shape = hits.meet(scene, ray, mi.Bool(active))
    lit = active & si.is_valid()
    lit &= surfaces.is_smooth(surfaces.material_at(shape, lit), lit)
    found = mi.Point3f(si.p), mi.Normal3f(si.n * dr.sign(dr.dot(si.n, si.to_world(si.wi)))), lit
    dr.eval(*found)
    return found


def _tried(scene, lamps, middle, reach, area, p, n, lit):
    """Return the light of all lamps (point, lamp)."""
    count = len(lamps.placed)
    pair = dr.arange(mi.UInt32, dr.width(lit) * count)
    point, lamp = pair // count, pair % count
    p, n, lit = (dr.gather(type(v), v, point) for v in (p, n, lit))
    away = dr.gather(mi.Float, reach, lamp)
    way = dr.gather(mi.Point3f, middle, lamp) - p
    far = dr.norm(way)
    way /= dr.maximum(far, CLEAR_M)
    light = (
        lamps.luminance(lamp, -way)
        * dr.gather(mi.Float, area, lamp)
        * dr.maximum(dr.dot(way, n), 0)
        / dr.square(dr.maximum(far, away))
    )
    lit &= light > 0
    lit &= ~scene.ray_test(
        mi.Ray3f(p + n * CLEAR_M, way, dr.maximum(far - 1.05 * away, 0), 0.0, mi.Spectrum(0)), lit
    )
    return np.array(dr.select(lit, light, 0)).reshape(-1, count)


def areas(triangles) -> np.ndarray:
    """Return the areas of triangles (n, 3, 3)."""
    return (
        np.linalg.norm(
            np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
        )
        / 2
    )

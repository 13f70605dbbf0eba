"""Sampling of airlight: the lamp, and the place along a camera ray where fog scatters its light.

Light that fog scatters once on its way from a lamp to the camera is an integral along the camera's
ray. Half of the places on the ray are drawn evenly in the angle at the lamp (equiangular sampling:
Kulla and Fajardo 2012), the other half in proportion to the transmission up to them. The lamp is
drawn by the airlight that it causes on the rays of the block of tiles. Before rendering, the
airlight of every lamp, with shadows, is estimated at places along two rays of each block.

References
----------
Kulla, Fajardo 2012, Computer Graphics Forum 31, 4, section 4 (equiangular sampling).
Talbot 2005, eq. 5 (resampled importance sampling).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..paths.camera_rays import OF_CANDIDATE, stream
from ..paths.device_memory import aligned
from .spatial_sampling import MOST_TRIED, areas, blocks_of, shares_of, slots_of, votes

if TYPE_CHECKING:
    from ..paths.camera_rays import Camera
    from ..paths.fog_tables import FogTables
    from ..paths.hits import HitTables
    from ..world.view import View
    from .lamp_tables import LampTables

RAYS = 2  # number of rays tested in each block
PLACES = 8  # number of places tested along each of these rays
CANDIDATES = 12  # number of candidates for one shadow ray
# 2^32 (11^0.5 - 3): step of a Richtmyer sequence, which spreads the candidates of all paths of a
# tile along the ray
OF_PLACE = 0x510E527F
NEAREST_M = 1e-3  # least distance between ray and lamp in the density of places
# share of the way to a lamp that must be free; allows for float32 and for the lamp's own lens
NEARLY = 1 - 1e-3


class Segment:
    """A ray of a path, its length, and an offset for the candidates on it. Not a tuple or a
    dataclass, because loops of Dr.Jit would take those apart.
    """

    def __init__(self, ray: Any, end: Any, turn: Any) -> None:
        """Describe a stretch of a ray in fog.

        Parameters
        ----------
        ray : ray of the path.
        end : length of the ray, m.
        turn : offset of the first candidate, as a share of 2^32.
        """
        self.ray = ray
        self.end = end
        self.turn = turn


class Aimed(NamedTuple):
    """A place along a ray, and the point of a lamp that lights it."""

    row: mi.UInt32  # row of the lamp's spectrum in the table of spectra
    along: mi.Float  # distance of the place along the ray, m
    towards: mi.Vector3f  # unit vector from the place to the lamp
    away: mi.Float  # distance from the place to the lamp, m
    # luminance of airlight at the reference wavelength, for an albedo of 1 and no shadow, cd/m2
    level: mi.Float


class Angles:
    """Equiangular sampling of places along a ray, as seen from a point."""

    def __init__(self, ray: Any, end: Any, point: Any) -> None:
        """Compute the range of angles that the ray spans at the point.

        Parameters
        ----------
        ray : ray of the path.
        end : length of the ray, m.
        point : point of a lamp, m.
        """
        way = point - ray.o
        self.middle = dr.dot(way, ray.d)
        self.beside = dr.maximum(dr.norm(way - ray.d * self.middle), NEAREST_M)
        self.first = dr.atan2(-self.middle, self.beside)
        self.span = dr.maximum(dr.atan2(end - self.middle, self.beside) - self.first, 1e-6)

    def place(self, u: Any) -> Any:
        """Return the distance along the ray, m, at the share `u` of the range of angles."""
        return self.middle + self.beside * dr.tan(self.first + u * self.span)

    def density(self, along: Any) -> Any:
        """Return the density, 1/m, at the distance `along` of places drawn evenly in the angle."""
        off = along - self.middle
        return self.beside / (self.span * (dr.square(self.beside) + dr.square(off)))


class AirlightLamps:
    """Device tables of the probabilities with which lamps are chosen for the airlight of blocks."""

    def __init__(self, lamps: LampTables, fog: FogTables) -> None:
        """Keep the tables of lamps and fog; `aim` computes the probabilities."""
        self.scene = None
        self.lamps = lamps
        self.fog = fog

    def aim(self, scene: Any, hits: HitTables, camera: Camera, view: View) -> None:
        """Compute the probabilities. Call this before `choose`.

        Parameters
        ----------
        scene : scene of Mitsuba, for shadows.
        hits : `HitTables` of the scene.
        camera : `Camera` on the device.
        view : tiles of the frame.
        """
        self.scene = scene
        placed = self.lamps.placed
        _, across, down = blocks_of(view)
        light = np.zeros((across * down, 0))
        if placed:
            light = _tried(scene, hits, camera, view, self)
        strength = np.array([np.sqrt(p.peak_cd_m2 * p.area_m2) for p in placed])
        strength += np.finfo(float).tiny
        chance = np.zeros((across * down, len(placed)))
        self.slots = []
        self.count = []
        for mine in map(np.array, self.lamps.members):
            slots = np.zeros((1, 1), int)  # for a group without lamps; never read
            if len(mine):
                blocks = np.repeat(np.arange(across * down), RAYS)
                voted = votes(across * down, blocks, light[:, mine])
                own = slots_of(voted, strength[mine])
                chance[:, mine] = shares_of(own, len(mine))
                slots = mine[own]
            self.slots.append(mi.UInt32(aligned(slots, np.uint32)))
            self.count.append(dr.opaque(mi.UInt32, slots.shape[1]))
        self.chance = mi.Float(aligned(chance, np.float32))
        self.number = dr.opaque(mi.UInt32, len(placed))
        self.tries = dr.opaque(mi.UInt32, CANDIDATES)
        dr.eval(self.chance, *self.slots)

    def _pick(self, g: int, along: Any, block: Any, active: Any) -> Any:
        """Return a lamp of group number `g`, drawn by its probability at a block."""
        count = self.count[g]
        slot = dr.minimum(mi.UInt32(along * mi.Float(count)), count - 1)
        return dr.gather(mi.UInt32, self.slots[g], block * count + slot, active)

    def sent(
        self, ray: Any, along: Any, lamp: Any, point: Any, normal: Any, active: Any
    ) -> tuple[Any, Any, Any]:
        """Return the airlight by one point of a lamp at a place on the ray.

        Parameters
        ----------
        ray : ray of the path.
        along : distance of the place along the ray, m.
        lamp : number of the lamp.
        point : point of the lamp, m.
        normal : normal of the lamp at the point.
        active : lanes that take part.

        Returns
        -------
        The luminance of airlight without shadows, cd m-2 per metre of ray and square metre of lamp;
        the unit vector from the place to the point; and the distance between them, m.
        """
        way = point - (ray.o + ray.d * along)
        away = dr.maximum(dr.norm(way), 1e-6)
        way /= away
        cos_lamp = -dr.dot(way, normal)
        level = self.lamps.luminance(lamp, -way, active) * dr.maximum(cos_lamp, 0)
        level *= (
            self.fog.sampled * self.fog.along(along + away) * self.fog.phase(dr.dot(way, ray.d))
        )
        return level / dr.square(away), way, away

    @dr.syntax
    def choose(
        self, g: int, rng: np.random.Generator, segment: Any, block: Any, active: Any
    ) -> Any:
        """Return a place on a segment, and the point of a lamp that lights it.

        Each of `CANDIDATES` candidates is a point of a lamp and a place on the ray. One is kept,
        with a probability in proportion to its airlight without shadows. Each candidate is drawn
        from its own part of the group's lamps and from its own part of the ray.

        Parameters
        ----------
        g : number of the light group.
        rng : random numbers.
        segment : `Segment`, the stretch of a ray in fog.
        block : number of the block of the picture.
        active : lanes that take part.

        Returns
        -------
        `Aimed`, whose level is the mean weight of all candidates.
        """
        ray = segment.ray
        end = segment.end
        targets = self.lamps.targets[g]
        triangle = mi.UInt32(0)
        kept_along = mi.Float(0)
        kept_towards = mi.Vector3f(0)
        kept_away = mi.Float(1)
        total = mi.Float(0)
        start = rng.next_uint32()
        k = mi.UInt32(0)
        while k < self.tries:
            # a point of a lamp; candidate k draws the lamp from part k of the group's lamps
            part = mi.Float(k) + mi.Float((start + k * OF_CANDIDATE) >> 8) * 2.0**-24
            lamp = self._pick(g, part / mi.Float(self.tries), block, active)
            t = targets.pick(rng, lamp, active)
            corner, edge1, edge2, normal, _, (_, _, _, _, per_area) = targets.at(t, active)
            s = dr.sqrt(rng.next_float32())
            w = rng.next_float32()
            point = mi.Point3f(corner + edge1 * (1 - s) + edge2 * (s * w))
            # choose a place on the ray, either by the angle that it makes at the lamp, or by the
            # transmission of the fog up to it
            angles = Angles(ray, end, point)
            u = 2 * mi.Float((segment.turn + k * OF_PLACE) >> 8) * 2.0**-24
            lost = 1 - self.fog.along(end)
            by_angle = u < 1
            u = dr.select(by_angle, u, u - 1)
            by_loss = -dr.log(dr.maximum(1 - u * lost, 1e-30)) / self.fog.sampled
            along = dr.clip(dr.select(by_angle, angles.place(u), by_loss), 0, end)
            # density of both ways together, 1/m, times that of the point, 1/m2
            density = 0.5 * angles.density(along)
            density += 0.5 * self.fog.sampled * self.fog.along(along) / dr.maximum(lost, 1e-12)
            chance = dr.gather(mi.Float, self.chance, block * self.number + lamp, active)
            value, way, away = self.sent(ray, along, lamp, point, normal, active)
            density *= chance * per_area
            weight = dr.select(active & (density > 0) & (value > 0), value / density, 0)
            # keep one candidate, in proportion to its weight
            total += weight
            take = (weight > 0) & (rng.next_float32() * total < weight)
            triangle = dr.select(take, t, triangle)
            kept_along = dr.select(take, along, kept_along)
            kept_towards = dr.select(take, way, kept_towards)
            kept_away = dr.select(take, away, kept_away)
            k += 1
        row = dr.gather(mi.UInt32, targets.row, triangle, active)
        return Aimed(row, kept_along, kept_towards, kept_away, total / mi.Float(self.tries))


def _tried(
    scene: Any, hits: HitTables, camera: Camera, view: View, air: AirlightLamps
) -> np.ndarray:
    """Return the airlight (ray, lamp) on `RAYS` rays of each block, up to a common factor.

    A lamp counts as one point at its middle. Within the radius of the lamp around that point, light
    is as strong as at the radius, and its own faces cast no shadow.
    """
    side, across, down = blocks_of(view)
    placed = air.lamps.placed
    middle = np.array(
        [np.average(p.triangles.mean(1), axis=0, weights=areas(p.triangles)) for p in placed]
    )
    reach = [np.linalg.norm(p.triangles - c, axis=-1).max() for p, c in zip(placed, middle)]
    numbers = lambda values: mi.Float(np.ascontiguousarray(values, np.float32))
    middles = mi.Point3f(*map(numbers, middle.T))
    reaches = numbers(reach)
    area = numbers([p.area_m2 for p in placed])
    rays = across * down * RAYS
    step = max(1, MOST_TRIED // (len(placed) * PLACES))
    out = []
    for begin in range(0, rays, step):
        number = dr.arange(mi.UInt32, min(step, rays - begin)) + begin
        rng = stream(mi.UInt32(0), number, "airlight")
        block = number // RAYS
        row, column = (
            n * side + dr.minimum(mi.UInt32(rng.next_float32() * side), side - 1)
            for n in (block // across, block % across)
        )
        inside = mi.Point2u(rng.next_uint32(), rng.next_uint32())
        ray = camera.ray(row, column, inside, mi.Spectrum(0))
        end = dr.minimum(hits.meet(scene, ray, mi.Bool(True))[0].t, air.fog.to_border(ray.o, ray.d))
        offset = rng.next_float32()
        dr.eval(ray, end, offset)
        pair = dr.arange(mi.UInt32, dr.width(number) * len(placed))
        which = pair // len(placed)
        lamp = pair % len(placed)
        own = dr.gather(mi.Ray3f, ray, which)
        target = dr.gather(mi.Point3f, middles, lamp)
        size = dr.gather(mi.Float, reaches, lamp)
        angles = Angles(own, dr.gather(mi.Float, end, which), target)
        light = mi.Float(0)
        for k in range(PLACES):
            along = angles.place((k + dr.gather(mi.Float, offset, which)) / PLACES)
            place = own.o + own.d * along
            way = target - place
            away = dr.norm(way)
            way /= dr.maximum(away, 1e-6)
            level = air.lamps.luminance(lamp, -way) * dr.gather(mi.Float, area, lamp)
            level *= air.fog.along(along + away) * air.fog.phase(dr.dot(way, own.d))
            level /= dr.square(dr.maximum(away, size)) * angles.density(along)
            clear = dr.maximum(away - 1.05 * size, 0)
            shadow = mi.Ray3f(mi.Point3f(place), mi.Vector3f(way), clear, 0.0, mi.Spectrum(0))
            light += dr.select((level > 0) & ~scene.ray_test(shadow, level > 0), level, 0)
        out.append(np.array(light).reshape(-1, len(placed)))
    return np.concatenate(out)

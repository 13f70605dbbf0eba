"""Lamps as lookup tables: the luminance of a lamp that a ray hits, and the target point of a shadow
ray.

Tables replace Mitsuba emitters for three reasons. A hundred lamps need no more code than one. Each
group can be sampled by itself. The group of a lamp costs one lookup. `beam_lamp.py` is the same
lamp as a Mitsuba emitter; tests compare the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.scene import Opening, SkyDome

from ..paths.camera_rays import OF_CANDIDATE
from ..paths.device_memory import aligned
from ..world.geometry import World
from .device_grids import DeviceGrids
from .placed_lamps import LAMBERTIAN_COS, SPECTRUM_NM, PlacedLamp, emission_table
from .sky_dome import DomeTable, sky_rows
from .sky_openings import SkyOpenings
from .spatial_sampling import Chances, PlaceLight, areas, light_at_points, places_of

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Spectrum

    from ..paths.camera_rays import Camera
    from ..paths.hits import HitTables
    from ..paths.surface_tables import SurfaceTables
    from ..world.view import View

# Largest number of candidates for one shadow ray. From 4 to 16 candidates, the cost grew by a
# factor of 1.6, and the noise of lamps fell by factors of 0.5 to 1.0.
CANDIDATES = 12
# the same at the first surface, where each near lamp gets its own shadow ray as well
FIRST_CANDIDATES = 8
# Number of candidates for each lamp of a group. On a street with two lamps in each group, 6
# candidates have the noise of 12, and a path takes a fifth less time.
CANDIDATES_A_LAMP = 3
NOWHERE = 0xFFFF  # group number of lamps that belong to none of the groups


class LampTables:
    """Device tables of the lamps of a world, for the requested light groups.

    The target of a shadow ray is drawn for each group by resampled importance sampling (Talbot
    2005, eq. 5). `CANDIDATES` points on lamps of the group, or fewer if it has few lamps, are drawn
    by the probabilities of `spatial_sampling.py`, each on its own part of the lamps. One of them is
    kept, with a probability in proportion to the light that it would send without occlusion, times
    the share of the lamp's light that reached the tested points of the place.
    """

    def __init__(
        self,
        world: World,
        lamps: list[PlacedLamp],
        groups: list[str],
        sky: Spectrum | None = None,
        openings: Sequence[Opening] = (),
    ) -> None:
        """Make the tables of all lamps.

        Parameters
        ----------
        world : scene with the shapes that the lamps belong to.
        lamps : placed lamps, by number.
        groups : names of the light groups, by number.
        sky : spectrum of a uniform sky, `SkyDome`, or None.
        openings : openings at which surfaces behind them aim shadow rays to the sky.
        """
        self.groups = list(groups)
        self.fog = None  # FogTables, where there is fog
        self.openings = SkyOpenings(openings) if openings else None
        spectra = list(dict.fromkeys(p.lamp.spectrum for p in lamps))
        # rows of lamps are per cd/m2; the last rows, of the sky, are absolute
        of_sky = sky_rows(sky, SPECTRUM_NM)
        self.emission = np.vstack([emission_table(spectra), of_sky])
        self.sky_rows = len(of_sky)
        self.dome = DomeTable(sky) if isinstance(sky, SkyDome) else None
        group = [
            self.groups.index(p.lamp.group) if p.lamp.group in self.groups else NOWHERE
            for p in lamps
        ] + [NOWHERE]
        # The last entry is "no lamp", so that every lookup lies inside its table. Lamps are data
        # and not code, so that all scenes share one compiled kernel.
        self.none = dr.opaque(mi.UInt32, len(lamps))
        last = lambda values, fill: mi.Float([*values, fill])
        lamp_of_shape = world.table(lambda s: len(lamps) if s.lamp is None else s.lamp, len(lamps))
        self.lamp_of_shape = mi.UInt32(aligned(lamp_of_shape, np.uint32))
        self.group = mi.UInt32(group)
        row = [*(spectra.index(p.lamp.spectrum) for p in lamps), 0]
        self.row = mi.UInt32(row)
        self.axis = mi.Vector3f(*(last([float(p.axis[k]) for p in lamps], 0) for k in range(3)))
        self.cos_inner = last([p.cos_inner for p in lamps], 0)
        self.cos_outer = last([p.cos_outer for p in lamps], -1)
        self.floor = last([p.floor for p in lamps], 0)
        self.peak = last([p.peak_cd_m2 for p in lamps], 0)
        self.per_area = last([1 / p.area_m2 for p in lamps], 0)
        self.grids = DeviceGrids(lamps)
        self.placed = list(lamps)
        self.members = [[i for i in range(len(lamps)) if group[i] == g] for g in range(len(groups))]
        # numbers of candidates of each group, at the first surface and at all others
        few = [max(1, CANDIDATES_A_LAMP * len(mine)) for mine in self.members]
        self.tries = [
            [dr.opaque(mi.UInt32, min(most, n)) for most in (FIRST_CANDIDATES, CANDIDATES)]
            for n in few
        ]
        self.tries_of_lamp = [
            mi.UInt32([1 if g == NOWHERE else min(most, few[g]) for g in group])
            for most in (FIRST_CANDIDATES, CANDIDATES)
        ]
        self.targets = [
            _Targets(len(lamps), {i: (row[i], lamps[i]) for i in mine}) for mine in self.members
        ]
        dr.eval(
            self.lamp_of_shape,
            self.group,
            self.row,
            self.axis,
            self.per_area,
            self.peak,
            self.floor,
            self.cos_inner,
            self.cos_outer,
            *self.tries_of_lamp,
        )

    def candidates(self, g: int, first: Any) -> Any:
        """Return the number of candidates of a shadow ray to a lamp of group number `g`.

        Parameters
        ----------
        g : number of the light group.
        first : whether the ray starts from the first surface of a path.
        """
        return dr.select(first, *self.tries[g])

    def aim(
        self, scene: Any, hits: HitTables, camera: Camera, view: View, surfaces: SurfaceTables
    ) -> None:
        """Compute the probability of each lamp for each part of the picture. Call this before any
        `choose` and `density`.

        Parameters
        ----------
        scene : scene of Mitsuba, for shadows.
        hits : `HitTables` of the scene.
        camera : `Camera` on the device.
        view : tiles of the frame.
        surfaces : `SurfaceTables` of the scene.
        """
        known = (
            light_at_points(scene, hits, camera, view, surfaces, self)
            if self.placed
            else PlaceLight(*np.zeros((2, places_of(view), 0)))
        )
        # all lamps may be switched off
        strength = (
            np.array([np.sqrt(p.peak_cd_m2 * p.area_m2) for p in self.placed])
            + np.finfo(float).tiny
        )
        self.chances = Chances(camera, view, self.members, strength, known)

    def has_lamps(self, g: int) -> bool:
        """Return whether group number `g` contains a lamp; the sky is not a lamp."""
        return self.targets[g].count > 0

    def lamp_at(self, shape: Any, active: Any) -> Any:
        """Return the number of the lamp that a shape belongs to; `none` for other shapes."""
        return dr.select(active, dr.gather(mi.UInt32, self.lamp_of_shape, shape, active), self.none)

    def luminance(self, lamp: Any, direction: Any, active: Any = True) -> Any:
        """Return the luminance, cd/m2, that `lamp` emits along the unit vector `direction`.

        Parameters
        ----------
        lamp : number of the lamp.
        direction : unit vector that leaves the lamp.
        active : lanes that take part.
        """
        take = lambda table: dr.gather(type(table), table, lamp, active)
        axis = take(self.axis)
        inner, outer, floor, peak = map(
            take, (self.cos_inner, self.cos_outer, self.floor, self.peak)
        )
        pattern = _cone(dr.dot(direction, axis), inner, outer)
        pattern = self.grids.pattern(lamp, direction, axis, pattern, active)
        return peak * (pattern + floor) / (1 + floor)

    def rival(
        self, lamp: Any, place: Any, first: Any, distance2: Any, cos_lamp: Any, active: Any = True
    ) -> Any:
        """Return the density per solid angle with which shadow rays from `place` aim at a point of
        `lamp`. It counts all candidates, or the single point of a near lamp.

        Parameters
        ----------
        lamp : number of the lamp.
        place : number of the place from which lamps are chosen.
        first : whether the place is that of the first surface of a path.
        distance2 : squared distance of the point on the lamp, m2.
        cos_lamp : cosine between the lamp's normal and the direction back from the lamp.
        active : lanes that take part.
        """
        chance = self.chances.of(lamp, place, active)
        tries = dr.select(
            first, *(dr.gather(mi.UInt32, table, lamp, active) for table in self.tries_of_lamp)
        )
        return _density(
            dr.gather(mi.Float, self.per_area, lamp, active)
            * dr.select(chance > 0, mi.Float(tries) * chance, 1),
            distance2,
            cos_lamp,
        )

    def near_count(self, g: int, block: Any, active: Any) -> Any:
        """Return the number of near lamps of group number `g` at blocks of the picture.

        Parameters
        ----------
        g : number of the light group.
        block : number of the block of the picture.
        active : lanes that take part.
        """
        return self.chances.near.length(g, block, active)

    def near_point(
        self, g: int, turn: Any, rng: Any, si: Any, block: Any, active: Any
    ) -> tuple[Any, ...]:
        """Return the same as `choose` for a random point of near lamp number `turn` of the
        group.

        Parameters
        ----------
        g : number of the light group.
        turn : which of the near lamps.
        rng : random numbers.
        si : surface interaction that is lit.
        block : number of the block of the picture.
        active : lanes that take part.
        """
        targets = self.targets[g]
        lamp = self.chances.near.lamp(g, block, turn, active)
        triangle = targets.pick(rng, lamp, active)
        point, direction, sent, _, density = self._candidate(g, lamp, triangle, rng, si, active)
        row = dr.gather(mi.UInt32, targets.row, triangle, active)
        return row, point, direction, sent / density, density

    def _candidate(
        self, g: int, lamp: Any, triangle: Any, rng: Any, si: Any, active: Any
    ) -> tuple[Any, ...]:
        """Return a random point of a triangle of `lamp`.

        Returns
        -------
        The point on the lamp, the unit direction to it, the luminance that it emits towards the
        surface (0 if it cannot light this side), the cosine at the surface, and the density of the
        point per solid angle.
        """
        corner, edge1, edge2, normal, axis, (inner, outer, floor, peak, per_area) = self.targets[
            g
        ].at(triangle, active)
        s = dr.sqrt(rng.next_float32())
        w = rng.next_float32()
        p = mi.Point3f(corner + edge1 * (1 - s) + edge2 * (s * w))
        d = p - si.p
        r2 = dr.maximum(dr.squared_norm(d), 1e-12)
        d *= dr.rsqrt(r2)
        # light counts on the side of the surface from which the path came
        side = si.n * dr.sign(dr.dot(si.n, si.to_world(si.wi)))
        cos_lamp = -dr.dot(d, normal)
        cos_here = dr.dot(d, side)
        lit = active & (cos_lamp > 0) & (cos_here > 0)
        pattern = _cone(-dr.dot(d, axis), inner, outer)
        pattern = self.grids.pattern(lamp, -d, axis, pattern, lit)
        sent = dr.select(lit, peak * (pattern + floor) / (1 + floor), 0)
        return p, d, sent, cos_here, _density(per_area, r2, cos_lamp)

    @dr.syntax
    def choose(  # noqa: PLR0913 - variables of a compiled loop
        self,
        g: int,
        rng: np.random.Generator,
        si: Any,
        place: Any,
        tries: Any,
        turn: Any,
        active: Any,
    ) -> Any:
        """Return the target of a shadow ray.

        The group is divided into `tries` equal parts, and candidate k lies on a lamp of part k. One
        candidate is kept, with a probability in proportion to its light and to the share of it that
        is expected to arrive.

        Parameters
        ----------
        g : number of the light group.
        rng : random numbers.
        si : surface interaction that is lit.
        place : number of the place from which lamps are chosen.
        tries : number of candidates.
        turn : two random numbers, as shares of 2^32: x decides where in its part each candidate
            lies, y which candidate is kept.
        active : lanes that take part.

        Returns
        -------
        Row of the spectrum of the lamp, point on the lamp in the world, unit direction to it, its
        luminance divided by the density of the choice, and density of all `tries` candidates.
        """
        targets = self.targets[g]
        triangle = mi.UInt32(0)
        point = mi.Point3f(0)
        direction = mi.Vector3f(0)
        shine = mi.Float(0)
        kept = mi.Float(0)
        total = mi.Float(0)
        density = mi.Float(1)
        # one random number serves all candidates: after each decision it is rescaled to 0..1
        u = mi.Float(turn.y >> 8) * 2.0**-24
        k = mi.UInt32(0)
        while k < tries:
            along = mi.Float(k) + mi.Float((turn.x + k * OF_CANDIDATE) >> 8) * 2.0**-24
            along /= mi.Float(tries)
            lamp = self.chances.pick(g, along, place, active)
            t = targets.pick(rng, lamp, active)
            p, d, sent, cos_here, each = self._candidate(g, lamp, t, rng, si, active)
            chance = self.chances.of(lamp, place, active)
            each *= chance
            value = sent * cos_here * self.chances.clear_share(lamp, place, active)
            value = dr.select(chance > 0, value, 0)
            if dr.hint(self.fog is not None, mode="scalar"):
                value *= self.fog.along(dr.norm(p - si.p))
            weight = dr.select(value > 0, value / each, 0)
            total += weight
            part = weight / dr.maximum(total, 1e-30)
            take = (weight > 0) & (u < part)
            u = dr.select(take, u / part, (u - part) / dr.maximum(1 - part, 1e-7))
            triangle = dr.select(take, t, triangle)
            point = dr.select(take, p, point)
            direction = dr.select(take, d, direction)
            shine = dr.select(take, sent, shine)
            kept = dr.select(take, value, kept)
            density = dr.select(take, each, density)
            k += 1
        level = dr.select(kept > 0, shine * (total / (mi.Float(tries) * kept)), 0)
        row = dr.gather(mi.UInt32, targets.row, triangle, active)
        return row, point, direction, level, mi.Float(tries) * density


def _cone(cosine: Any, inner: Any, outer: Any) -> Any:
    t = dr.clip((cosine - outer) / dr.maximum(inner - outer, 1e-6), 0, 1)
    return dr.select(inner <= LAMBERTIAN_COS, 1.0, t * t * (3 - 2 * t))


def _density(per_area: Any, distance2: Any, cos_lamp: Any) -> Any:
    return per_area * distance2 / dr.maximum(cos_lamp, 1e-9)


class _Targets:
    """The triangles of one light group, with the data that a candidate needs. Triangles of a lamp
    are drawn in proportion to their areas. Each has the beam of its lamp.
    """

    def __init__(self, count: int, lamps: dict[int, tuple[int, PlacedLamp]]) -> None:
        """Make the tables.

        Parameters
        ----------
        count : number of lamps of all groups.
        lamps : {number: (row of its spectrum, lamp)} of this group.
        """
        self.count = len(lamps)
        if not lamps:
            return
        tri = np.concatenate([p.triangles for _, p in lamps.values()])
        normal = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        each = lambda value: np.concatenate(
            [np.tile(value(*lamp), (len(lamp[1].triangles), 1)) for lamp in lamps.values()]
        )
        beam = each(lambda _, p: [p.cos_inner, p.cos_outer, p.floor, p.peak_cd_m2, 1 / p.area_m2])
        vectors = (
            tri[:, 0],
            tri[:, 1] - tri[:, 0],
            tri[:, 2] - tri[:, 0],
            normal,
            each(lambda _, p: p.axis),
        )
        # Passed as lists, which Dr.Jit copies into aligned memory. NumPy arrays would be used in
        # place; they are aligned only by chance, and unaligned ones need another kernel.
        # Shape: (triangle, 5, 4)
        rows = np.stack(
            [np.column_stack([v, beam[:, k]]) for k, v in enumerate(vectors)], 1
        ).astype(np.float32)
        self.rows = mi.Float(rows.ravel().tolist())
        self.row = mi.UInt32(aligned(each(lambda row, p: [row]), np.uint32))
        sizes = np.array([len(p.triangles) for _, p in lamps.values()])
        first = np.cumsum(sizes) - sizes
        own = [alias_table(areas(p.triangles)) for _, p in lamps.values()]
        thresholds = np.concatenate([threshold for threshold, _ in own])
        self.threshold = mi.Float(aligned(thresholds, np.float32))
        others = np.concatenate([other + f for (_, other), f in zip(own, first)])
        self.other = mi.UInt32(aligned(others, np.uint32))
        starts, lengths = np.zeros((2, count), np.uint32)
        starts[list(lamps)], lengths[list(lamps)] = first, sizes
        self.first = mi.UInt32(aligned(starts, np.uint32))
        self.length = mi.UInt32(aligned(lengths, np.uint32))
        dr.eval(self.rows, self.row, self.threshold, self.other, self.first, self.length)

    def pick(self, rng: Any, lamp: Any, active: Any) -> Any:
        """Return the number of a triangle of a lamp, drawn in proportion to its area."""
        length = dr.gather(mi.UInt32, self.length, lamp, active)
        k = dr.gather(mi.UInt32, self.first, lamp, active) + dr.minimum(
            mi.UInt32(rng.next_float32() * mi.Float(length)), dr.maximum(length, 1) - 1
        )
        return dr.select(
            rng.next_float32() < dr.gather(mi.Float, self.threshold, k, active),
            k,
            dr.gather(mi.UInt32, self.other, k, active),
        )

    def at(self, triangle: Any, active: Any) -> tuple[Any, ...]:
        """Return a corner of a triangle, both edges from it, the normal, the axis of the lamp, and
        the list [cos_inner, cos_outer, floor, peak in cd/m2, 1 / area in m-2] of the lamp.
        """
        rows = [dr.gather(mi.Vector4f, self.rows, 5 * triangle + k, active) for k in range(5)]
        return *(mi.Vector3f(r.x, r.y, r.z) for r in rows), [r.w for r in rows]


def alias_table(chance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the alias table (threshold, other) of probabilities in proportion to `chance`.

    To use it, draw k evenly, keep it with probability threshold[k], otherwise take other[k] (Walker
    1977, Vose 1991).
    """
    share = np.asarray(chance, float) * len(chance) / np.sum(chance)
    threshold = np.ones(len(share))
    other = np.arange(len(share))
    small = list(np.flatnonzero(share < 1))
    large = list(np.flatnonzero(share >= 1))
    while small and large:
        k = small.pop()
        rich = large[-1]
        threshold[k], other[k] = share[k], rich
        share[rich] -= 1 - share[k]
        if share[rich] < 1:
            small.append(large.pop())
    return threshold, other

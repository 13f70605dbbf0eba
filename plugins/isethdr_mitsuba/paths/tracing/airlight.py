"""Airlight: light of lamps that fog scatters into a ray once, and light of the sky that fog
scatters into it any number of times.

Lamps: a place along the ray and a point of a lamp are drawn (`lamps.airlight_sampling`). One shadow
ray for each group tests whether the lamp is visible from there.

Sky: the sky is uniform, and begins where the fog ends. A random walk begins at a place along the
ray and takes directions by the phase function. It ends at the sky when it leaves the fog, or at a
surface, which adds no light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi

from ...lamps.airlight_sampling import NEARLY, Segment
from .lanes import OF_AIR

if TYPE_CHECKING:
    import numpy as np

    from isethdr_core.data.fog import Fog

    from ...lamps.airlight_sampling import AirlightLamps
    from .lanes import Fixed, Met, Numbers, Path, Queue
    from .launch_tables import Light

MOST_SCATTERED = 200  # largest number of times that a walk is scattered
CLEAR = 1e-3  # share of the way to a surface that walks keep free in front of it


@dr.syntax
def cross_fog(
    fixed: Fixed, path: Path, numbers: Numbers, total: Light, met: Met, queue: Queue
) -> tuple[Path, Numbers, Light]:
    """Return `path`, `numbers` and `total` after the fog along the ray, up to its hit point. The
    weight of the path is attenuated, and airlight is added.

    Parameters
    ----------
    fixed : constants of the loop.
    path : path with the ray that crosses the fog.
    numbers : random numbers.
    total : light of the work items so far.
    met : hit of the ray.
    queue : paths that share the camera ray.
    """
    fog = fixed.tables.fog
    spectra = fixed.tables.spectra
    first = path.depth == 0
    path.straight |= first
    # all paths of one camera ray share its airlight
    many = dr.select(first, mi.Float(queue.shares), 1)
    end = dr.minimum(met.si.t, fog.to_border(path.ray.o, path.ray.d))
    # lamps have a turn of their own: the sky, if it is rendered, takes any number of random numbers
    turn = dr.select(first, numbers.air, numbers.of_fog[fixed.groups].next_uint32())
    of_lamps = dr.select(first, numbers.air, numbers.of_fog[fixed.groups + 1].next_uint32())
    numbers.air += dr.select(first, fixed.items.lanes * OF_AIR, 0)
    segment = Segment(path.ray, end, of_lamps)
    for g in fixed.with_lamps:
        seen = path.going & path.straight & fixed.wanted[g]
        if seen:
            source, level, packs = from_lamps(
                fixed.tables.air, g, numbers.of_fog[g], segment, fixed.block, seen
            )
            light = spectra.at(path.place, spectra.lights + source, level > 0)
            for k in range(fixed.packets):
                total[g][k] += path.beta[k] * light[k] * packs[k] * (level * many)
    segment = Segment(path.ray, end, turn)
    if dr.hint(fixed.sky >= 0, mode="scalar"):
        seen = path.going & fixed.wanted[fixed.sky]
        if seen:
            packs = from_sky(fixed.tables.scene, fog, numbers.of_fog[fixed.groups], segment, seen)
            light = spectra.at(path.place, fixed.row_of_sky(path), seen)
            for k in range(fixed.packets):
                total[fixed.sky][k] += path.beta[k] * light[k] * packs[k] * many
    left_after = fog.transmission(end)
    for k in range(fixed.packets):
        path.beta[k] *= left_after[k]
    return path, numbers, total


def from_lamps(
    air: AirlightLamps, g: int, rng: Any, segment: Segment, block: Any, active: Any
) -> tuple[Any, Any, list[Any]]:
    """Return the airlight of group number `g` along a `Segment`: row of the spectrum, level in
    cd/m2, and packets relative to the reference wavelength.

    Parameters
    ----------
    air : probabilities of lamps for airlight.
    g : number of the light group.
    rng : random numbers.
    segment : stretch of a ray in fog.
    block : number of the block of the picture.
    active : lanes that take part.
    """
    aimed = air.choose(g, rng, segment, block, active)
    lit = active & (aimed.level > 0)
    place = mi.Point3f(segment.ray.o + segment.ray.d * aimed.along)
    shadow = mi.Ray3f(place, aimed.towards, aimed.away * NEARLY, 0.0, mi.Spectrum(0))
    lit &= ~air.scene.ray_test(shadow, lit)
    level = dr.select(lit, aimed.level, 0)
    return aimed.row, level, air.fog.against_sampled(aimed.along + aimed.away)


@dr.syntax
def from_sky(
    scene: Any, fog: Fog | None, rng: np.random.Generator, segment: Any, active: Any
) -> Any:
    """Return the packets of airlight along a `Segment` by a uniform sky above the fog, relative to
    the radiance of the sky.

    Parameters
    ----------
    scene : scene of Mitsuba, for shadows.
    fog : `FogTables` of the fog.
    rng : random numbers.
    segment : stretch of a ray in fog.
    active : lanes that take part.
    """
    ray = segment.ray
    lost = 1 - fog.along(segment.end)
    u = mi.Float(segment.turn >> 8) * 2.0**-24
    along = -dr.log(dr.maximum(1 - u * lost, 1e-30)) / fog.sampled
    along = dr.minimum(along, segment.end)
    place = mi.Point3f(ray.o + ray.d * along)
    way = mi.Vector3f(ray.d)
    weight = dr.select(active, lost * fog.albedo, 0)
    walks = mi.Bool(active)
    found = mi.Float(0)
    k = mi.UInt32(0)
    while walks:
        way = fog.scattered(way, rng)
        onwards = mi.Ray3f(place, way, 0.0, mi.Spectrum(0))
        met = scene.ray_intersect_preliminary(onwards, active=walks)
        border = fog.to_border(place, way)
        free = dr.select(met.is_valid(), dr.minimum(met.t * (1 - CLEAR), border), border)
        next_place = -dr.log(dr.maximum(1 - rng.next_float32(), 1e-30)) / fog.sampled
        stays = next_place < free
        out = ~stays & (~met.is_valid() | (border < met.t))
        # a walk that is stopped early counts as one that reached the sky
        out |= stays & (k >= MOST_SCATTERED)
        found = dr.select(walks & out, weight, found)
        walks &= stays & (k < MOST_SCATTERED)
        place = dr.select(walks, place + way * next_place, place)
        weight *= fog.albedo
        k += 1
    return [found * each for each in fog.relative_to_sampled(along)]

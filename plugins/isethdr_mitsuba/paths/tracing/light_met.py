"""Light met: the light that a path finds when its own ray, not a shadow ray, hits the sky or a
lamp.

The sky counts for all rays, a lamp only after the first surface: `visible_lamps` computes the lamps
that the camera sees. Where a shadow ray may find the same light, both are weighted (balance
heuristic: Veach and Guibas 1995).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi

if TYPE_CHECKING:
    from .lanes import Fixed, Met, Path, Queue
    from .launch_tables import Light


@dr.syntax
def add_sky(fixed: Fixed, path: Path, total: Light, met: Met, queue: Queue) -> Light:
    """Return `total` with the light of the sky added for rays that leave the scene.

    Parameters
    ----------
    fixed : constants of the loop.
    path : path with the ray.
    total : light of the work items so far.
    met : hit of the ray.
    queue : paths that share the camera ray.
    """
    sky = fixed.sky
    dome = fixed.tables.lamps.dome
    first = path.depth == 0
    level = dr.select(
        met.escapes & fixed.wanted[sky], dr.select(first, mi.Float(queue.shares), 1), 0
    )
    if dr.hint(fixed.openings is not None, mode="scalar"):
        rivals = met.escapes & ~path.specular
        rival = fixed.openings.density(path.ray.o, path.ray.d, rivals)
        level *= dr.select(rivals, path.bsdf_density / (path.bsdf_density + rival), 1)
    if dr.hint(dome is None, mode="scalar"):
        for k in range(fixed.packets):
            total[sky][k] += path.beta[k] * met.colour[k] * level
    else:
        if level > 0:
            # camera rays take the sky at the centre of their tile, so that a tile of sky alone has
            # no noise
            way_out = dr.select(first, fixed.centre, path.ray.d)
            row = fixed.row_of_sky(path)
            shine = dome.light(fixed.tables.spectra, path.place, row, way_out, level > 0)
            for k in range(fixed.packets):
                total[sky][k] += path.beta[k] * shine[k] * level
    return total


@dr.syntax
def add_lamp(fixed: Fixed, path: Path, total: Light, met: Met) -> Light:
    """Return `total` with the light added of the lamp that the ray hits after the first surface.

    Parameters
    ----------
    fixed, path, total, met : as in `add_sky`.
    """
    lamps = fixed.tables.lamps
    spectra = fixed.tables.spectra
    lamp = lamps.lamp_at(met.shape, met.hit & (path.depth > 0))
    cos_lamp = -dr.dot(path.ray.d, met.si.n)
    shines = (lamp != lamps.none) & (cos_lamp > 0)
    if shines:
        level = lamps.luminance(lamp, -path.ray.d, shines)
        distance2 = dr.square(met.si.t)
        rival = lamps.rival(lamp, path.cell, path.from_first, distance2, cos_lamp, shines)
        density = path.bsdf_density
        level *= dr.select(path.specular, 1, density / (density + rival))
        mine = dr.gather(mi.UInt32, lamps.group, lamp, shines)
        row = dr.gather(mi.UInt32, lamps.row, lamp, shines)
        light = spectra.at(path.place, spectra.lights + row, shines)
        for g in fixed.with_lamps:
            for k in range(fixed.packets):
                total[g][k] += dr.select(
                    (mine == g) & fixed.wanted[g], path.beta[k] * light[k] * level, 0
                )
    return total

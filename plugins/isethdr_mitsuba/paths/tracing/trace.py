"""Trace: the loop that follows paths from surface to surface, recorded by Dr.Jit and compiled.

One iteration of the loop is one segment of a path. The ray hits a surface or the sky, and the light
of the sky or of a lamp that it hits is added. Shadow rays add the light of lamps and of the sky
through openings. The surface scatters the path in a new direction.

Conditions on arrays of Dr.Jit hold for some lanes and not for others. Functions with such
conditions are marked `dr.syntax`, and return the arguments that they change. Other functions change
their arguments in place.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from .airlight import cross_fog
from .lanes import Fixed, numbers_of, path_before_the_first, queue_of
from .launch_tables import Items, Light, Tables
from .light_met import add_lamp, add_sky
from .segments import follow_camera_ray, go_on, meet, next_path, paint
from .shadow_rays import add_chosen_lamps, add_near_lamps, add_sky_through_openings


@dr.syntax
def traced(
    tables: Tables, seed: Any, items: Items, entries: int, weights: Light, max_depth: int
) -> tuple[Light, Light]:
    """Return the light of all work items: `radiance` and `batches` of `Launch`.

    Parameters
    ----------
    tables : the scene.
    seed : seed of the random numbers, on the device.
    items : work items.
    entries : number of tiles that the items belong to.
    weights : weights of X, Y and Z over the bands, in packets.
    max_depth : largest number of segments of a path.
    """
    fixed = Fixed(tables, items, max_depth)
    numbers = numbers_of(fixed, seed)
    path = path_before_the_first(fixed)
    queue = queue_of(items)
    total = [[mi.Spectrum(0) for _ in range(fixed.packets)] for _ in range(fixed.groups)]
    while queue.left > 0:
        if ~path.going & (queue.shares == 0):
            follow_camera_ray(fixed, path, numbers, queue)
        met = meet(fixed, path)
        if dr.hint(tables.fog is not None, mode="scalar"):
            path, numbers, total = cross_fog(fixed, path, numbers, total, met, queue)
        if dr.hint(fixed.sky >= 0, mode="scalar"):
            total = add_sky(fixed, path, total, met, queue)
        if dr.hint(len(fixed.with_lamps) > 0, mode="scalar"):
            total = add_lamp(fixed, path, total, met)
        path, numbers, queue, met = next_path(fixed, path, numbers, queue, met)
        paint(fixed, path, met)
        lit = met.active & tables.surfaces.is_smooth(met.material, met.active)
        path, numbers, total = add_chosen_lamps(fixed, path, numbers, total, met, lit)
        numbers, total = add_near_lamps(fixed, path, numbers, total, met, lit)
        if dr.hint(fixed.openings is not None, mode="scalar"):
            numbers, total = add_sky_through_openings(fixed, path, numbers, total, met, lit)
        path, numbers = go_on(fixed, path, numbers, met)
    return by_tile(fixed, total, entries), by_weight(total, weights)


def by_tile(fixed: Fixed, total: Light, entries: int) -> Light:
    """Return [group][band] arrays (entry,) of light, summed over the work items of each tile.

    Parameters
    ----------
    fixed : constants of the loop.
    total : light of each work item, in packets.
    entries : number of tiles.
    """
    out = [[dr.zeros(mi.Float, entries) for _ in range(4 * fixed.packets)] for _ in total]
    for sums, packets in zip(out, total, strict=True):
        for k, packet in enumerate(packets):
            for i in range(4):
                dr.scatter_reduce(
                    dr.ReduceOp.Add,
                    sums[4 * k + i],
                    packet[i],
                    fixed.items.owner,
                    mode=dr.ReduceMode.Local,
                )
    return out


def by_weight(total: Light, weights: Light) -> Light:
    """Return [group][weight] arrays (item,) of sums over the bands, weighted for X, Y and Z.

    Parameters
    ----------
    total : light of each work item, in packets.
    weights : weights of X, Y and Z over the bands, in packets.
    """
    return [
        [sum(dr.dot(*pair) for pair in zip(packets, one, strict=True)) for one in weights]
        for packets in total
    ]

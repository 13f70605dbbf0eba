"""Shadow rays: the light of lamps, and of the sky through openings, that falls on a surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ..camera_rays import CHOICE, DEEPER, TURN

if TYPE_CHECKING:
    from .lanes import Fixed, Met, Numbers, Path
    from .launch_tables import Light, Tables


class Vertex(NamedTuple):
    """A point of a path on a surface."""

    si: mi.SurfaceInteraction3f
    material: mi.UInt32
    place: mi.UInt32  # wavelength sample in each band
    colour: list  # packets: reflectance
    beta: list  # packets: weight of the path up to here


def vertex_of(path: Path, met: Met) -> Vertex:
    """Return the point of a path on the surface that it meets."""
    return Vertex(met.si, met.material, path.place, met.colour, path.beta)


@dr.syntax
def add_chosen_lamps(
    fixed: Fixed, path: Path, numbers: Numbers, total: Light, met: Met, lit: Any
) -> tuple[Path, Numbers, Light]:
    """Return `path`, `numbers` and `total` after one shadow ray for each light group, to one of
    its lamps.

    Parameters
    ----------
    fixed : constants of the loop.
    path : path at the surface.
    numbers : random numbers.
    total : light of the work items so far.
    met : hit of the surface.
    lit : lanes with a surface that a lamp may light.
    """
    lamps = fixed.tables.lamps
    first = path.depth == 0
    path.cell = dr.select(first, fixed.block, lamps.chances.cell(met.si.p))
    path.from_first = mi.Bool(first)
    for g in fixed.with_lamps:
        if lit & fixed.wanted[g]:
            # lanes take turns in the sequence of lamps too, at each depth from another start
            start = numbers.lamps + mi.Point2u(path.depth * DEEPER, path.depth * DEEPER)
            tries = lamps.candidates(g, first)
            aimed = lamps.choose(g, numbers.of_groups[g], met.si, path.cell, tries, start, lit)
            found = light_of(fixed.tables, vertex_of(path, met), aimed)
            for k in range(fixed.packets):
                total[g][k] += found[k]
    taken = dr.select(first, fixed.items.lanes, 0)
    numbers.lamps += mi.Point2u(taken * TURN, taken * CHOICE)
    return path, numbers, total


@dr.syntax
def add_near_lamps(
    fixed: Fixed, path: Path, numbers: Numbers, total: Light, met: Met, lit: Any
) -> tuple[Numbers, Light]:
    """Return `numbers` and `total` after one shadow ray to each near lamp, at the first surface of
    a path.

    Parameters
    ----------
    fixed, path, numbers, total, met, lit : as in `add_chosen_lamps`.
    """
    lamps = fixed.tables.lamps
    for g in fixed.with_lamps:
        turn = mi.UInt32(0)
        near = lit & fixed.wanted[g] & (path.depth == 0)
        count = dr.select(near, lamps.near_count(g, fixed.block, near), 0)
        while turn < count:
            aimed = lamps.near_point(g, turn, numbers.of_groups[g], met.si, fixed.block, near)
            found = light_of(fixed.tables, vertex_of(path, met), aimed)
            for k in range(fixed.packets):
                total[g][k] += found[k]
            turn += 1
    return numbers, total


@dr.syntax
def add_sky_through_openings(
    fixed: Fixed, path: Path, numbers: Numbers, total: Light, met: Met, lit: Any
) -> tuple[Numbers, Light]:
    """Return `numbers` and `total` after a shadow ray through an opening.

    Parameters
    ----------
    fixed, path, numbers, total, met, lit : as in `add_chosen_lamps`.
    """
    sky = fixed.sky
    if lit & fixed.wanted[sky]:
        found = sky_through(fixed, vertex_of(path, met), numbers.of_groups[sky], lit)
        for k in range(fixed.packets):
            total[sky][k] += found[k]
    return numbers, total


def light_of(tables: Tables, vertex: Vertex, aimed: tuple[Any, ...]) -> list[Any]:
    """Return the light that a shadow ray finds, as a list of packets. It is weighted against paths
    that hit the lamp by their own rays (balance heuristic: Veach and Guibas 1995).

    Parameters
    ----------
    tables : scene on the device.
    vertex : point that the ray starts from.
    aimed : target of the ray, as `LampTables.choose` returns it.
    """
    source, target, towards, level, density = aimed
    si = vertex.si
    spectra = tables.spectra
    open_way = level > 0
    open_way &= ~tables.scene.ray_test(si.spawn_ray_to(target), open_way)
    local = si.to_local(towards)
    value, rival = tables.surfaces.towards(vertex.material, si, local, open_way)
    level = level * dr.select(open_way, density / (density + rival), 0)
    light = spectra.at(vertex.place, spectra.lights + source, open_way)
    if tables.fog is not None:
        left = tables.fog.transmission(dr.norm(target - si.p))
        light = [one * share for one, share in zip(light, left)]
    return [
        dr.select(open_way, b * dr.lerp(value[0], value[1], c) * one * level, 0)
        for b, c, one in zip(vertex.beta, vertex.colour, light)
    ]


def sky_through(fixed: Fixed, vertex: Vertex, rng: Any, active: Any) -> list[Any]:
    """Return the light of the sky that one shadow ray through an opening finds, as a list of
    packets. It is weighted against paths that leave through the opening by their own rays.

    Parameters
    ----------
    fixed : constants of the loop.
    vertex : point that the ray starts from.
    rng : random numbers.
    active : lanes that take part.
    """
    tables = fixed.tables
    row = fixed.sky_row
    si = vertex.si
    towards, density = fixed.openings.aim(rng, si.p, active)
    open_way = active & (density > 0)
    open_way &= ~tables.scene.ray_test(si.spawn_ray(towards), open_way)
    value, rival = tables.surfaces.towards(vertex.material, si, si.to_local(towards), open_way)
    level = dr.select(open_way, 1 / (density + rival), 0)
    dome = tables.lamps.dome
    if dome is None:
        light = tables.spectra.at(vertex.place, row, open_way)
    else:
        light = dome.light(tables.spectra, vertex.place, row, towards, open_way)
    return [
        dr.select(open_way, b * dr.lerp(value[0], value[1], c) * one * level, 0)
        for b, c, one in zip(vertex.beta, vertex.colour, light)
    ]

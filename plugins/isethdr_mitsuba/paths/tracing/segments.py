"""Segments of a path: start at the camera, hit of the ray, end or continuation of the path."""

from __future__ import annotations

from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi

from ..camera_rays import ACROSS, ALONG, ASIDE, DOWN, UP, share
from .lanes import Met

if TYPE_CHECKING:
    from .lanes import Fixed, Numbers, Path, Queue


def follow_camera_ray(fixed: Fixed, path: Path, numbers: Numbers, queue: Queue) -> None:
    """Begin the next path at the camera.

    Parameters
    ----------
    fixed : constants of the loop.
    path : path of the lane, changed in place.
    numbers : random numbers, changed in place.
    queue : paths to follow, changed in place: how many share the camera ray.
    """
    items = fixed.items
    path.ray = fixed.tables.camera.ray(items.row, items.column, numbers.point, fixed.ramp)
    numbers.point += mi.Point2u(items.lanes * ACROSS, items.lanes * DOWN)
    path.place = fixed.tables.spectra.place(numbers.along)
    numbers.along += items.lanes * ALONG
    queue.shares = dr.minimum(items.shares, queue.left)
    path.restart(fixed.packets)
    path.bsdf_density = mi.Float(1)
    path.specular = mi.Bool(True)
    path.going = mi.Bool(True)


def meet(fixed: Fixed, path: Path) -> Met:
    """Return the hit of the ray of a path."""
    tables = fixed.tables
    si, shape = tables.hits.meet(tables.scene, path.ray, path.going)
    hit = path.going & si.is_valid()
    material = tables.surfaces.material_at(shape, hit)
    row = dr.select(hit, material, fixed.row_of_sky(path))
    return Met(
        si=si,
        shape=shape,
        hit=hit,
        escapes=path.going & ~hit,
        material=material,
        colour=tables.spectra.at(path.place, row, path.going),
        active=hit & (path.depth + 1 < fixed.max_depth),
    )


@dr.syntax
def next_path(
    fixed: Fixed, path: Path, numbers: Numbers, queue: Queue, met: Met
) -> tuple[Path, Numbers, Queue, Met]:
    """Return `path`, `numbers`, `queue` and `met` after paths that end here. If other paths share
    the first surface of an ended path, its lane begins the next of them there.

    Parameters
    ----------
    fixed : constants of the loop.
    path : path that may end here.
    numbers : random numbers.
    queue : paths that share the camera ray.
    met : hit of the ray.
    """
    spectra = fixed.tables.spectra
    fog = fixed.tables.fog
    begun = path.going & (path.depth == 0)
    # copies, because Dr.Jit would change both of two variables that are one object
    if begun & met.active:
        queue.si = dr.copy(met.si)
        queue.material = dr.copy(met.material)
    ended = dr.select(met.active, 0, dr.select(begun, queue.shares, 1))
    queue.shares -= ended
    queue.left -= ended
    again = ~met.active & (queue.shares > 0)
    if again:
        met.si = dr.copy(queue.si)
        met.material = dr.copy(queue.material)
        path.place = spectra.place(numbers.along)
        numbers.along += fixed.items.lanes * ALONG
        met.colour = spectra.at(path.place, met.material, again)
        path.restart(fixed.packets)
    if dr.hint(fog is not None, mode="scalar"):
        # as on the first of these paths: the fog may end before the surface
        origin = mi.Point3f(fixed.tables.camera.origin)
        border = fog.to_border(origin, (queue.si.p - origin) / queue.si.t)
        left_after = fog.transmission(dr.minimum(queue.si.t, border))
        for k in range(fixed.packets):
            path.beta[k] = dr.select(again, left_after[k], path.beta[k])
    met.active |= again
    return path, numbers, queue, met


def paint(fixed: Fixed, path: Path, met: Met) -> None:
    """Mix the reflectance of a surface with the second reflectance of its texture.

    Parameters
    ----------
    fixed : constants of the loop.
    path : path at the surface.
    met : hit of the surface, changed in place.
    """
    tables = fixed.tables
    if not tables.surfaces.textures.any:
        return
    second, part = tables.surfaces.textures.share(met.material, met.si.p, met.active)
    other = tables.spectra.at(path.place, second, met.active & (part > 0))
    met.colour = [dr.lerp(one, two, part) for one, two in zip(met.colour, other, strict=True)]


@dr.syntax
def go_on(fixed: Fixed, path: Path, numbers: Numbers, met: Met) -> tuple[Path, Numbers]:
    """Return the path and the numbers after the surface has scattered the path in a new direction.

    Parameters
    ----------
    fixed : constants of the loop.
    path : path that has reached a surface.
    numbers : random numbers.
    met : hit of the surface.
    """
    surfaces = fixed.tables.surfaces
    strongest = mi.Float(0)
    if met.active:
        pick = numbers.of_path.next_float32()
        spot = mi.Point2f(numbers.of_path.next_float32(), numbers.of_path.next_float32())
        if path.depth == 0:
            spot = share(numbers.way)
            numbers.way += mi.Point2u(fixed.items.lanes * ASIDE, fixed.items.lanes * UP)
        sampled, factor = surfaces.onwards(met.material, met.si, pick, spot, met.active)
        for k in range(fixed.packets):
            path.beta[k] *= dr.lerp(factor[0], factor[1], met.colour[k])
            strongest = dr.maximum(strongest, dr.max(path.beta[k]))
        path.ray = met.si.spawn_ray(met.si.to_world(sampled.wo))
        path.ray.wavelengths = fixed.ramp
        path.bsdf_density = sampled.pdf
        path.specular = mi.has_flag(sampled.sampled_type, mi.BSDFFlags.Delta)
        if dr.hint(path.straight is not None, mode="scalar"):
            path.straight = ((path.depth == 0) | path.straight) & path.specular
        path.depth += 1
    path.going = strongest > 0
    return path, numbers

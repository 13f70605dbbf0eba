"""Ghosts by random photons, independent of the plugin's ray trace except for the numbers of the
prescription.

Parallel light falls on the front at random points, and every pair of surfaces is traced separately.
Intersections with spheres are computed from their centres. At uncoated surfaces, light is split by
Fresnel's formulas in sines and tangents of the angles (1823).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import qmc

if TYPE_CHECKING:
    from collections.abc import Sequence

    from isethdr_core.plugins.protocols import Lens

# radius of the start disc over that of the first surface; oblique light crosses its plane displaced
MORE = 1.15


@dataclass(frozen=True)
class Photons:
    """Number of photons that are followed."""

    count: int  # per pair of surfaces and batch
    batches: int  # their spread gives the error
    seed: int = 0


def flux_by_chance(
    lens: Lens, tangent: float, wavelength_nm: float, edges_mm: np.ndarray, photons: Photons
) -> tuple[Any, Any]:
    """Return the light of all ghosts per area of a plane across the axis, and its standard error.

    Parameters
    ----------
    lens : `isethdr_optics.prescription.prescription.Prescription` of uncoated spheres; its last
        surface is the sensor, which does not reflect.
    tangent : tangent of the lamp's field angle, along x.
    wavelength_nm : wavelength of the light, nm.
    edges_mm : borders of the blocks on the sensor in which light is summed, the same along x and y.
    photons : number of photons, and their seed.

    Returns
    -------
    (y, x) mm2, power landed in each block over power per mm2 of that plane, and its standard error.
    """
    n = [float(v) for v in lens.indices(wavelength_nm)]
    radius = MORE * lens.surfaces[0].semi_diameter_mm
    pairs = [
        (front, back)
        for back in range(1, len(lens.surfaces) - 1)
        for front in range(back)
        if n[front] != n[front + 1] and n[back] != n[back + 1]
    ]
    sums = np.zeros((photons.batches, len(edges_mm) - 1, len(edges_mm) - 1))
    for batch in range(photons.batches):
        for front, back in pairs:
            start = scattered(photons.count, radius, seed=(photons.seed, batch, front, back))
            x, y, weight = landed(lens, n, start, tangent, front, back)
            sums[batch] += np.histogram2d(y, x, (edges_mm, edges_mm), weights=weight)[0]
    sums *= np.pi * radius**2 / photons.count
    return sums.mean(axis=0), sums.std(axis=0, ddof=1) / np.sqrt(photons.batches)


def scattered(count: int, radius: float, seed: Sequence[int]) -> np.ndarray:
    """Return (x, y) of points scattered evenly over a disc (Sobol 1967). The points are scrambled
    at random, so each seed gives an independent estimate.

    Parameters
    ----------
    count : number of points; a power of 2 is scattered most evenly.
    radius : radius of the disc, any unit of length.
    seed : seed of the scrambling, an integer or a tuple of integers.
    """
    first, second = qmc.Sobol(2, rng=np.random.default_rng(seed)).random(count).T
    return (
        radius * np.sqrt(first) * np.array([np.cos(2 * np.pi * second), np.sin(2 * np.pi * second)])
    )


def landed(
    lens: Lens, n: Sequence[float], start: Any, tangent: float, front: int, back: int
) -> tuple[Any, Any, np.ndarray]:
    """Return x and y on the sensor, mm, and the weight of photons that are reflected at `back`,
    then at `front`. Photons that an aperture blocks are left out.

    Parameters
    ----------
    lens : prescription of uncoated spheres; its last surface is the sensor.
    n : refractive index before each surface, and behind the last.
    start : (2, photon) x and y at the vertex plane of the first surface, mm.
    tangent : tangent of the field angle of the light, along x.
    front, back : numbers of the two surfaces that reflect, from 0; the light meets `back` first.
    """
    surfaces = lens.surfaces
    last = len(lens.surfaces) - 1
    at = np.stack([*start, np.full(start.shape[1], surfaces[0].z_mm)], axis=1)
    direction = np.tile(np.array([tangent, 0.0, 1.0]) / np.hypot(1.0, tangent), (len(at), 1))
    weight = np.ones(len(at))
    forth = range(back + 1)
    back_again = range(back - 1, front - 1, -1)
    on = range(front + 1, last)
    for leg, steps in enumerate((forth, back_again, on)):
        # light comes from the medium in front of the surface (0) or behind it (1)
        n_before = 0 if leg != 1 else 1
        for k in steps:
            surface = surfaces[k]
            turns = k == (back, front, -1)[leg]
            at, normal = met(surface, at, direction)
            # a ray that misses the surface is NaN and is dropped here
            passing = np.hypot(at[:, 0], at[:, 1]) <= surface.semi_diameter_mm
            at = at[passing]
            direction = direction[passing]
            normal = normal[passing]
            weight = weight[passing]
            cosine = (direction * normal).sum(axis=1)
            normal = normal * np.sign(cosine)[:, None]
            cosine = np.minimum(np.abs(cosine), 1.0)
            n1 = n[k + n_before]
            n2 = n[k + 1 - n_before]
            if n1 == n2:
                continue
            reflected, bent = fresnel(cosine, n1, n2)
            if turns:
                weight = weight * reflected
                direction = direction - 2 * cosine[:, None] * normal
            else:
                weight = weight * (1 - reflected)
                direction = (direction - cosine[:, None] * normal) * (n1 / n2) + bent[
                    :, None
                ] * normal
                passing = bent > 0
                at = at[passing]
                direction = direction[passing]
                weight = weight[passing]
    step = (surfaces[last].z_mm - at[:, 2]) / direction[:, 2]
    return at[:, 0] + step * direction[:, 0], at[:, 1] + step * direction[:, 1], weight


def met(surface: Any, at: Any, direction: np.ndarray) -> Any:
    """Return the points where rays meet a sphere or plane, and its normals there. Both are NaN for
    rays that miss.

    Parameters
    ----------
    surface : sphere or plane, with its vertex and its curvature.
    at : (ray, 3) points on the rays, mm.
    direction : (ray, 3) unit directions of the rays.
    """
    if surface.curvature_per_mm == 0:
        step = (surface.z_mm - at[:, 2]) / direction[:, 2]
        return at + step[:, None] * direction, np.broadcast_to([0.0, 0.0, 1.0], at.shape)
    centre = np.array([0.0, 0.0, surface.z_mm + 1 / surface.curvature_per_mm])
    to = at - centre
    along = (to * direction).sum(axis=1)
    with np.errstate(invalid="ignore"):
        root = np.sqrt(along**2 - (to**2).sum(axis=1) + surface.curvature_per_mm**-2)
    near, far_side = (at + (sign * root - along)[:, None] * direction for sign in (-1, 1))
    # of the two intersections, the one on the vertex's side is right
    first = np.abs(near[:, 2] - surface.z_mm) < np.abs(far_side[:, 2] - surface.z_mm)
    hit = np.where(first[:, None], near, far_side)
    return hit, (hit - centre) * surface.curvature_per_mm


def fresnel(cosine: np.ndarray, n_from: float, n_to: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the reflectance of unpolarised light, and the cosine behind the surface, which is 0
    for total reflection.

    Parameters
    ----------
    cosine : (ray,) cosine of the angle of incidence, 0 to 1.
    n_from, n_to : refractive index before and behind the surface.
    """
    first = np.arccos(np.minimum(cosine, 1 - 1e-14))  # at normal incidence, the ratio is 0 / 0
    sine = n_from / n_to * np.sin(first)
    second = np.arcsin(np.minimum(sine, 1.0))
    across = np.sin(first - second) / np.sin(first + second)
    along = np.tan(first - second) / np.tan(first + second)
    return np.where(sine < 1, (across**2 + along**2) / 2, 1.0), np.where(
        sine < 1, np.cos(second), 0.0
    )

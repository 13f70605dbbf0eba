"""Point spreads of a prescription by a direct sum over traced rays: the independent check of the
lens `prescription`.

Nothing here uses the pupil, the Zernike fits or the transforms of the package. Rays meet spheres in
closed form and are refracted by the vector form of Snell's law. Complex amplitudes of rays are
added at every image position.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Fan(NamedTuple):
    """A grid (n, n) of rays of one field point behind the last surface; lengths in mm."""

    direction: np.ndarray  # (3, n, n), unit vectors in image space
    position: np.ndarray  # (3, n, n), on the sensor plane
    path_mm: np.ndarray  # optical path from a wave front of the incoming light to the sensor plane
    inside: np.ndarray  # share of each ray's cell that passes the stop and all rims, 0 to 1
    cell_mm2: float  # area of the cells, across the axis, in which the rays enter


class Spread(NamedTuple):
    """Samples (y, x) of a point spread function, share of the light per um2, and their
    positions."""

    density: np.ndarray
    x_um: np.ndarray
    y_um: np.ndarray


def traced(lens, tangent: float, wavelength_nm: float, count: int, half_mm: float) -> Fan:
    """Trace a square grid of `count` x `count` rays, `2 half_mm` wide, from a field point on +x.

    The grid is centred on the ray through the middle of the stop.
    """
    centre = _chief_mm(lens, tangent, wavelength_nm)
    cell = 2 * half_mm / count
    across = (np.arange(count) + 0.5) * cell - half_mm
    x, y = np.meshgrid(centre + across, across)
    direction, position, path, margin = _followed(lens, tangent, wavelength_nm, x, y)
    slope = np.abs(np.gradient(margin, axis=0)) + np.abs(np.gradient(margin, axis=1))
    inside = np.clip(0.5 + margin / np.maximum(slope, 1e-12), 0.0, 1.0)
    return Fan(direction, position, path, inside, cell**2)


def _chief_mm(lens, tangent, wavelength_nm):
    """Return x, mm, in the plane of the first vertex of the ray through the middle of the stop.

    A search over the plane is refined in steps.
    """
    reach = lens.focal_length_mm() * (0.2 + abs(tangent))
    trial = np.linspace(-reach, reach, 4001)
    for _ in range(4):
        height = np.abs(_stop_height_mm(lens, tangent, wavelength_nm, trial))
        best = int(np.nanargmin(height))
        step = trial[1] - trial[0]
        trial = np.linspace(trial[best] - step, trial[best] + step, 201)
    return float(trial[100])


def _stop_height_mm(lens, tangent, wavelength_nm, x):
    """Return the heights, mm, of meridional rays in the stop; NaN for rays that miss a surface."""
    state = _launched(lens, tangent, x, 0 * x)
    passed = np.full(x.shape, True)
    for surface, before, behind in list(_steps(lens, wavelength_nm))[: lens.stop + 1]:
        state = _through(surface, before, behind, *state)
        passed &= np.abs(state[0][0]) <= surface.semi_diameter_mm
    return np.where(passed, state[0][0], np.nan)


def _launched(lens, tangent, x, y):
    """Return position, direction and optical path of collimated light in the plane of the first
    vertex, where it crosses at (x, y), mm.
    """
    length = np.sqrt(1 + tangent**2)
    direction = np.stack([np.full(x.shape, tangent / length), 0 * x, np.full(x.shape, 1 / length)])
    position = np.stack([x, y, np.full(x.shape, lens.surfaces[0].z_mm)])
    return position, direction, np.sum(position * direction, axis=0)


def _steps(lens, wavelength_nm):
    indices = lens.indices(wavelength_nm)
    return zip(lens.surfaces, indices[:-1], indices[1:])


def _through(surface, before, behind, position, direction, path):
    """Return position, direction and path behind one spherical or plane surface."""
    if surface.conic or surface.aspheric:
        raise NotImplementedError("this direct sum knows spheres and planes alone")
    px = position[0]
    py = position[1]
    pz = position[2] - surface.z_mm
    dx, dy, dz = direction
    c = surface.curvature_per_mm
    # c (p + s d)^2 - 2 (p + s d)_z = 0: the root on the vertex side, in the form without
    # cancellation
    b = dz - c * (px * dx + py * dy + pz * dz)
    k = c * (px**2 + py**2 + pz**2) - 2 * pz
    with np.errstate(invalid="ignore", divide="ignore"):
        s = k / (b + np.sqrt(b**2 - c * k))
    hit = position + s * direction
    normal = np.stack([-c * hit[0], -c * hit[1], 1 - c * (hit[2] - surface.z_mm)])
    ratio = before / behind
    cosine = np.sum(normal * direction, axis=0)
    with np.errstate(invalid="ignore"):
        turn = np.sqrt(1 - ratio**2 * (1 - cosine**2)) - ratio * cosine
    return hit, ratio * direction + turn * normal, path + before * s


def _followed(lens, tangent, wavelength_nm, x, y):
    state = _launched(lens, tangent, x, y)
    margin = np.full(x.shape, np.inf)
    for surface, before, behind in _steps(lens, wavelength_nm):
        state = _through(surface, before, behind, *state)
        if np.isfinite(surface.semi_diameter_mm):
            margin = np.fmin(margin, surface.semi_diameter_mm - np.hypot(*state[0][:2]))
    position, direction, path = state
    lost = ~np.isfinite(path) | ~np.isfinite(direction[0])
    return direction, position, path, np.where(lost, -1.0, margin)


def chief_mm(lens, tangent: float, wavelength_nm: float) -> float:
    """Return x, mm, on the sensor of the ray through the middle of the stop."""
    x = np.array([_chief_mm(lens, tangent, wavelength_nm)])
    return float(_followed(lens, tangent, wavelength_nm, x, 0 * x)[1][0, 0])


def exit_sphere_mm(lens, chief: float, wavelength_nm: float) -> float:
    """Return the radius, mm, of the sphere about an image point, through the centre of the exit
    pupil.

    A ray through the middle of the stop, close to the axis and continued backwards, crosses the
    axis in the centre of the exit pupil.
    """
    near = 1e-4
    x = np.array([_chief_mm(lens, near, wavelength_nm)])
    direction, position, _, _ = _followed(lens, near, wavelength_nm, x, 0 * x)
    return float(np.hypot(position[0, 0] * direction[2, 0] / direction[0, 0], chief))


def direct_sum(
    fan: Fan, chief: float, radius_mm: float, wavelength_nm: float, x_um, y_um
) -> Spread:
    """Add one spherical wave per ray (Huygens).

    Each wave starts where the ray crosses a sphere of `radius_mm` about the image of the chief ray.
    The intensity at (x, y) is the squared modulus of the sum. Each amplitude is the square root of
    the ray's power times the area of its cell on the sphere, seen along the axis. The integral of
    the intensity over the sensor is wavelength^2 x the power (Parseval).
    """
    away = fan.position - np.array([chief, 0.0, 0.0])[:, None, None]
    away[2] = 0.0
    along = np.sum(away * fan.direction, axis=0)
    back = -along - np.sqrt(along**2 - np.sum(away**2, axis=0) + radius_mm**2)
    source = away + back * fan.direction
    weight = fan.inside * np.sqrt(np.abs(_jacobian(source[0], source[1]))) / radius_mm
    used = (fan.inside > 0) & np.isfinite(weight)
    wave_mm = wavelength_nm * 1e-6
    path = (fan.path_mm + back)[used]
    sources = source[:, used]
    weight = weight[used]
    field = np.empty((len(y_um), len(x_um)), complex)
    for row, y in enumerate(1e-3 * np.asarray(y_um)):
        for column, x in enumerate(1e-3 * np.asarray(x_um)):
            length = np.sqrt((sources[0] - x) ** 2 + (sources[1] - y) ** 2 + sources[2] ** 2)
            turns = (path + length - path.mean() - radius_mm) / wave_mm
            field[row, column] = np.dot(weight, np.exp(2j * np.pi * turns))
    density = np.abs(field) ** 2 / (fan.inside.sum() * wave_mm**2) * 1e-6
    return Spread(density, np.asarray(x_um, float), np.asarray(y_um, float))


def _jacobian(first, second):
    return np.gradient(first, axis=1) * np.gradient(second, axis=0) - np.gradient(
        first, axis=0
    ) * np.gradient(second, axis=1)

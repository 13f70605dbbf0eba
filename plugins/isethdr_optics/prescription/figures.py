"""Figures of a lens from exact rays: chief rays, distortion, working f-number, relative
illumination, focal length.

Directions are tangents in the orientation of the image: light from +x is traced towards +x. A lamp
at the tangent t is imaged near + focal length x t. This is the image of a real lens rotated by 180
degrees.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics import paraxial
from isethdr_core.physics.optics.ray_trace import Start, collimated, follow, sequential

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from isethdr_core.physics.optics.ray_trace import Rays

    from .prescription import Prescription

AIM_MM = 1e-12  # largest error of the aim of chief rays, radii of the stop
GRID = 160  # number of rays along each side of a square, for areas
SPOT_GRID = 200  # number of rays across a beam; rms spots are accurate to 5e-4
REACH = 1.5  # half side of that square around the entrance pupil, radii of the pupil
# largest distance of the chief ray from the paraxial entrance pupil's middle, radii of the pupil,
# for which that middle is the middle of the square. Pupil aberrations exceed it with slow stops.
AIMED = 0.3
SEARCH_GRID = 40  # number of rays along each side of that square, to find the beam


def chief_mm(lens: Prescription, tangent: float | np.ndarray, wavelength_nm: float) -> np.ndarray:
    """Return the heights at which chief rays, through the middle of the stop, meet the sensor, mm.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangents of field angles along +x, a number or an array.
    wavelength_nm : wavelength, nm.

    Raises
    ------
    ConfigError : no ray of some direction passes through the middle of the stop.
    """
    tangent = np.atleast_1d(np.asarray(tangent, float))
    return _aimed(lens, tangent, wavelength_nm, 0.0).position_mm[0]


class ChiefRays(NamedTuple):
    """Chief rays, through the middle of the stop, where they meet the sensor."""

    height_mm: np.ndarray  # distance from the axis
    angle_deg: np.ndarray  # angle to the sensor's normal; positive away from the axis


def chief_rays(lens: Prescription, tangent: np.ndarray) -> ChiefRays:
    """Return the chief rays of the reference wavelength.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangents of field angles along +x, an array.

    Raises
    ------
    ConfigError : as in `chief_mm`.
    """
    rays = _aimed(lens, tangent, lens.reference_nm, 0.0)
    angle_deg = np.degrees(np.arctan2(rays.direction[0], rays.direction[2]))
    return ChiefRays(rays.position_mm[0], angle_deg)


def _aimed(
    lens: Prescription,
    tangent: float | np.ndarray,
    wavelength_nm: float,
    relative_height: float,
) -> Rays:
    """Return meridional rays, along x, that meet the stop at `relative_height` times its radius.
    They are aimed by the secant method.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangents of field angles along +x.
    wavelength_nm : wavelength, nm.
    relative_height : height on the stop, radii of the stop.
    """
    x, missed_mm = _aim(lens, tangent, wavelength_nm, relative_height)
    start = collimated(x, 0 * x, lens.surfaces[0].z_mm, tangent, 0 * tangent)
    indices = lens.indices(wavelength_nm)
    rays = follow(lens.surfaces, indices, sequential(len(lens.surfaces)), start)
    missed = ~_hits(lens, missed_mm) | ~np.isfinite(rays.position_mm[0])
    if missed.any():
        angle = np.degrees(np.arctan(np.abs(tangent[missed]).min()))
        raise ConfigError(
            f"prescription {lens.name!r}: rays {angle:.1f} degrees off the axis miss a surface on"
            f" their way through the stop; expected a field within its {lens.half_field_deg:g}"
            " degrees; type a smaller scene.horizontal_field_deg"
        )
    return rays


def _hits(lens: Prescription, missed_mm: np.ndarray) -> np.ndarray:
    """Return whether rays that miss their aim on the stop by `missed_mm` count as aimed."""
    return np.abs(missed_mm) < 1e3 * AIM_MM * lens.surfaces[lens.stop].semi_diameter_mm


def _aim(
    lens: Prescription, tangent: np.ndarray, wavelength_nm: float, relative_height: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return (positions along x in the plane of the front vertex, distances from the aim on the
    stop) of rays, mm. The distance is NaN or large where no ray was found.

    Parameters
    ----------
    lens, tangent, wavelength_nm, relative_height : as in `_aimed`.
    """
    indices = lens.indices(wavelength_nm)
    front = lens.surfaces[0].z_mm
    optics = lens.surfaces[:-1]
    pupil_z, pupil_radius = paraxial.entrance_pupil(optics, indices)
    to_stop = sequential(lens.stop + 1)
    stop_height_mm = relative_height * lens.surfaces[lens.stop].semi_diameter_mm
    scale = lens.surfaces[lens.stop].semi_diameter_mm

    def miss(x: np.ndarray) -> np.ndarray:
        start = collimated(x, 0 * x, front, tangent, 0 * tangent)
        return follow(lens.surfaces, indices, to_stop, start).position_mm[0] - stop_height_mm

    upright = np.sign(paraxial.matrices(optics, indices, to_stop, front)[-1][0, 0])
    x0 = (front - pupil_z) * tangent + upright * relative_height * pupil_radius
    # the pupil moves off the axis: first guesses that miss a surface are shifted towards the axis
    for shrink in (1.0, 0.8, 0.6, 0.4, 0.2, 0.0):
        x0 = np.where(np.isfinite(miss(x0)), x0, shrink * (front - pupil_z) * tangent)
    x1 = x0 + 1e-4 * scale
    m0 = miss(x0)
    m1 = miss(x1)
    for _ in range(60):
        if np.all(np.abs(m1) < AIM_MM * scale):
            break
        with np.errstate(invalid="ignore", divide="ignore"):
            step = np.where(m1 == m0, 0.0, m1 * (x1 - x0) / (m1 - m0))
        x0 = x1
        m0 = m1
        x1 = x1 - np.clip(np.nan_to_num(step), -scale, scale)
        m1 = miss(x1)
    return x1, m1


def beam_middle_mm(
    lens: Prescription, tangent: float | np.ndarray, wavelength_nm: float
) -> np.ndarray:
    """Return the positions along x in the plane of the front vertex about which the beams of field
    points enter, (field point,) mm.

    This is the middle of the paraxial entrance pupil or, where the chief ray enters farther than
    `AIMED` from it, the chief ray.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangents of field angles along +x, a number or an array.
    wavelength_nm : wavelength, nm.
    """
    tangent = np.atleast_1d(np.asarray(tangent, float))
    optics = lens.surfaces[:-1]
    pupil_z, pupil_radius = paraxial.entrance_pupil(optics, lens.indices(wavelength_nm))
    paraxial_mm = (lens.surfaces[0].z_mm - pupil_z) * tangent
    chief_mm, missed_mm = _aim(lens, tangent, wavelength_nm, 0.0)
    far = _hits(lens, missed_mm) & (np.abs(chief_mm - paraxial_mm) > AIMED * pupil_radius)
    return np.where(far, chief_mm, paraxial_mm)


def distortion(
    lens: Prescription, tangent: ArrayLike, wavelength_nm: float | None = None
) -> np.ndarray:
    """Return the distortion (chief ray's height - f tan) / (f tan); 0 on the axis.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangents of field angles along +x, a number or an array.
    wavelength_nm : nm; None: the reference wavelength of the lens.
    """
    wave = wavelength_nm or lens.reference_nm
    tangent = np.atleast_1d(np.asarray(tangent, float))
    ideal = _sensor_scale_mm(lens, wave) * tangent
    height = chief_mm(lens, tangent, wave)
    return np.divide(height - ideal, ideal, out=np.zeros_like(ideal), where=tangent != 0)


def _sensor_scale_mm(lens: Prescription, wavelength_nm: float) -> float:
    """Return height / tangent of the paraxial chief ray, mm. If the sensor is in focus, it is the
    focal length.
    """
    indices = lens.indices(wavelength_nm)
    front = lens.surfaces[0].z_mm
    optics = lens.surfaces[:-1]
    pupil_z, _ = paraxial.entrance_pupil(optics, indices)
    system = paraxial.matrices(lens.surfaces, indices, sequential(len(lens.surfaces)), front)[-1]
    return float(system[0] @ [front - pupil_z, 1.0])


@lru_cache(maxsize=64)
def working_f_number(lens: Prescription, wavelength_nm: float | None = None) -> float:
    """Return the working f-number 1 / (2 sin u') of the traced marginal ray; u' is its angle to the
    axis at the sensor.
    """
    rays = _aimed(lens, np.zeros(1), wavelength_nm or lens.reference_nm, 1 - 1e-9)
    return float(1 / (2 * np.abs(rays.direction[0, 0])))


class Spot(NamedTuple):
    """The spot of one field point on the sensor; 0 and NaN if no ray passes the lens."""

    radius_mm: float  # rms distance of the rays from their centroid
    centroid_mm: float  # distance of the centroid from the axis, towards the field point's image


def spot(lens: Prescription, tangent: float) -> Spot:
    """Return the spot of a field point at the reference wavelength. Its parallel light fills the
    entrance beam uniformly.

    Parameters
    ----------
    lens : `Prescription`.
    tangent : tangent of the field angle.

    Notes
    -----
    A first, coarse grid finds the beam, which moves off the axis and is limited by rims. Cells that
    the border of the beam crosses count by the part inside, as in `pupil_area_mm2`.
    """
    indices = lens.indices(lens.reference_nm)
    front = lens.surfaces[0].z_mm
    _, pupil_radius = paraxial.entrance_pupil(lens.surfaces[:-1], indices)

    def traced(
        low: np.ndarray, high: np.ndarray, count: int
    ) -> tuple[np.ndarray, np.ndarray, Rays]:
        """Return cell centres along x and y (count), and rays (y, x) between two corners."""
        x, y = ((np.arange(count) + 0.5) / count * (b - a) + a for a, b in zip(low, high))
        start = collimated(*np.meshgrid(x, y), front, tangent, 0.0)
        return x, y, follow(lens.surfaces, indices, sequential(len(lens.surfaces)), start)

    middle = np.array([beam_middle_mm(lens, tangent, lens.reference_nm)[0], 0.0])
    half = REACH * pupil_radius
    x, y, rays = traced(middle - half, middle + half, SEARCH_GRID)
    through = rays.margin > 0
    if not through.any():
        return Spot(0.0, float("nan"))
    cell = 2 * half / SEARCH_GRID
    spans = [at[through.any(axis)] for axis, at in ((0, x), (1, y))]
    low, high = (np.array([f(span) for span in spans]) for f in (np.min, np.max))
    _, _, rays = traced(low - cell, high + cell, SPOT_GRID)
    weight = _inside(rays.margin)
    used = (weight > 0) & np.isfinite(rays.position_mm).all(axis=0)
    weight = weight[used] / weight[used].sum()
    position = rays.position_mm[:2, used]
    centroid = position @ weight
    away = position - centroid[:, None]
    return Spot(float(np.sqrt(np.sum(away**2 @ weight))), float(centroid[0]))


def pupil_area_mm2(
    lens: Prescription,
    tangent: ArrayLike,
    wavelength_nm: float | None = None,
    grid: int = GRID,
) -> np.ndarray:
    """Return the area, mm2, of the entrance beam that reaches the sensor, in a plane perpendicular
    to the axis, (field point,).

    Cells that the border of the beam crosses count by the part inside, to first order in the
    smallest margin along the ray.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangents of field angles along +x, a number or an array.
    wavelength_nm : nm; None: the reference wavelength of the lens.
    grid : rays along each side of a square around the entrance pupil.
    """
    wave = wavelength_nm or lens.reference_nm
    tangent = np.atleast_1d(np.asarray(tangent, float))
    indices = lens.indices(wave)
    _, pupil_radius = paraxial.entrance_pupil(lens.surfaces[:-1], indices)
    half = REACH * pupil_radius
    front = lens.surfaces[0].z_mm
    cells = (np.arange(grid) + 0.5) / grid * 2 - 1
    x, y = np.meshgrid(cells * half, cells * half)
    out = []
    for t, middle in zip(tangent, beam_middle_mm(lens, tangent, wave), strict=True):
        start = collimated(x + middle, y, front, t, 0.0)
        inside = _inside(
            follow(lens.surfaces, indices, sequential(len(lens.surfaces)), start).margin
        )
        out.append(float(np.sum(inside)) * (2 * half / grid) ** 2)
    return np.array(out)


def seen_sr(
    lens: Prescription,
    height_mm: float,
    wavelength_nm: float,
    grid: int = GRID,
    slope: float | None = None,
) -> float:
    """Return irradiance over radiance of a uniform scene at a point of the sensor, sr.

    Rays are traced from the sensor back through all rims into the scene. The irradiance is the
    radiance times the integral of cos over the solid angle of the rays that pass. No entrance
    pupil, chief ray or image size is used, so that coma and pupil aberrations are included as in a
    camera.

    Parameters
    ----------
    lens : `Prescription`.
    height_mm : distance of the point from the axis, mm.
    wavelength_nm : wavelength, nm.
    grid : rays along each side of the pupil.
    slope : slope of the chief ray at the point, positive away from the axis. The rays are aimed
        about it where it passes farther than `AIMED` from the middle of the paraxial exit pupil.
    """
    sensor = lens.surfaces[-1].z_mm
    optics = [
        replace(
            s,
            z_mm=sensor - s.z_mm,
            curvature_per_mm=-s.curvature_per_mm,
            aspheric=tuple(-a for a in s.aspheric),
            odd=tuple(-a for a in s.odd),
        )
        for s in lens.surfaces[-2::-1]
    ]
    indices = lens.indices(wavelength_nm)[-2::-1]
    pupil_z, pupil_radius = paraxial.entrance_pupil(optics, indices)
    z = max(optics[0].z_mm, 1e-3 * pupil_radius)
    half = REACH * pupil_radius * abs(z / pupil_z)
    cells = ((np.arange(grid) + 0.5) / grid * 2 - 1) * half
    # rays from the point on the sensor towards the exit pupil
    middle = -height_mm * z / pupil_z
    if slope is not None and abs(-slope * z - middle) > AIMED * half / REACH:
        middle = -slope * z
    x, y = np.meshgrid(cells + middle, cells)
    directions = np.stack([x, y, np.full(x.shape, z)])
    distance = np.sqrt(np.sum(directions**2, axis=0))
    position = np.stack([np.full(x.shape, height_mm), 0.0 * x, 0.0 * x])
    start = Start(position, directions / distance)
    inside = _inside(follow(optics, indices, sequential(len(optics)), start).margin)
    return float(np.sum(inside * (z / distance) ** 2 / distance**2)) * (2 * half / grid) ** 2


def _inside(margin: np.ndarray) -> np.ndarray:
    """Return the part (0 to 1) of every cell of a grid of rays that passes the lens, to first order
    in the smallest margin along the ray.

    It is 0 in cells around which no ray passes. Far outside the beam, margins change so much from
    cell to cell that the first order alone would find a border there.
    """
    margin = np.where(np.isfinite(margin), margin, -1.0)
    gy, gx = np.gradient(margin)
    passes = np.pad(margin > 0, 1)
    near_beam = np.lib.stride_tricks.sliding_window_view(passes, (3, 3)).any((2, 3))
    with np.errstate(invalid="ignore", divide="ignore"):
        part = np.nan_to_num(np.clip(0.5 + margin / (np.abs(gx) + np.abs(gy)), 0, 1))
    return np.where(near_beam, part, 0.0)


def relative_illumination(
    lens: Prescription, tangent: np.ndarray, wavelength_nm: float | None = None
) -> np.ndarray:
    """Return the irradiance of a uniform scene, over that on the axis.

    E = L dOmega cos A / dA' with the entrance area A, the solid angle dOmega = cos^3 d(tangent)^2,
    and the area dA' of the image of d(tangent)^2. It includes cos^4, vignetting, pupil aberration
    and distortion. Losses at surfaces are left out; they are small and uniform.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    tangent : tangents of field angles along +x, a number or an array.
    wavelength_nm : nm; None: the reference wavelength of the lens.
    """
    wave = wavelength_nm or lens.reference_nm
    tangent = np.abs(np.atleast_1d(np.asarray(tangent, float)))
    step = 1e-4 * max(1.0, float(tangent.max()))
    low = np.maximum(tangent - step, 0)
    high = tangent + step
    f = _sensor_scale_mm(lens, wave)
    radial = (chief_mm(lens, high, wave) - chief_mm(lens, low, wave)) / (f * (high - low))
    around = 1 + distortion(lens, np.maximum(tangent, step), wave)
    area = pupil_area_mm2(lens, np.concatenate([[0.0], tangent]), wave)
    return (1 + tangent**2) ** -2 * area[1:] / area[0] / (radial * around)

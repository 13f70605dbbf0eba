"""Ghost pairs of surfaces, ranked by paraxial matrices, and real rays of the strongest pairs.

All lengths are in mm. Light from the field tangent t travels towards +x (see
`prescription.figures`), so that ghosts have the orientation of the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics import glass, paraxial
from isethdr_core.physics.optics.ray_trace import Start, collimated, follow, ghost_path
from isethdr_core.physics.optics.surfaces import sag_mm

from ...prescription.coatings import Powers

if TYPE_CHECKING:
    from ...prescription.prescription import Prescription

# least number of rays across the front surface that find where a ghost's light enters. Narrow
# ghosts of slow stops take more, so that rays are at most half of the ghost's width apart.
SCAN = 36
MOST_RAYS = 2_000_000  # largest number of such rays that are traced at a time
# number of rays across the box where the light enters; even, so that half of them lie on either
# side of the meridional plane
NODES = 16
SPECTRAL = 4  # number of wavelengths at which rays are traced
FIELDS = 9  # number of field angles at which the paraxial beam is computed, to find the widest


@dataclass(frozen=True)
class Pair:
    """Two reflecting surfaces, and the paraxial figures of their ghost."""

    front: int  # index of the surface
    back: int  # index of the surface
    # light of the ghost over light of the image, the largest over the field. Each of both surfaces
    # counts with its largest reflectance over the bands.
    share: float
    radius_mm: float  # radius of the spot on the sensor, for a distant lamp on the axis
    focus_mm: float  # distance of the ghost's focus behind the sensor
    # position of the ghost over that of the lamp's image: -1 is as far from the axis, on the other
    # side
    magnification: float


def rank(powers: Powers, largest_tangent: float) -> list[Pair]:
    """Return all pairs of reflecting surfaces of the lens of `powers`, the strongest ghost first.

    The beam is the overlap of all apertures as seen from the front. Its area is estimated as that
    of an ellipse with the overlap's width in the meridional plane; the largest area of `FIELDS`
    field angles counts.

    Parameters
    ----------
    powers : reflectances of the lens.
    largest_tangent : largest tangent of the field angle.
    """
    lens = powers.prescription
    count = len(lens.surfaces)
    reflectance = {k: float(np.max(powers.at_normal(k))) for k in range(count)}
    wave = float(np.median(powers.wavelength_nm))
    indices = lens.indices(wave)
    front_mm = lens.surfaces[0].z_mm
    pupil_z, pupil_radius = paraxial.entrance_pupil(lens.surfaces[:-1], indices)
    image = paraxial.matrices(lens.surfaces, indices, [(k, False) for k in range(count)], front_mm)[
        -1
    ]
    scale = float(image[0] @ [front_mm - pupil_z, 1.0])
    pairs = []
    for back in range(1, count):
        for front in range(back):
            product = reflectance[front] * reflectance[back]
            if product <= 0:
                continue
            path = ghost_path(count, back, front)
            steps = paraxial.matrices(lens.surfaces, indices, path, front_mm)
            area, height = _beam(lens, path, steps, np.linspace(0, largest_tangent, FIELDS))
            end = steps[-1]
            middle = _to_middle(lens, path, steps)
            pairs.append(
                Pair(
                    front,
                    back,
                    product * area / (np.pi * pupil_radius**2),
                    abs(end[0, 0]) * height,
                    -end[0, 0] / end[1, 0] if end[1, 0] else np.inf,
                    float(end[0] @ [middle, 1.0]) / scale,
                )
            )
    return sorted(pairs, key=lambda p: -p.share)


def _beam(
    lens: Prescription,
    path: Sequence[tuple[int, bool]],
    steps: Sequence[np.ndarray],
    tangents: np.ndarray,
) -> tuple[float, float]:
    """Return (largest area over the tangents in mm2, half width on the axis in mm) of the beam that
    passes all apertures of a path.
    """
    a, b, width = _apertures(lens, path, steps)
    centre = -b[:, None] * tangents / np.where(a == 0, 1e-12, a)[:, None]
    chord = (centre + width[:, None]).min(axis=0) - (centre - width[:, None]).max(axis=0)
    return float(np.pi / 2 * max(chord.max(), 0.0) * width.min()), float(width.min())


def _apertures(
    lens: Prescription, path: Sequence[tuple[int, bool]], steps: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (a, b, half width mm), each (aperture,), of all apertures of a path.

    A ray with the height h at the front and the tangent t crosses an aperture at the height
    a h + b t. The half width is that of the aperture seen from the front.
    """
    limits = [
        (m[0, 0], m[0, 1], lens.surfaces[k].semi_diameter_mm)
        for (k, _), m in zip(path, steps)
        if np.isfinite(lens.surfaces[k].semi_diameter_mm)
    ]
    a, b, semi = (np.array(v) for v in zip(*limits))
    return a, b, semi / np.maximum(np.abs(a), 1e-12)


def acceptance(lens: Prescription, pair: Pair, wavelength_nm: float) -> tuple[float, float]:
    """Return (half width mm, movement mm per tangent) of the paraxial beam of a ghost at the front:
    those of the narrowest aperture that it passes.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    pair : pair of reflecting surfaces.
    wavelength_nm : wavelength, nm.
    """
    path = ghost_path(len(lens.surfaces), pair.back, pair.front)
    indices = lens.indices(wavelength_nm)
    steps = paraxial.matrices(lens.surfaces, indices, path, lens.surfaces[0].z_mm)
    a, b, width = _apertures(lens, path, steps)
    narrowest = int(width.argmin())
    return float(width[narrowest]), float(abs(b[narrowest] / a[narrowest]))


def _to_middle(
    lens: Prescription, path: Sequence[tuple[int, bool]], steps: Sequence[np.ndarray]
) -> float:
    """Return the height at the front, per tangent, of the ray that passes the middle of the stop at
    its first crossing.
    """
    at = next(
        m
        for (k, _), m in zip(path, steps)
        if lens.surfaces[k].is_stop or k == len(lens.surfaces) - 1
    )
    return -at[0, 1] / at[0, 0]


def split(pairs: list[Pair], error_allowed: float) -> tuple[list[Pair], list[Pair]]:
    """Return (traced, left out) pairs.

    The weakest pairs are left out, as many as have shares that sum to at most `error_allowed`.

    Parameters
    ----------
    pairs : pairs, the strongest first.
    error_allowed : share of the light.
    """
    strong = list(pairs)
    weak = []
    total = 0.0
    while strong and total + strong[-1].share <= error_allowed:
        total += strong[-1].share
        weak.append(strong.pop())
    return strong, weak


@dataclass(frozen=True, eq=False)
class Beam:
    """Rays of one ghost at one field tangent: (band, y, x) over a box of the front plane."""

    x_mm: np.ndarray  # position on the sensor
    y_mm: np.ndarray  # position on the sensor
    weight: np.ndarray  # share of the power that reaches the sensor
    margin: np.ndarray  # smallest 1 - (r / semi-diameter)^2 along the ray; negative: blocked
    valid: np.ndarray  # 1 if the ray reaches the sensor plane
    stops: tuple = ()  # (x mm, y mm) of every crossing of the stop, for an iris that is not round


def boxes(
    lens: Prescription, pair: Pair, intervals: Sequence[tuple[float, float]], wavelength_nm: float
) -> list:
    """Return, for each interval of field tangents, the box (x, x, y, y) at the front vertex that
    holds a ghost's light, mm; None if no light passes.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    pair : pair of reflecting surfaces.
    intervals : [(low, high), ...] field tangents along +x.
    wavelength_nm : wavelength, nm.
    """
    indices = lens.indices(wavelength_nm)
    path = ghost_path(len(lens.surfaces), pair.back, pair.front)
    narrow_mm, _ = acceptance(lens, pair, wavelength_nm)
    halves_mm = [_front_half_mm(lens, indices, high) for _, high in intervals]
    found: dict[int, tuple[float, float, float, float] | None] = {}
    for half_mm in dict.fromkeys(halves_mm):
        count = max(SCAN, 2 * int(np.ceil(half_mm / narrow_mm)))
        alike = [k for k, half in enumerate(halves_mm) if half == half_mm]
        together = max(1, MOST_RAYS // count**2)
        for first in range(0, len(alike), together):
            some = alike[first : first + together]
            tangents = np.array([intervals[k] for k in some], float)
            found |= zip(some, _scanned(lens, indices, path, tangents, half_mm, count))
    return [found[k] for k in range(len(intervals))]


def _scanned(
    lens: Prescription,
    indices: Sequence[float | np.ndarray],
    path: Sequence[tuple[int, bool]],
    tangents: np.ndarray,
    half_mm: float,
    count: int,
) -> list[tuple[float, float, float, float] | None]:
    """Return the boxes of `boxes`, from rays on a grid in the plane of the front vertex.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    indices : refractive index of every medium.
    path : path of the ghost.
    tangents : (interval, 2) field tangents along +x.
    half_mm : half side of the grid, mm.
    count : number of rays along each side of the grid, even.
    """
    step = 2 * half_mm / count
    across = (np.arange(count) + 0.5) * step - half_mm
    # only the half y > 0; the other half is its mirror image
    x, y = np.meshgrid(across, across[count // 2 :])
    start = collimated(x, y, lens.surfaces[0].z_mm, tangents.reshape(-1, 1, 1), 0.0)
    passed = follow(lens.surfaces, indices, path, start).margin > 0
    out = []
    for either in passed.reshape(-1, 2, *x.shape).any(axis=1):
        columns = np.flatnonzero(either.any(axis=0))
        rows = np.flatnonzero(either.any(axis=1))
        edge = 1.5 * step  # a margin for light between the rays of the scan
        out.append(
            (
                across[columns[0]] - edge,
                across[columns[-1]] + edge,
                -y[rows[-1], 0] - edge,
                y[rows[-1], 0] + edge,
            )
            if len(columns)
            else None
        )
    return out


def _front_half_mm(
    lens: Prescription, indices: Sequence[float | np.ndarray], tangent: float
) -> float:
    """Return the distance from the axis, mm, within which light of a field tangent that enters the
    lens crosses the plane of the front vertex.
    """
    first = lens.surfaces[0]
    semi_mm = first.semi_diameter_mm
    if np.isfinite(semi_mm):
        # oblique light crosses the vertex plane displaced by tangent x sag
        displaced_mm = abs(tangent * float(np.nan_to_num(sag_mm(first, np.array(semi_mm**2)))))
        return max(semi_mm * 1.15, semi_mm + displaced_mm)
    return 2 * paraxial.entrance_pupil(lens.surfaces[:-1], indices)[1]


def beams(
    lens: Prescription,
    powers: Powers,
    pair: Pair,
    tangents: Sequence[float],
    limits: Sequence[tuple[float, float, float, float]],
    iris: bool = False,
) -> list[Beam]:
    """Trace a ghost in all bands of `powers`, with `NODES` x `NODES` rays per field tangent.

    Rays are traced at up to `SPECTRAL` wavelengths. Positions are interpolated linearly between
    them, because dispersion is smooth. The power is that of every band's own coatings, at the
    angles of the nearest traced wavelength. Only the half y > 0 is traced; the other half is its
    mirror image.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    powers : reflectances of the lens in all bands.
    pair : pair of reflecting surfaces.
    tangents : field tangents, along x.
    limits : per tangent a box (x, x, y, y) at the front vertex, mm, for the grid of rays.
    iris : whether beams state where they cross the stop.
    """
    wave = powers.wavelength_nm
    traced = wave if len(wave) <= SPECTRAL else np.linspace(wave[0], wave[-1], SPECTRAL)
    between = _between(wave, traced)
    nearest = np.abs(wave[:, None] - traced).argmin(axis=1)
    half = (NODES // 2, NODES)
    x = np.stack([np.broadcast_to(np.linspace(*b[:2], NODES), half) for b in limits])
    y = np.stack(
        [np.broadcast_to(np.linspace(*b[2:], NODES)[NODES // 2 :, None], half) for b in limits]
    )
    indices = {m: np.reshape(glass.index(m, traced), (-1, 1, 1, 1)) for m in set(lens.media)}
    weight = np.ones((len(wave), *x.shape))

    def passed_on(k: int, reflects: bool, forward: bool, cosine: np.ndarray) -> float:
        nonlocal weight
        weight = weight * powers(k, reflects, forward, cosine[nearest])
        return 1.0

    parallel = collimated(x, y, lens.surfaces[0].z_mm, np.reshape(tangents, (-1, 1, 1)), 0.0)
    start = Start(*(np.broadcast_to(v[:, None], (3, len(traced), *x.shape)) for v in parallel))
    path = ghost_path(len(lens.surfaces), pair.back, pair.front)
    rays = follow(
        lens.surfaces, [indices[m] for m in lens.media], path, start, passed_on, keep_hits=iris
    )
    valid = np.isfinite(rays.margin)

    def mirrored(half: np.ndarray, sign: int = 1) -> np.ndarray:
        return np.concatenate([sign * half[:, :, ::-1], half], axis=2)

    def banded(value: np.ndarray, sign: int = 1) -> np.ndarray:
        return mirrored(np.einsum("bk,ktyx->btyx", between, np.where(valid, value, 0.0)), sign)

    parts = [banded(rays.position_mm[0]), banded(rays.position_mm[1], -1), mirrored(weight)]
    parts += [banded(rays.margin), banded(valid.astype(float))]
    stops = [
        (banded(x), banded(y, -1))
        for (k, _), (x, y) in zip(path, rays.hits_mm)
        if lens.surfaces[k].is_stop
    ]

    def at(value: np.ndarray, t: int) -> np.ndarray:
        return np.ascontiguousarray(value[:, t], np.float32)

    return [
        Beam(*(at(v, t) for v in parts), tuple((at(x, t), at(y, t)) for x, y in stops))
        for t in range(len(limits))
    ]


def _between(wave: np.ndarray, traced: np.ndarray) -> np.ndarray:
    """Return the (band, traced) matrix of linear interpolation."""
    return np.stack([np.interp(wave, traced, one) for one in np.eye(len(traced))], axis=1)

"""Ghost pairs ranked by paraxial matrices, and the real rays of those that matter.

All lengths in mm. Light from field tangent t travels towards +x (see `prescription_figures`), so
ghosts come out in the orientation of the image.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics import glass, paraxial
from isethdr_core.physics.optics.ray_trace import Start, collimated, follow, ghost_path

from ...prescription.coatings import Powers

if TYPE_CHECKING:
    from ...prescription.prescription import Prescription

SCAN = 36  # rays across the front to find where a ghost's light enters
NODES = 16  # rays across that box; even: half of them on either side of the meridional plane
SPECTRAL = 4  # wavelengths at which rays are traced
FIELDS = 9  # field angles at which the matrices are asked for the widest beam


@dataclass(frozen=True)
class Pair:
    """Two reflecting surfaces, and the paraxial figures of their ghost."""

    front: int
    back: int
    share: float  # largest over bands and field: light of the ghost / light of the image
    radius_mm: float  # of the spot on the sensor, from a lamp far away on the axis
    focus_mm: float  # of the ghost, behind the sensor
    # of positions: -1 is as far from the axis as the lamp's image, on the other side
    magnification: float


def rank(powers: Powers, largest_tangent: float) -> list[Pair]:
    """Return every pair of surfaces of the lens of `powers` that reflect, most light first.

    The beam is the overlap of all apertures seen from the front; its area is taken as that of an
    ellipse with the overlap's width in the meridional plane, at the best of `FIELDS` angles up to
    `largest_tangent`.
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
    """Return (largest area over the tangents, half width on the axis) of what passes all apertures
    of a path.
    """
    limits = [
        (m[0, 0], m[0, 1], lens.surfaces[k].semi_diameter_mm)
        for (k, _), m in zip(path, steps)
        if np.isfinite(lens.surfaces[k].semi_diameter_mm)
    ]
    a, b, semi = (np.array(v) for v in zip(*limits))
    width = semi / np.maximum(np.abs(a), 1e-12)
    centre = -b[:, None] * tangents / np.where(a == 0, 1e-12, a)[:, None]
    chord = (centre + width[:, None]).min(axis=0) - (centre - width[:, None]).max(axis=0)
    return float(np.pi / 2 * max(chord.max(), 0.0) * width.min()), float(width.min())


def _to_middle(
    lens: Prescription, path: Sequence[tuple[int, bool]], steps: Sequence[np.ndarray]
) -> float:
    """Return the height, per tangent, of the ray through the middle of the stop at its first
    crossing.
    """
    at = next(
        m
        for (k, _), m in zip(path, steps)
        if lens.surfaces[k].is_stop or k == len(lens.surfaces) - 1
    )
    return -at[0, 1] / at[0, 0]


def split(pairs: list[Pair], error_allowed: float) -> tuple[list[Pair], list[Pair]]:
    """Return (traced, left out): the weakest are left out while their shares sum to at most
    `error_allowed`.
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

    x_mm: np.ndarray  # on the sensor
    y_mm: np.ndarray
    weight: np.ndarray  # of power
    margin: np.ndarray  # below 0: blocked
    valid: np.ndarray  # 1 where the ray reached the sensor plane
    stops: tuple = ()  # (x mm, y mm) of every crossing of the stop, for an iris that is not round


def boxes(
    lens: Prescription, pair: Pair, intervals: Sequence[tuple[float, float]], wavelength_nm: float
) -> list:
    """Return, per (low, high) field tangents, the box (x, x, y, y) at the front vertex that holds a
    ghost's light, or None.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    pair : of reflecting surfaces.
    intervals : [(low, high), ...] field tangents along +x.
    wavelength_nm : wavelength, nm.
    """
    indices = lens.indices(wavelength_nm)
    front_mm = lens.surfaces[0].z_mm
    half = _front_half_mm(lens, indices)
    step = 2 * half / SCAN
    across = (np.arange(SCAN) + 0.5) * step - half
    x, y = np.meshgrid(across, across[SCAN // 2 :])  # the half y > 0: the other is its mirror image
    path = ghost_path(len(lens.surfaces), pair.back, pair.front)
    tangents = np.asarray(intervals, float).reshape(-1, 1, 1)
    passed = (
        follow(lens.surfaces, indices, path, collimated(x, y, front_mm, tangents, 0.0)).margin > 0
    )
    out = []
    for either in passed.reshape(-1, 2, *x.shape).any(axis=1):
        columns = np.flatnonzero(either.any(axis=0))
        rows = np.flatnonzero(either.any(axis=1))
        edge = 1.5 * step  # light between the scan's rays
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


def _front_half_mm(lens: Prescription, indices: Sequence[float | np.ndarray]) -> float:
    first = lens.surfaces[0]
    if np.isfinite(first.semi_diameter_mm):
        # oblique light crosses the vertex plane displaced by tangent x sag
        return first.semi_diameter_mm * 1.15
    return 2 * paraxial.entrance_pupil(lens.surfaces[:-1], indices)[1]


def beams(
    lens: Prescription,
    powers: Powers,
    pair: Pair,
    tangents: Sequence[float],
    limits: Sequence[tuple[float, float, float, float]],
    iris: bool = False,
) -> list[Beam]:
    """Trace a ghost in all bands of `powers` from field tangents (along x), each through a grid of
    `NODES` x `NODES` rays over its own box of `limits`.

    Rays are traced at up to `SPECTRAL` wavelengths; between them positions go linearly (dispersion
    is smooth), while the power is that of every band's own coatings at the nearest traced angles.
    Only the half y > 0 is traced: the other is its mirror image. With `iris`, beams say where they
    cross the stop.

    Parameters
    ----------
    lens : `Prescription`, scaled and stopped.
    powers : of the bands.
    pair : of reflecting surfaces.
    tangents : field tangents, along x.
    limits : per tangent a box (x, x, y, y) at the front vertex, mm.
    iris : whether beams say where they cross the stop.
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

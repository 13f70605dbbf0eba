"""Ghosts of a lamp: number of surface pairs and of rays across a beam, against random photons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_optics import GhostFlare, IdealLens
from isethdr_optics.flare.ghosts import ghost_flare, trace
from isethdr_workflows.accuracy.point import Point, Work, timed

from isethdr_core import quantities

from .changed import changed
from .ghosts_by_chance import Photons, flux_by_chance

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Flare, Lens

# uncoated glass, which makes the strongest ghosts
PRESCRIPTION = "cooke_triplet"
F_NUMBER = 6.0
FOCAL_MM = 50.0
COATING = "none"
TILES = 96  # number of tiles along each axis of the frame
PITCH = 0.008  # width of a tile, tangents of the field angle
COLUMN = 61  # column of the lamp, 6.2 degrees off the axis
BLOCK = 8  # width of the blocks of tiles in which light is compared, tiles
BAND_NM = 550.0
RADIANCE = 1e3
ALLOWED = (0.1, 0.03, 0.01, 0.001)  # largest share of the scene's light in omitted pairs
NODES = (4, 8, 16, 32)  # rays across a beam
PHOTONS = 2**14  # photons per pair of surfaces and batch
BATCHES = 8
DOTS = 4000  # number of points that make up a disc of the matrix method


def measured() -> list[Work]:
    """Return two diagrams: error of ghosts in blocks of tiles, for several numbers of surface pairs
    and of rays across a beam.
    """
    lens = IdealLens(f_number=F_NUMBER, focal_length_mm=FOCAL_MM)
    mixed = lamp()
    flare = GhostFlare(PRESCRIPTION, coating=COATING, sensor_reflectance_percent=0.0)
    image_w, truth, error = by_chance(flare, lens, mixed)

    def point(name: str, make: Callable[..., Any], mark: str = "") -> Point:
        light, cpu_s, peak_mb = timed(make)
        return Point(
            name, float(np.abs(blocks(light) - truth).sum() / image_w), cpu_s, peak_mb, mark
        )

    pairs = []
    rays = []
    for allowed in (*ALLOWED, flare.error_allowed):
        variant = replace(flare, error_allowed=allowed)
        pairs_kept = len(variant.pairs(lens, [BAND_NM], largest(mixed))[0])
        pairs.append(
            point(
                f"{pairs_kept} pairs, {allowed:g} allowed",
                lambda one=variant: anew(one, lens, mixed),
                "default" if variant == flare else "",
            )
        )
    pairs.append(point("discs by matrices", lambda: discs(flare, lens, mixed, image_w), "peer"))
    usual = trace.NODES
    for nodes in NODES:
        with changed(trace, NODES=nodes):
            rays.append(
                point(
                    f"{nodes} x {nodes} rays",
                    lambda: anew(flare, lens, mixed),
                    "default" if nodes == usual else "",
                )
            )
    error_name = (
        f"light of ghosts put wrong, L1 in blocks of {BLOCK} tiles, over the light of the lamp's"
        " image"
    )
    reference_method = f"photons of chance, {BATCHES} x {PHOTONS} a pair, spheres by their centres"
    # mean absolute value of a Gaussian error
    reference_error = float(error.sum() / image_w * np.sqrt(2 / np.pi))
    return [
        Work("ghosts pairs", error_name, reference_method, reference_error, pairs),
        Work("ghosts rays", error_name, reference_method, reference_error, rays),
    ]


def lamp() -> xr.DataArray:
    """Return mixed radiance of one band with a single bright tile."""
    x = quantities.centres(TILES, TILES * PITCH)
    values = np.zeros((1, TILES, TILES))
    values[:, TILES // 2, COLUMN] = RADIANCE
    return quantities.plane(values, [BAND_NM], x, x, quantities.RADIANCE)


def largest(mixed: xr.DataArray) -> float:
    """Return the tangent of the frame's corner."""
    return float(np.hypot(mixed.x.max() + PITCH / 2, mixed.y.max() + PITCH / 2))


def anew(flare: Flare, lens: Lens, mixed: xr.DataArray) -> Any:
    """Return the ghosts' irradiance (y, x), with all rays traced anew.

    Parameters
    ----------
    flare : ghosts of a prescription.
    lens : lens with the prescription.
    mixed : (wavelength, y, x) mixed radiance with one lamp, W m-2 sr-1 nm-1.
    """
    ghost_flare._beams.clear()
    ghost_flare._ranked.cache_clear()
    return flare.irradiance(lens, mixed).values[0]


def blocks(light: xr.DataArray) -> np.ndarray:
    """Return the power in each block, W nm-1."""
    tile_m2 = (PITCH * FOCAL_MM * 1e-3) ** 2
    return light.reshape(TILES // BLOCK, BLOCK, TILES // BLOCK, BLOCK).sum(axis=(1, 3)) * tile_m2


def by_chance(flare: Flare, lens: Lens, mixed: xr.DataArray) -> tuple[float, Any, Any]:
    """Return the power of the lamp's image, the power of its ghosts in each block (y, x), and the
    standard error of the latter, W nm-1, from random photons.

    Parameters
    ----------
    flare : ghosts of a prescription.
    lens : lens with the prescription.
    mixed : mixed radiance with one lamp; only its tile centres are used.
    """
    x = float(mixed.x[COLUMN])
    y = float(mixed.y[TILES // 2])
    # irradiance on a plane across the axis, W m-2 nm-1
    per_m2 = RADIANCE * PITCH**2 * (1 + x**2 + y**2) ** -2
    edges = np.arange(-TILES // 2, TILES // 2 + 1, BLOCK) * PITCH * FOCAL_MM
    # the lamp's row is half a tile off the middle, 0.5 % of the frame. The photons come from a lamp
    # on the x axis instead, which turns their ghosts about the axis by that little.
    mean, error = flux_by_chance(
        flare.of_lens(lens), float(np.hypot(x, y)), BAND_NM, edges, Photons(PHOTONS, BATCHES)
    )
    return (
        per_m2 * np.pi * (FOCAL_MM / F_NUMBER / 2 * 1e-3) ** 2,
        mean * per_m2 * 1e-6,
        error * per_m2 * 1e-6,
    )


def discs(flare: Flare, lens: Lens, mixed: xr.DataArray, image_w: float) -> np.ndarray:
    """Return irradiance (y, x) of ghosts drawn as uniform discs. Their positions and sizes come
    from first-order optics (Lee and Eisemann 2013).

    Parameters
    ----------
    flare : ghosts of a prescription.
    lens : lens with the prescription.
    mixed : mixed radiance with one lamp, W m-2 sr-1 nm-1.
    image_w : power of the lamp's image, W nm-1.
    """
    ghost_flare._ranked.cache_clear()
    traced, _ = flare.pairs(lens, [BAND_NM], largest(mixed))
    k = np.arange(DOTS)
    # points on a spiral with the golden angle cover a disc evenly
    radius = np.sqrt((k + 0.5) / DOTS)
    turn = k * np.pi * (3 - np.sqrt(5))
    edges = np.arange(-TILES // 2, TILES // 2 + 1) * PITCH * FOCAL_MM
    out = np.zeros((TILES, TILES))
    for pair in traced:
        middle = [
            pair.magnification * FOCAL_MM * float(v) for v in (mixed.y[TILES // 2], mixed.x[COLUMN])
        ]
        at = (m + pair.radius_mm * radius * f(turn) for m, f in zip(middle, (np.sin, np.cos)))
        out += np.histogram2d(*at, (edges, edges))[0] * pair.share * image_w / DOTS
    return out / (PITCH * FOCAL_MM * 1e-3) ** 2

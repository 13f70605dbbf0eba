"""Sub-bands of a point spread and the radius of its exact core, against Airy's formula at many
points and wavelengths.
"""

from __future__ import annotations

import numpy as np
from isethdr_optics import DiffractionLimitedLens
from isethdr_optics.psf.exact_core import Wavelengths
from isethdr_optics.psf.kernels import BandPlan
from isethdr_optics.psf.wings import Grid
from isethdr_optics.pupil.pupil_size import distance_mm, radius_mm
from isethdr_workflows.accuracy.point import Point, Work, refuse_what_does_not_fit, timed
from scipy.special import j1

TILE_UM = 3.75
BAND_NM = 550.0
WIDTH_NM = 30.0
F_NUMBER = 4.0
FOCAL_MM = 6.0
TILES = 12  # number of tiles from the axis to the border of the compared area
SUB_BANDS = (1, 2, 4, 8, 16)
SUPPORT = (3, 6, 9)  # radii of the exact core that is kept, tiles; light beyond is left out
POINTS = 24  # points of the reference, per tile and axis
WAVES = 48  # wavelengths of the reference in the band
ARRAYS = 6  # number of arrays of the reference's size that are in memory at the same time


def measured(reference: int = 0) -> list[Work]:
    """Return two diagrams: L1 error of a band's kernel, for several numbers of sub-bands, and for
    several radii of its exact core.

    `reference` : points per tile and axis of the reference; 0 takes `POINTS`.
    """
    points = reference or POINTS
    refuse_what_does_not_fit(
        "points per tile of the psf reference",
        points,
        lambda n: 8 * ARRAYS * ((2 * TILES + 2) * n) ** 2,
    )
    full, half, quarter = (airy(max(1, points // n)) for n in (1, 2, 4))
    # the error of the midpoint rule is proportional to the step squared (Richardson 1911)
    truth = (4 * full - half) / 3
    coarser = (4 * half - quarter) / 3
    # after extrapolation it is proportional to the fourth power: `coarser`, with twice the step,
    # has 16 times the error
    own_error = float(np.abs(truth - coarser).sum()) / 15
    bands = []
    support = []
    for count in (*SUB_BANDS, 0):
        kernel, cpu_s, peak_mb = timed(lambda count=count: core(count))
        bands.append(
            Point(
                f"{count} sub-bands" if count else "chosen by the lens",
                float(np.abs(kernel - truth).sum()),
                cpu_s,
                peak_mb,
                {0: "default", 1: "peer"}.get(count, ""),
                f"{count}" if count else "",
            )
        )
    for tiles in SUPPORT:
        kernel, cpu_s, peak_mb = timed(lambda tiles=tiles: core(0, tiles))
        wide = np.pad(kernel, TILES - tiles)
        support.append(Point(f"{tiles} tiles", float(np.abs(wide - truth).sum()), cpu_s, peak_mb))
    support.append(bands[-1])
    reference_method = f"Airy's formula, {points} x {points} points a tile, {WAVES} wavelengths"
    return [
        Work(
            "psf sub-bands",
            "share of a point's light put wrong, L1",
            reference_method,
            own_error,
            bands,
        ),
        Work(
            "psf support",
            "share of a point's light put wrong, L1",
            reference_method,
            own_error,
            support,
        ),
    ]


def core(count: int, tiles: int = TILES) -> np.ndarray:
    """Return the lens's kernel (y, x) of the band.

    Parameters
    ----------
    count : number of sub-bands; 0: the lens chooses it.
    tiles : tiles from the axis to the border of the kernel.
    """
    lens = DiffractionLimitedLens(f_number=F_NUMBER, focal_length_mm=FOCAL_MM)
    grid = Grid(1, (TILE_UM, TILE_UM), (tiles, tiles))
    plan = BandPlan(lens, (), (BAND_NM, WIDTH_NM), grid)
    if count:
        middles_nm = BAND_NM + ((np.arange(count) + 0.5) / count - 0.5) * WIDTH_NM
        plan.wavelengths = lambda *_: Wavelengths(middles_nm, np.full(count, 1 / count))
    return plan.band(BAND_NM, WIDTH_NM)[0]


def airy(points: int) -> np.ndarray:
    """Return the kernel (y, x) from tile to tile, by midpoint sums of (2 J1(v) / v)^2 (Airy 1835).
    It is the mean over the band.

    Parameters
    ----------
    points : points of the sums, per tile and axis.
    """
    lens = DiffractionLimitedLens(f_number=F_NUMBER, focal_length_mm=FOCAL_MM)
    # v = 2 pi / wavelength x radius x sine, as in Fraunhofer's integral
    sine = radius_mm(lens) / distance_mm(lens)
    at = (np.arange((2 * TILES + 2) * points) + 0.5) / points - TILES - 1  # in tiles
    r_um = np.hypot(at[:, None], at) * TILE_UM
    total = np.zeros_like(r_um)
    for wave in BAND_NM + ((np.arange(WAVES) + 0.5) / WAVES - 0.5) * WIDTH_NM:
        scale = 2 * np.pi / (wave * 1e-3) * sine
        total += (2 * j1(scale * r_um) / (scale * r_um)) ** 2 * scale**2 / (4 * np.pi)
    density = total / WAVES * (TILE_UM / points) ** 2
    # mean over the source tile
    weight = np.maximum(1 - np.abs(at[None, :] - np.arange(-TILES, TILES + 1)[:, None]), 0.0)
    return weight @ density @ weight.T

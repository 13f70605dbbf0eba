"""Point spread kernels of the lens against direct sums over the pupil: errors of their wings, and
the errors of electrons next to a bright lamp that follow from them.

A direct sum integrates every chord of the pupil along x in closed form, and adds chords, points of
a tile and wavelengths of a band one by one. It uses no lattice, transform or running sum. The
shapes of the pupil are those of the lens.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time
from typing import Any, NamedTuple

import numpy as np
from isethdr_optics.psf.kernels import KernelRequest, kernels
from isethdr_optics.pupil import pupil_energy, pupil_shapes, pupil_size

from isethdr_core import quantities
from isethdr_core.demand import Demand, Response
from isethdr_core.physics.radiometry import photons_per_energy
from isethdr_core.plugins.registry import build

PITCH_UM = 3.0
FOCAL_MM = 6.0
F_NUMBER = 4.0
WIDTH_NM = 10.0
SIDE = 4  # width of a patch, tiles
POINTS = 6  # points of Gauss's rule from one tile's centre to the next, along each axis
# wavelengths of Gauss's rule in a band, in addition to one for each speckle by which the pattern
# moves over the band
MORE_WAVELENGTHS = 4
# number of chords of a shape: CHORDS times its share, which is LEAST_SHARE plus its height over
# that of the pupil and at most 1, and MORE_CHORDS more per period of the outermost light over half
# its height
CHORDS = 2000
LEAST_SHARE = 0.05
MORE_CHORDS = 48
WINGS_NM = (400.0, 550.0, 700.0)
WINGS = ((20, 12), (66, 20), (150, 90))  # (x, y) tiles from the axis
BANDS_NM = np.arange(400.0, 701.0, WIDTH_NM)
LAMPS = (1e6, 1e7, 1e8)  # radiance of the lamp over that of the background
BESIDE = ((20, -12), (66, 20), (120, -50))  # (x, y) tiles from the lamp
LAMP_COLUMN = 40
LEVEL = 2.5e-4  # radiance of the background, W m-2 sr-1 nm-1: some hundred electrons in green


class Patch(NamedTuple):
    """`SIDE` x `SIDE` tiles of a kernel in one band, given by the first column and row."""

    x: int  # first column, tiles from the axis
    y: int  # first row, tiles from the axis
    centre_nm: float


@dataclass(frozen=True)
class Pupil:
    """The pupil of a lens with flares, for direct sums, without phase."""

    terms: list[tuple[Any, float]]  # shapes, mm, and their amplitudes
    radius_mm: float
    distance_mm: float  # distance from the pupil to the image
    energy_mm2: float
    blur_um_per_nm: float  # wavelength x f-number over the wavelength

    @classmethod
    def of(cls, lens: Any, flares: tuple[Any, ...]) -> Pupil:
        """Return the pupil of a lens with flares."""
        return cls(
            pupil_shapes.terms(lens, flares),
            pupil_size.radius_mm(lens),
            pupil_size.distance_mm(lens),
            pupil_energy.open_energy_mm2(lens, flares, BANDS_NM[0]),
            pupil_size.blur_um(lens, 1.0),
        )

    def light(self, patch: Patch) -> np.ndarray:
        """Return the share (y, x) of the light of the axial tile that falls on each tile of a
        patch.
        """
        outermost_um = (np.hypot(patch.x, patch.y) + SIDE) * PITCH_UM
        turns = outermost_um * WIDTH_NM / patch.centre_nm
        speckles = turns / (self.blur_um_per_nm * patch.centre_nm)
        parts, shares = _gauss(int(np.ceil(speckles)) + MORE_WAVELENGTHS)
        steps, step_shares = _gauss(POINTS)
        at = (np.arange(-1, SIDE)[:, None] + 0.5 + steps).ravel()  # tiles from the first centre
        # weight of a displacement between points of two tiles: a triangle
        triangles = np.maximum(0.0, 1 - np.abs(at - np.arange(SIDE)[:, None]))
        weights = triangles * np.tile(step_shares, SIDE + 1)
        x_um, y_um = ((first + at) * PITCH_UM for first in (patch.x, patch.y))
        total = np.zeros((SIDE, SIDE))
        for part, share in zip(parts, shares, strict=True):
            density = self._density(x_um, y_um, patch.centre_nm + part * WIDTH_NM)
            total += share * (weights @ density @ weights.T)
        return total * PITCH_UM**2

    def _density(self, x_um: np.ndarray, y_um: np.ndarray, wave_nm: float) -> np.ndarray:
        """Return the share of the light per um2 at points of the image, (y, x)."""
        scale_mm2 = 1e-6 * wave_nm * self.distance_mm
        along_x, along_y = (1e-3 * at / scale_mm2 for at in (x_um, y_um))  # cycles per mm
        field = np.zeros((len(y_um), len(x_um)), complex)
        turns_per_mm = np.abs(along_x).max() + np.abs(along_y).max()
        for shape, amplitude in self.terms:
            half_mm = (shape.high - shape.low) / 2
            share = min(1.0, LEAST_SHARE + half_mm / self.radius_mm)
            places, height = _by_cosine(int(CHORDS * share + MORE_CHORDS * turns_per_mm * half_mm))
            level = shape.low + half_mm * (1 + places)
            left, right = shape.chords(level)
            hit = left < right
            ends = [np.exp(-2j * np.pi * np.outer(along_x, end[hit])) for end in (left, right)]
            across = (ends[0] - ends[1]) / (2j * np.pi * along_x[:, None])
            down = np.exp(-2j * np.pi * np.outer(along_y, level[hit]))
            field += (down * (amplitude * half_mm * height[hit])) @ across.T
        return np.abs(field) ** 2 * (1e-6 / (scale_mm2**2 * self.energy_mm2))


def _gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of Gauss's rule from -1/2 to 1/2 and their weights, which sum to 1."""
    places, shares = np.polynomial.legendre.leggauss(count)
    return places / 2, shares / 2


def _by_cosine(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return about `count` nodes from -1 to 1 and their weights.

    The nodes are cosines of angles. The range of angles has equal parts, with the two nodes of
    Gauss's rule in each. The lengths of a disc's chords go to zero as a square root; this rule
    integrates them exactly.
    """
    parts = max(count // 2, 1)
    angle = (np.arange(parts)[:, None] + 0.5 + _gauss(2)[0]).ravel() * np.pi / parts
    return -np.cos(angle), np.sin(angle) * np.pi / (2 * parts)


def optics() -> tuple[Any, tuple[Any, ...]]:
    """Return the lens and its flares: f/4 with a dusty hexagonal aperture, without falloff."""
    fields = {"f_number": F_NUMBER, "focal_length_mm": FOCAL_MM, "falloff": "none"}
    return build("lens", "diffraction_limited", **fields), (build("flare", "aperture"),)


def kernel_wings(rows: int = 180, columns: int = 320) -> list[dict]:
    """Return the errors of kernels in patches of tiles, against direct sums.

    Parameters
    ----------
    rows, columns : size of the frame, tiles.

    Returns
    -------
    rows with band_nm, tiles_from_axis, l1_error (of the patch, relative), sum_error (of the light
    in the patch, relative) and stated (the error per tile that the kernels state for that octave of
    distance, relative).
    """
    lens, flares = optics()
    pupil = Pupil.of(lens, flares)
    reach = (rows - 1, columns - 1)
    out = []
    for centre_nm in WINGS_NM:
        waves = centre_nm + WIDTH_NM * np.arange(-1, 2)
        made = kernels(KernelRequest(lens, flares, waves, (PITCH_UM, PITCH_UM), reach))
        for x, y in WINGS:
            wanted = pupil.light(Patch(x, y, centre_nm))
            found = cut(made.bands[1], x, y)
            octave = int(np.log2(np.hypot(x, y)))
            out.append(
                {
                    "band_nm": centre_nm,
                    "tiles_from_axis": round(float(np.hypot(x, y))),
                    "l1_error": float(np.abs(found - wanted).sum() / wanted.sum()),
                    "sum_error": float(found.sum() / wanted.sum() - 1),
                    "stated": float(made.speckle[1, octave]),
                }
            )
    return out


def cut(kernel: Any, x: int, y: int) -> np.ndarray:
    """Return a patch (y, x) of a kernel with its axis in the middle. A patch that is not entirely
    inside the kernel is 0.

    Parameters
    ----------
    kernel : (y, x) kernel.
    x, y : first column and first row of the patch, tiles from the axis.
    """
    middle = [n // 2 for n in kernel.shape]
    full = np.zeros((SIDE, SIDE))
    first = [middle[0] + y, middle[1] + x]
    if all(f >= 0 and f + SIDE <= n for f, n in zip(first, kernel.shape, strict=True)):
        full[...] = kernel[first[0] : first[0] + SIDE, first[1] : first[1] + SIDE]
    return full


def kernels_beside_lamps(rows: int = 180, columns: int = 320) -> list[dict]:
    """Return the errors of electrons next to a lamp of one tile that the errors of kernels cause.

    Parameters
    ----------
    rows, columns : size of the frame, tiles.

    Returns
    -------
    rows with lamp_to_background, tiles_from_lamp, electrons (of the most sensitive channel, mean),
    largest_error (of a tile and channel below full scale, in standard deviations of the sensor's
    noise), stated (largest error in 99 % of the tiles of the frame, as the plan states it),
    core_tiles (radius of the exact core, tiles) and cpu_s (CPU seconds of the plan; with the first
    lamp they include all kernels).
    """
    lens, flares = optics()
    pupil = Pupil.of(lens, flares)
    response = build("sensor", "bayer", pitch_um=PITCH_UM).narrow(Demand()).response
    wanted = [np.stack([pupil.light(Patch(x, y, nm)) for nm in BANDS_NM]) for x, y in BESIDE]
    out = []
    for lamp in LAMPS:
        field = night(rows, columns, lamp)
        start = process_time()
        plan = lens.plan(flares, field, response)
        seconds = process_time() - start
        used = plan.optics.kernels
        gains = plan.optics.gains
        core = used.wide.tiles if used.wide is not None else float(used.core.min())
        for (x, y), right in zip(BESIDE, wanted, strict=True):
            made = np.stack([cut(band, x, y) for band in used.bands])
            share, electrons = _share_of_noise(made, right, lamp * gains, response, gains)
            out.append(
                {
                    "lamp_to_background": lamp,
                    "tiles_from_lamp": round(float(np.hypot(x, y))),
                    "electrons": electrons,
                    "largest_error": share,
                    "stated": float(plan.optics.noise_share),
                    "core_tiles": core,
                    "cpu_s": seconds,
                }
            )
    return out


def night(rows: int, columns: int, lamp: float) -> Any:
    """Return mixed radiance of an even background and a lamp of one tile.

    Parameters
    ----------
    rows, columns : tiles along y and x.
    lamp : luminance of the lamp over that of the background.
    """
    values = np.full((len(BANDS_NM), rows, columns), LEVEL, np.float32)
    values[:, rows // 2, LAMP_COLUMN] *= lamp
    step = 1e-3 * PITCH_UM / FOCAL_MM
    x, y = (quantities.centres(n, n * step) for n in (columns, rows))
    size = {"field_width": columns * step, "field_height": rows * step}
    return quantities.plane(values, BANDS_NM, x, y, quantities.RADIANCE, **size)


def _share_of_noise(
    made: np.ndarray, right: np.ndarray, lamp: np.ndarray, response: Response, gains: np.ndarray
) -> tuple[float, float]:
    """Return the largest error of a patch's electrons over their noise, and their mean.

    Parameters
    ----------
    made, right : (band, y, x) shares of the lamp's light, by the kernels and by direct sums.
    lamp, gains : (band,) irradiance of the lamp's tile and of the background, over `LEVEL`.
    response : response of the sensor to light.
    """
    counting = response.efficiency(BANDS_NM) * photons_per_energy(BANDS_NM)
    counting = counting * (LEVEL * response.area_exposure_m2_s)  # electrons per irradiance
    background = (counting * gains).sum(axis=1)[:, None, None]
    electrons = background + np.tensordot(counting * lamp, right, 1)
    error = np.tensordot(counting * lamp, made - right, 1)
    share = np.abs(error) / np.sqrt(electrons + response.read_noise_e**2)
    below = electrons < response.full_scale_e
    largest = float(share[below].max()) if below.any() else float("nan")
    return largest, float(electrons.mean(axis=(1, 2)).max())

"""Coloured streaks around a white lamp behind dust: kernels of one wavelength per band, against
kernels that are integrated over the width of the band.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_optics.psf.kernels import KernelRequest, kernels

from isethdr_core.physics.colour.colour_spaces import linear_srgb, srgb_encode
from isethdr_core.physics.photometry import xyz
from isethdr_core.plugins.registry import build

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare, Lens

BANDS_NM = (400.0, 700.0, 10.0)
F_NUMBER = 4.0
PITCH_UM = 3.0
DUST = {"blades": 0, "dust_per_mm2": 120.0, "scratches_per_mm2": 0.0}
CHECKED_NM = (450.0, 550.0, 650.0)  # bands whose error is measured
FINE = 0.005  # relative error allowed in the reference kernels
SHOWN = 0.35  # share of the display's white at which the mean light of each radius is shown
GAP = 4  # number of white columns between both pictures


def coloured_streaks(picture: str = "", tiles: int = 200, error: float = 0.03) -> list[dict]:
    """Return one row per radius: the error of kernels of one wavelength, the error of integrated
    kernels, and the error that the latter state.

    Parameters
    ----------
    picture : file for both point spreads in colour, one wavelength per band on the left; empty
        writes none.
    tiles : tiles from the lamp to the picture's border.
    error : relative error allowed per tile.

    Returns
    -------
    rows with radius_tiles, one_wavelength and integrated (relative L1 errors against bands
    integrated to 0.5 %, worst of three bands), stated (error that the integrated kernels state),
    sub_bands (number of speckles that the width of the band merges into one, at 550 nm).
    """
    flare = build("flare", "aperture", **DUST)
    usual, fine = (
        build("lens", "diffraction_limited", f_number=F_NUMBER, speckle_error=e)
        for e in (error, FINE)
    )
    if picture:
        write_picture(picture, usual, flare, tiles)
    first, last, step = BANDS_NM
    rows = []
    measured = {wave: compared(usual, fine, flare, wave, step, tiles) for wave in CHECKED_NM}
    for octave in range(3, int(np.log2(tiles)) + 1):
        figures = np.array([m[octave] for m in measured.values()]).max(axis=0)
        rows.append(
            {
                "radius_tiles": f"{2**octave}-{min(2 ** (octave + 1), tiles)}",
                **dict(zip(("one_wavelength", "integrated", "stated"), map(float, figures))),
                "sub_bands": 1.5 * 2**octave * PITCH_UM * step / (550.0 * 0.55 * F_NUMBER),
            }
        )
    return rows


def compared(usual: Any, fine: Any, flare: Flare, wave: float, step: float, tiles: int) -> dict:
    """Return {octave of radius: (error of one wavelength, error of the band's kernel, error that
    the band's kernel states)}.

    Parameters
    ----------
    usual : lens with the accuracy of ordinary runs.
    fine : the same lens with finer sampling, the reference.
    flare : dirt on the lens.
    wave : middle of the band, nm.
    step : distance between the bands, nm.
    tiles : tiles from the lamp to the border of the kernel.
    """
    pitch = (PITCH_UM, PITCH_UM)
    reach = (tiles, tiles)
    waves = wave + step * np.array([-1.0, 0.0, 1.0])
    # a single wavelength counts as a band of 1 nm
    single = kernels(KernelRequest(fine, (flare,), np.array([wave]), pitch, reach)).bands[0]
    usual_kernels, truth = (
        kernels(KernelRequest(lens, (flare,), waves, pitch, reach)) for lens in (usual, fine)
    )
    y, x = np.indices(single.shape) - tiles
    octave = np.log2(np.maximum(np.hypot(y, x), 1)).astype(int)
    errors = {}
    for k in range(3, int(np.log2(tiles)) + 1):
        ring = (octave == k) & (np.hypot(y, x) < tiles)
        light = truth.bands[1][ring].sum()
        errors[k] = (
            *(
                np.abs(v[ring] - truth.bands[1][ring]).sum() / light
                for v in (single, usual_kernels.bands[1])
            ),
            usual_kernels.speckle[1, k],
        )
    return errors


def write_picture(path: str, lens: Lens, flare: Flare, tiles: int) -> None:
    """Write a picture of both point spreads. Light is divided by its mean at the same radius, so
    that all radii are visible.

    Parameters
    ----------
    path : file of the picture.
    lens : lens.
    flare : dirt on the lens.
    tiles : tiles from the lamp to the border of the kernel.
    """
    from PIL import Image

    first, last, step = BANDS_NM
    waves = np.arange(first, last + step / 2, step)
    pitch = (PITCH_UM, PITCH_UM)
    reach = (tiles, tiles)
    single = np.stack(
        [
            kernels(KernelRequest(lens, (flare,), np.array([w]), pitch, reach)).bands[0]
            for w in waves
        ]
    )
    whole = np.stack(kernels(KernelRequest(lens, (flare,), waves, pitch, reach)).bands)
    pictures = [shown(cube, waves) for cube in (single, whole)]
    gap = np.full((pictures[0].shape[0], GAP, 3), 255, np.uint8)
    Image.fromarray(np.concatenate([pictures[0], gap, pictures[1]], axis=1)).save(path, quality=88)


def shown(cube: Any, waves: np.ndarray) -> np.ndarray:
    """Return sRGB (y, x, 3) uint8 of the point spread of a lamp with an equal-energy spectrum. The
    mean light of each radius is made equal.

    Parameters
    ----------
    cube : (band, y, x) point spread.
    waves : (band,) centres of the bands, nm.
    """
    value = xyz(cube.astype(float), waves)
    value /= xyz(np.ones((len(waves), 1)), waves)[..., 1].max()
    middle = cube.shape[1] // 2
    y, x = np.indices(cube.shape[1:]) - middle
    radius = np.hypot(y, x).astype(int)
    mean = np.bincount(radius.ravel(), value[..., 1].ravel()) / np.bincount(radius.ravel())
    rgb = linear_srgb(value / mean[radius][..., None]) * SHOWN
    return np.rint(255 * srgb_encode(np.clip(rgb, 0.0, 1.0))).astype(np.uint8)

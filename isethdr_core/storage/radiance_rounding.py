"""Radiance rounding: each tile keeps only the mantissa bits that are significant above its noise.

The error of a rendered tile is its noise, a few percent in most tiles. Bits far below the noise
hold no information and cannot be compressed: without them a night scene takes two thirds of the
bytes. A dataset stores its scenes in this way; a run stores the radiance of its scene with
`encoding.KEEPBITS`. The stored standard errors include the rounding, so that every use of the noise
includes it.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from ..physics.photometry import luminance
from .encoding import KEEPBITS, MANTISSA_BITS, keep_mantissa_bits
from .picture_rounding import ROUNDING

SHARE_OF_NOISE = 1 / 20  # largest rounding error of a tile, in standard errors of its luminance
LEAST_BITS = 6  # smallest number of mantissa bits: relative error 2^-7
NOISE_BITS = 6  # mantissa bits of the standard errors, which are known to a few percent
NOTE = "at most 1/20 of the standard error of the tile's luminance; without noise 2^-{}, relative"
# ratio of a stored standard error to that of the rendering. The stored one includes the rounding of
# the light, even after it is rounded itself
WITH_ROUNDING = (1 + SHARE_OF_NOISE) * (1 + 2.0**-NOISE_BITS)


def rounded_by_noise(scene: xr.Dataset, most_bits: int | None = KEEPBITS) -> xr.Dataset:
    """Return scene radiance with tiles rounded by their noise; unchanged if it has no `xyz_noise`.

    Parameters
    ----------
    scene : scene radiance with `xyz_noise` (light_group, xyz_channel, y, x), cd/m2.
    most_bits : mantissa bits of a tile without noise; None: all.

    Returns
    -------
    Dataset : `radiance` has the attribute `rounding`. `xyz_noise` is increased by the share of the
        rounding. `xyz_noise` and `half_difference` are rounded to `NOISE_BITS`.
    """
    if "xyz_noise" not in scene:
        return scene
    most = MANTISSA_BITS if most_bits is None else most_bits
    radiance = scene["radiance"].transpose("light_group", "wavelength", "y", "x")
    light = radiance.values.astype(np.float32)
    # the dim xyz_channel has no coordinate in scene radiance; Y is at 1
    noise = scene["xyz_noise"].isel(xyz_channel=1).transpose("light_group", "y", "x").values
    for group, values in enumerate(light):
        bits = bits_of_tiles(luminance(values, radiance.wavelength.values), noise[group], most)
        for count in np.unique(bits):
            tiles = bits == count
            values[:, tiles] = keep_mantissa_bits(values[:, tiles], int(count))
    attributes = {**radiance.attrs, ROUNDING: NOTE.format(most + 1)}
    rounded = {"radiance": (radiance.dims, light, attributes)}
    for name, factor in (("xyz_noise", WITH_ROUNDING), ("half_difference", 1.0)):
        if name in scene:
            values = keep_mantissa_bits(scene[name].values * np.float32(factor), NOISE_BITS)
            rounded[name] = (scene[name].dims, values, scene[name].attrs)
    return scene.assign(rounded)


def bits_of_tiles(luminance_cd_m2: np.ndarray, noise_cd_m2: np.ndarray, most: int) -> np.ndarray:
    """Return the mantissa bits (y, x) that keep the rounding of each tile within its share of the
    noise, from `LEAST_BITS` to `most`.

    Parameters
    ----------
    luminance_cd_m2, noise_cd_m2 : (y, x) luminance of one light group, and its standard error.
    most : mantissa bits of a tile without noise or light; no tile has more.
    """
    known = np.isfinite(noise_cd_m2) & (noise_cd_m2 > 0) & (luminance_cd_m2 > 0)
    relative = np.where(known, noise_cd_m2, 1.0) / np.where(known, luminance_cd_m2, 1.0)
    bits = np.ceil(-np.log2(SHARE_OF_NOISE * relative)) - 1
    return np.where(known, np.clip(bits, min(LEAST_BITS, most), most), most).astype(int)

"""ISETCam's optical image of a diffraction-limited lens, for comparison only. Its convolution is
circular; that of isethdr is linear.

The rules are those of ISETCam's oiCalculateIrradiance, opticsDLCompute and opticsOTF (2021) without
off-axis falloff: the irradiance is padded by an eighth of its size on every side, multiplied by the
transfer function in the frequency domain, and made positive by abs().
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.diffraction import diffraction_mtf

if TYPE_CHECKING:
    from .thin_lens import DiffractionLimitedLens

BORDER = 1e-9  # irradiance of the padding, over the largest irradiance


def optical_image(
    lens: DiffractionLimitedLens,
    radiance: np.ndarray,
    wavelength_nm: np.ndarray,
    field_deg: float,
    um_per_degree: float,
) -> np.ndarray:
    """Return the optical image of radiance, including the padding.

    Parameters
    ----------
    lens : a lens with `f_number`, `throughput_sr()` and `magnification`, which follows from the
        distance in focus.
    radiance : (wavelength, y, x) array in any unit of radiance; y = x, a multiple of 8.
    wavelength_nm : (wavelength,) nm.
    field_deg : full angle across the padded image, deg; the frequencies are whole numbers of cycles
        per this angle.
    um_per_degree : length in the image per degree, um; a constant.

    Returns
    -------
    (wavelength, 1.25 y, 1.25 x) float64, unit of radiance times sr.
    """
    light = np.asarray(radiance, float) * lens.throughput_sr()
    pad = [(0, 0)] + [(n // 8, n // 8) for n in light.shape[1:]]
    light = np.pad(light, pad, constant_values=BORDER * light.max())
    cycles_per_um = [np.fft.fftfreq(n) * n / field_deg / um_per_degree for n in light.shape[1:]]
    frequency = np.hypot(cycles_per_um[0][:, None], cycles_per_um[1][None, :])
    out = np.empty_like(light)
    for i, wave in enumerate(wavelength_nm):
        # ISETCam's cutoff is diameter / (wavelength x image distance), hence the working f-number.
        mtf = diffraction_mtf(frequency, float(wave), lens.f_number * (1 + lens.magnification))
        out[i] = np.abs(np.fft.ifft2(np.fft.fft2(light[i]) * mtf))
    return out

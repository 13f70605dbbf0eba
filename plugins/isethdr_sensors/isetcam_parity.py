"""ISETCam's spatial and voltage rules, for comparison only; our own rule is `area_integration`.

ISETCam (fork state of May 2021) blurs each filter's plane with a small Gaussian and samples it bilinearly at pixel centres,
where we integrate over the photodiode; its noise acts on volts and is clipped at 0. Plain functions on arrays.
"""

from __future__ import annotations

import numpy as np


def pixel_rate(photons, spectral_qe, band_nm, sample_um, pixel_um, filters):
    """Return (y, x) electrons per m2 and second at pixel centres by ISETCam's rule (spatialIntegration, regridOI2ISA).

    Parameters
    ----------
    photons : (y, x, wavelength) quanta s-1 m-2 nm-1 on square samples centred on the sensor.
    spectral_qe : (wavelength, filter) electrons per photon.
    band_nm : width of a band.
    sample_um, pixel_um : sizes of a sample of `photons` and of a pixel.
    filters : (y, x) filter index of each pixel.

    Notes
    -----
    The kernel has n = ceil(pixel / sample) taps a side and a standard deviation of n / 4 samples; planes are zero outside.
    """
    from scipy.interpolate import RegularGridInterpolator
    from scipy.ndimage import convolve1d

    taps = int(np.ceil(pixel_um / sample_um))
    kernel = np.exp(-0.5 * ((np.arange(taps) - (taps - 1) / 2) / (taps / 4)) ** 2)
    kernel /= kernel.sum()
    source = tuple(_centres(n, sample_um) for n in photons.shape[:2])
    target = np.stack(np.meshgrid(*(_centres(n, pixel_um) for n in filters.shape), indexing="ij"), -1)
    out = np.zeros(filters.shape)
    for k in range(spectral_qe.shape[1]):
        plane = np.asarray(photons, float) @ (spectral_qe[:, k] * band_nm)
        for axis in (0, 1):
            plane = convolve1d(plane, kernel, axis, mode="constant")
        mask = filters == k
        out[mask] = RegularGridInterpolator(source, plane, bounds_error=False, fill_value=0.0)(target[mask])
    return out


def volts(rate, exposure_s, photodiode_m2, conversion_gain_v_per_e, swing_v, analog_gain=1.0, offset_v=0.0):
    """Return noise-free volts (sensorCompute, noise flag 0); `analog_gain` divides, as in ISETCam."""
    return np.clip((rate * exposure_s * photodiode_m2 * conversion_gain_v_per_e + offset_v) / analog_gain, 0.0, swing_v)


def noise_mean_and_variance(electrons, dark_e, conversion_gain_v_per_e, read_noise_v, prnu, dsnu_v):
    """Return mean and variance of volts before clipping, fixed pattern redrawn every frame (sensorAddNoise, flag 2).

    v = (Poisson(electrons + dark) g + read) (1 + prnu n) + dsnu n', n and n' standard normals.
    """
    mean = (electrons + dark_e) * conversion_gain_v_per_e
    temporal = mean * conversion_gain_v_per_e + read_noise_v**2
    return mean, temporal * (1 + prnu**2) + (prnu * mean) ** 2 + dsnu_v**2


def _centres(count, pitch):
    return (np.arange(count) - (count - 1) / 2) * pitch

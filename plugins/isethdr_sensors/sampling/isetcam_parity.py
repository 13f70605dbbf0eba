"""ISETCam's spatial and voltage rules, for comparison only; sensors use `area_integration`.

ISETCam (state of the fork in May 2021) blurs each filter's plane with a small Gaussian and samples
it bilinearly at pixel centres, instead of integrating over the photodiode. Its noise acts on volts
and is clipped at 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

# mean electrons from which ISETCam draws a rounded normal instead of a Poisson count
NORMAL_FROM_E = 25.0


class ClippedNoise(NamedTuple):
    """Moments of one pixel's volts over shots after clipping, and probabilities of clipping."""

    mean_v: float
    variance_v2: float
    fourth_v4: float  # fourth central moment, for the standard error of a variance
    at_zero: float  # probability of 0 V
    at_swing: float  # probability of the full swing


def pixel_rate(
    photons: np.ndarray,
    spectral_qe: np.ndarray,
    band_nm: float,
    sample_um: float,
    pixel_um: float,
    filters: np.ndarray,
) -> np.ndarray:
    """Return (y, x) electrons per m2 and second at pixel centres by ISETCam's rule
    (spatialIntegration, regridOI2ISA).

    Parameters
    ----------
    photons : (y, x, wavelength) quanta s-1 m-2 nm-1 on square samples centred on the sensor.
    spectral_qe : (wavelength, filter) electrons per photon.
    band_nm : width of a band, nm.
    sample_um, pixel_um : sizes of a sample of `photons` and of a pixel, um.
    filters : (y, x) filter index of each pixel.

    Notes
    -----
    The kernel has n = ceil(pixel / sample) taps along each side and a standard deviation of n / 4
    samples. Planes are continued with zeros.
    """
    from scipy.interpolate import RegularGridInterpolator
    from scipy.ndimage import convolve1d

    taps = int(np.ceil(pixel_um / sample_um))
    kernel = np.exp(-0.5 * ((np.arange(taps) - (taps - 1) / 2) / (taps / 4)) ** 2)
    kernel /= kernel.sum()
    source = tuple(_centres(n, sample_um) for n in photons.shape[:2])
    target = np.stack(
        np.meshgrid(*(_centres(n, pixel_um) for n in filters.shape), indexing="ij"), -1
    )
    out = np.zeros(filters.shape)
    for k in range(spectral_qe.shape[1]):
        plane = np.asarray(photons, float) @ (spectral_qe[:, k] * band_nm)
        for axis in (0, 1):
            plane = convolve1d(plane, kernel, axis, mode="constant")
        mask = filters == k
        out[mask] = RegularGridInterpolator(source, plane, bounds_error=False, fill_value=0.0)(
            target[mask]
        )
    return out


@dataclass(frozen=True)
class VoltageReadout:
    """Parameters of ISETCam's conversion from electrons to volts."""

    conversion_gain_v_per_e: float
    swing_v: float  # volts are clipped to 0..swing
    analog_gain: float = 1.0  # divisor of the volts, as in ISETCam
    offset_v: float = 0.0


def volts(
    rate: np.ndarray, exposure_s: float, photodiode_m2: float, readout: VoltageReadout
) -> np.ndarray:
    """Return noise-free volts (y, x) (sensorCompute, noise flag 0).

    Parameters
    ----------
    rate : (y, x) electrons per m2 and second, as `pixel_rate` returns them.
    exposure_s, photodiode_m2 : exposure time, s, and area of the photodiode, m2.
    readout : gain, offset and clipping.
    """
    signal_v = rate * exposure_s * photodiode_m2 * readout.conversion_gain_v_per_e
    return np.clip((signal_v + readout.offset_v) / readout.analog_gain, 0.0, readout.swing_v)


@dataclass(frozen=True)
class VoltageNoise:
    """The noise that ISETCam adds to the volts, in addition to shot noise."""

    read_noise_v: float = 0.0  # rms
    prnu: float = 0.0  # rms relative to the mean
    dsnu_v: float = 0.0  # rms


def noise_mean_and_variance(
    electrons: float, dark_e: float, conversion_gain_v_per_e: float, noise: VoltageNoise
) -> tuple[float, float]:
    """Return mean and variance of volts before clipping, with a fixed pattern that is drawn again
    for every frame (sensorAddNoise, flag 2).

    v = (Poisson(electrons + dark) g + read) (1 + prnu n) + dsnu n', where n and n' are standard
    normals.

    Parameters
    ----------
    electrons, dark_e : mean electrons of light and of dark current.
    conversion_gain_v_per_e : g, volts per electron.
    noise : read noise and DSNU in volts, PRNU relative.
    """
    mean = (electrons + dark_e) * conversion_gain_v_per_e
    temporal = mean * conversion_gain_v_per_e + noise.read_noise_v**2
    return mean, temporal * (1 + noise.prnu**2) + (noise.prnu * mean) ** 2 + noise.dsnu_v**2


def clipped_noise(
    electrons: float, dark_e: float, readout: VoltageReadout, noise: VoltageNoise
) -> ClippedNoise:
    """Return the moments of the volts of `noise_mean_and_variance` after clipping to 0..swing
    (sensorCompute).

    The moments are sums over whole electron counts. For a given count, volts are treated as normal,
    which neglects that read noise times PRNU, 1e-2 of the read noise, is not. With read noise, PRNU
    and DSNU of 0 the result is that of ISETCam's noise flag 1, shot noise alone; that flag has no
    dark charge either.

    Parameters
    ----------
    electrons, dark_e : mean electrons of light and of dark current.
    readout : conversion gain in volts per electron, and the swing in volts.
    noise : read noise and DSNU in volts, PRNU relative.
    """
    count, weight = _counts(electrons + dark_e)
    swing_v = readout.swing_v
    middle = count * readout.conversion_gain_v_per_e
    width = np.sqrt(
        (noise.prnu * middle) ** 2 + noise.read_noise_v**2 * (1 + noise.prnu**2) + noise.dsnu_v**2
    )
    inside, low, high = _inside(middle, width, swing_v)

    def moment(order: int, about: float) -> float:
        within = sum(
            comb(order, j) * (middle - about) ** (order - j) * width**j * inside[j]
            for j in range(order + 1)
        )
        return float(
            weight @ (within + low * (0.0 - about) ** order + high * (swing_v - about) ** order)
        )

    mean = moment(1, 0.0)
    return ClippedNoise(
        mean, moment(2, mean), moment(4, mean), float(weight @ low), float(weight @ high)
    )


def _counts(mean_e: float) -> tuple[np.ndarray, np.ndarray]:
    """Return whole electron counts within about 12 standard deviations, and their probabilities, by
    ISETCam's rule (noiseShot).
    """
    from scipy.stats import poisson

    reach = 12 * np.sqrt(mean_e) + 12
    count = np.arange(max(0.0, np.floor(mean_e - reach)), np.ceil(mean_e + reach) + 1)
    if mean_e < NORMAL_FROM_E:
        return count, poisson.pmf(count, mean_e)
    return count, np.diff(ndtr((np.append(count, count[-1] + 1) - 0.5 - mean_e) / np.sqrt(mean_e)))


def _inside(
    middle: np.ndarray, width: np.ndarray, swing: float
) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
    """Return the integrals of z^j phi(z), j = 0..4, over volts between 0 and `swing`, and the
    probabilities of volts at or below 0 and at or above `swing`.
    """
    if not width.any():
        low = middle <= 0
        high = middle >= swing
        return [~(low | high), *(np.zeros(middle.shape),) * 4], low, high
    a = -middle / width
    b = (swing - middle) / width
    density_a, density_b = (np.exp(-0.5 * z * z) / np.sqrt(2 * np.pi) for z in (a, b))
    integrals = [ndtr(b) - ndtr(a), density_a - density_b]
    for j in range(2, 5):
        integrals.append(
            (j - 1) * integrals[j - 2] + a ** (j - 1) * density_a - b ** (j - 1) * density_b
        )
    return integrals, ndtr(a), ndtr(-b)


def _centres(count: int, pitch: float | np.ndarray) -> np.ndarray:
    return (np.arange(count) - (count - 1) / 2) * pitch

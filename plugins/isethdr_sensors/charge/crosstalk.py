"""Crosstalk: light and electrons that neighbouring pixels collect. The total of the means does not
change.

Each photon or electron moves independently, so the counts of all pixels stay independent Poisson
counts. Crosstalk therefore acts on the mean charge, before the shot noise, and causes no correlated
noise.

Light spreads by diffraction between the microlens and the silicon, more at longer wavelengths. The
share that reaches a neighbour is a power of the wavelength, with the exponent 1 if the diffraction
angle dominates (lambda / pitch; Catrysse and Wandell 2002, "Optical efficiency of image sensor
pixels"). It keeps the colour of the filter that it came through.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from isethdr_core.errors import ConfigError

from ..sensor_model import SensorModel
from ..spectral.colour_filter_array import channels, filter_map

OPTICAL = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]]) / 4  # through the side walls: edge neighbours
STATED_NM = 550.0  # wavelength at which the optical share is stated
LARGEST_SHARE = 0.8  # with 4 neighbours: a pixel keeps at least as much as each neighbour gets
# diffusion: corners are sqrt(2) away (assumption)
ELECTRICAL = np.array([[1, 4, 1], [4, 0, 4], [1, 4, 1]]) / 20


def kernel(optical_percent: float, electrical_percent: float) -> np.ndarray:
    """Return the (5, 5) share of a pixel's electrons that each pixel about it collects; the sum is
    1.
    """
    from scipy.signal import convolve2d

    centre = np.zeros((3, 3))
    centre[1, 1] = 1.0
    parts = [
        centre + share / 100 * (around - centre)
        for share, around in ((optical_percent, OPTICAL), (electrical_percent, ELECTRICAL))
    ]
    return convolve2d(*parts)


def stray_share(model: SensorModel, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the share of a pixel's light that its neighbours collect, per wavelength;
    `optical_crosstalk_percent` holds at 550 nm.
    """
    share = (
        model.optical_crosstalk_percent
        / 100
        * (np.asarray(wavelength_nm, float) / STATED_NM) ** model.optical_crosstalk_power
    )
    if np.any(share > LARGEST_SHARE):
        raise ConfigError(
            f"sensor.optical_crosstalk_percent={model.optical_crosstalk_percent:g} and"
            f" optical_crosstalk_power={model.optical_crosstalk_power:g} send"
            f" {100 * share.max():.3g} % of the light astray within"
            f" {np.min(wavelength_nm):g}..{np.max(wavelength_nm):g} nm; expected at most"
            f" {100 * LARGEST_SHARE:g} %; type a smaller sensor.optical_crosstalk_percent"
        )
    return share


def parts(qe: np.ndarray, model: SensorModel, wavelength_nm: np.ndarray) -> list[np.ndarray]:
    """Return the (channel, wavelength) electrons per photon that stay and that go astray as light;
    all of them where none does.

    Parameters
    ----------
    qe : quantum efficiency (channel, wavelength), electrons per photon.
    model : `SensorModel` with the share of optical crosstalk.
    wavelength_nm : centres of the bands (wavelength,), nm.
    """
    if not model.optical_crosstalk_percent:
        return [qe]
    share = stray_share(model, wavelength_nm)
    return [qe * (1 - share), qe * share]


def spread(parts_e: Sequence[np.ndarray], model: SensorModel) -> np.ndarray:
    """Return mean light electrons after crosstalk, (y, x), from those of `parts`; the border
    mirrors, so that the sum stays.
    """
    if not model.optical_crosstalk_percent and not model.electrical_crosstalk_percent:
        return parts_e[0]
    height, width = parts_e[0].shape
    out = np.zeros((height, width))
    for mean_e, around in zip(parts_e, _kernels(model)):
        wide = np.pad(mean_e, 2, mode="symmetric")
        # a plain sum of positive terms is never negative, even beside a lamp
        for dy, dx in np.ndindex(around.shape):
            if around[dy, dx]:
                out += around[dy, dx] * wide[dy : dy + height, dx : dx + width]
    return out


def mixed_efficiency(qe: np.ndarray, model: SensorModel, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the (channel, wavelength) electrons per photon of an evenly lit sensor, crosstalk
    between filters included.

    Pixels of one channel with unlike neighbours are averaged.

    Parameters
    ----------
    qe : quantum efficiency (channel, wavelength) without crosstalk, electrons per photon.
    model : `SensorModel` with the filter array and both kinds of crosstalk.
    wavelength_nm : centres of the bands (wavelength,), nm.
    """
    if not model.optical_crosstalk_percent and not model.electrical_crosstalk_percent:
        return qe
    # whole periods of 1, 2, 4, 5, 8, 10 pixels, far from the border in the middle
    filters = filter_map(model.cfa, 40, 40)
    out = np.zeros(np.shape(qe))
    for part, around in zip(parts(qe, model, wavelength_nm), _kernels(model)):
        share = np.zeros((len(channels(model.cfa)),) * 2)  # [channel, neighbour's channel]
        for dy, dx in np.argwhere(around):
            np.add.at(share, (filters, np.roll(filters, (2 - dy, 2 - dx), (0, 1))), around[dy, dx])
        out += share / share.sum(1, keepdims=True) @ part
    return out


def _kernels(model: SensorModel) -> list[np.ndarray]:
    """Return where the electrons of each of `parts` are collected: light that stays, light that
    goes astray.
    """
    return [kernel(optical, model.electrical_crosstalk_percent) for optical in (0.0, 100.0)]

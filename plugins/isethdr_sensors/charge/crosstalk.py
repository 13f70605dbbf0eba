"""Crosstalk: light and electrons that neighbouring pixels collect. The sum of the mean charges of
all pixels does not change.

Each photon or electron moves independently, so the counts of all pixels stay independent Poisson
counts. Crosstalk therefore acts on the mean charge, before the shot noise, and causes no correlated
noise.

Light spreads by diffraction between the microlens and the silicon, more at longer wavelengths. The
share that reaches a neighbour is a power of the wavelength, with the exponent 1 if the diffraction
angle dominates (lambda / pitch; Catrysse and Wandell 2002, "Optical efficiency of image sensor
pixels"). This light keeps the spectrum behind the filter that it passed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from isethdr_core.errors import ConfigError

from ..sensor_model import SensorModel
from ..spectral.colour_filter_array import cell, channels, filter_map

# shares of stray light by neighbour; light passes through side walls to the 4 nearest neighbours
OPTICAL = np.array([[0, 1, 0], [1, 0, 1], [0, 1, 0]]) / 4
STATED_NM = 550.0  # wavelength at which the optical share is stated
# largest optical share; with 4 neighbours, a pixel then keeps as much as each neighbour gets
LARGEST_SHARE = 0.8
# shares of diffusing electrons by neighbour; corners get less because they are sqrt(2) pixels away
# (assumption)
ELECTRICAL = np.array([[1, 4, 1], [4, 0, 4], [1, 4, 1]]) / 20
WRAPPED = 40  # smallest number of rows and columns over which neighbours are counted


def kernel(optical_percent: float, electrical_percent: float) -> np.ndarray:
    """Return the (5, 5) shares of a pixel's electrons that the pixel itself and its neighbours
    collect; the sum is 1.

    Parameters
    ----------
    optical_percent : share of light that reaches the 4 nearest neighbours.
    electrical_percent : share of electrons that diffuse to the 8 neighbours.
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
    """Return the share (wavelength,) of a pixel's light that its neighbours collect;
    `optical_crosstalk_percent` is the share at 550 nm.
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
    """Return the (channel, wavelength) electrons per photon of light that stays in its pixel, and
    of light that reaches a neighbour. Without optical crosstalk, return only the first.

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
    """Return mean light electrons after crosstalk, (y, x), from the electrons (y, x) of each of
    `parts`. The border is mirrored, so that the sum does not change.
    """
    if not model.optical_crosstalk_percent and not model.electrical_crosstalk_percent:
        return parts_e[0]
    height, width = parts_e[0].shape
    out = np.zeros((height, width))
    for mean_e, around in zip(parts_e, _kernels(model)):
        wide = np.pad(mean_e, 2, mode="symmetric")
        # a direct sum of positive terms is never negative, even next to a lamp
        for dy, dx in np.ndindex(around.shape):
            if around[dy, dx]:
                out += around[dy, dx] * wide[dy : dy + height, dx : dx + width]
    return out


def mixed_efficiency(qe: np.ndarray, model: SensorModel, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the (channel, wavelength) electrons per photon of a uniformly lit sensor, including
    crosstalk between filters.

    Pixels of one channel with different neighbours are averaged.

    Parameters
    ----------
    qe : quantum efficiency (channel, wavelength) without crosstalk, electrons per photon.
    model : `SensorModel` with the filter array and both kinds of crosstalk.
    wavelength_nm : centres of the bands (wavelength,), nm.
    """
    if not model.optical_crosstalk_percent and not model.electrical_crosstalk_percent:
        return qe
    # whole periods of the array, so that `roll` wraps around correctly
    pattern = cell(model.cfa)
    rows, columns = (-(-WRAPPED // side) * side for side in (len(pattern), len(pattern[0])))
    filters = filter_map(model.cfa, rows, columns)
    out = np.zeros(np.shape(qe))
    for part, around in zip(parts(qe, model, wavelength_nm), _kernels(model)):
        share = np.zeros((len(channels(model.cfa)),) * 2)  # [channel, neighbour's channel]
        for dy, dx in np.argwhere(around):
            np.add.at(share, (filters, np.roll(filters, (2 - dy, 2 - dx), (0, 1))), around[dy, dx])
        out += share / share.sum(1, keepdims=True) @ part
    return out


def _kernels(model: SensorModel) -> list[np.ndarray]:
    """Return the kernels of the electrons of each of `parts`: of light that stays, and of light
    that reaches a neighbour.
    """
    return [kernel(optical, model.electrical_crosstalk_percent) for optical in (0.0, 100.0)]

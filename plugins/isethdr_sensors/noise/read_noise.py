"""Read noise: one normal draw per pixel and reading, in electrons before the converter. It may make
a value negative.

Some pixels of a device form a tail: they have more read noise than the others, because of random
telegraph signals of their source followers. The rms over all pixels remains the stated one.
"""

from __future__ import annotations

from functools import lru_cache
from math import hypot, sqrt

import numpy as np

from isethdr_core.physics.detector import noise, random_words

from .fixed_pattern import chosen

TAIL_WIDTH = 5.0  # read noise of a pixel in the tail / that of the others (assumption)


def input_referred_e(
    floor_e: float, after_gain_uv: float, conversion_gain_uv_per_e: float, analog_gain: float
) -> float:
    """Return the read noise, electrons rms: a floor, and noise behind the analog gain divided by
    the gains in front of it.

    Both are independent, so their squares add up (EMVA 1288 release 4.0 counts both as dark noise).

    Parameters
    ----------
    floor_e : noise in front of the analog gain (pixel, source follower), electrons rms.
    after_gain_uv : noise of the circuits behind the analog gain, microvolts rms at their input.
    conversion_gain_uv_per_e : microvolts per electron at the floating diffusion.
    analog_gain : volts per volt, a multiplier.
    """
    return hypot(floor_e, after_gain_uv / (conversion_gain_uv_per_e * analog_gain))


def read_noise(
    read_noise_e: float | np.ndarray, stream: tuple, first_row: int, rows: int, columns: int
) -> np.ndarray:
    """Return (y, x) float32 electrons of zero mean and rms `read_noise_e` for `rows` rows from
    `first_row`.

    Parameters
    ----------
    read_noise_e : rms, electrons: a number, or the same rows of the (y, x) map of `widths_e`.
    stream : key of the noise of one reading in one shot.
    first_row : first row, counted from the sensor's upper left pixel.
    rows, columns : size of the block, pixels.
    """
    return read_noise_e * noise.normal_float32(
        random_words.words(stream, first_row, first_row + rows, 0, columns)
    )


@lru_cache(maxsize=8)
def widths_e(
    read_noise_e: float, tail_percent: float, stream: tuple, rows: int, columns: int
) -> np.ndarray:
    """Return the (y, x) float32 rms of every pixel's read noise, electrons.

    Parameters
    ----------
    read_noise_e : rms over all pixels, electrons.
    tail_percent : share of pixels with `TAIL_WIDTH` times the read noise of the others, 0 to 100.
    stream : key of the device's random numbers.
    rows, columns : size of the sensor, pixels.
    """
    share = tail_percent / 100
    body = read_noise_e / sqrt(1 - share + share * TAIL_WIDTH**2)
    out = np.full((rows, columns), body, np.float32)
    out[chosen(share, stream, rows, columns)] *= np.float32(TAIL_WIDTH)
    out.flags.writeable = False
    return out

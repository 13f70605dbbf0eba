"""The dark series of EMVA 1288: enough pictures without light to measure a fixed pattern that is
smaller than their noise.

At a low gain the pattern is a thousandth of the noise, so the mean needs thousands of pictures. All
captures and channels come from the same pictures, so the series is taken once per camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt
from typing import TYPE_CHECKING

import numpy as np
from isethdr_sensors.readout.shot import readings

from .camera import BORDER, DARK, STACK, Bench, Stack, picture_key

if TYPE_CHECKING:
    from isethdr_sensors.sensor_model import SensorModel

# standard error of the pattern's variance over that variance: 4 standard errors of the DSNU are
# 0.7 of it
SHARE = 1 / 3


@dataclass(frozen=True, eq=False)
class DarkSeries:
    """Mean of dark pictures and temporal variance of one picture, without the border."""

    mean_dn: np.ndarray  # (capture, y, x)
    temporal_dn2: np.ndarray  # (capture, y, x)
    filters: np.ndarray  # (y, x) channel of each pixel
    pictures: int

    def stack(self, capture: int, channel: int) -> Stack:
        """Return the stack of one capture and one channel.

        Parameters
        ----------
        capture, channel : numbers of both.
        """
        of_channel = self.filters == channel
        return Stack(
            self.mean_dn[capture][of_channel],
            float(np.mean(self.temporal_dn2[capture][of_channel])) / self.pictures,
            int(of_channel.sum()),
            self.pictures,
        )


def dark_series(bench: Bench, pictures: int) -> DarkSeries:
    """Return the average of dark pictures of the bench's sensor. They are the same pictures that
    `Bench.shot` takes.

    To save time, only the readings are simulated for each picture. Grid, filters and spectra of the
    light come from the first picture.

    Parameters
    ----------
    bench : camera and light.
    pictures : number of pictures.
    """
    model = bench.sensor.model()
    middle = slice(BORDER, -BORDER)
    filters = bench.sensor(bench.light(DARK), picture_key(bench, DARK, STACK))["filter"].values
    nothing = [np.zeros(filters.shape) for _ in model.photodiodes]
    total = 0.0
    squares = 0.0
    for k in range(pictures):
        raw, _ = readings(model, nothing, picture_key(bench, DARK, STACK + k))
        values = raw[:, middle, middle] - black_dn(model)
        total = total + values
        squares = squares + values**2
    mean = total / pictures
    return DarkSeries(
        mean + black_dn(model),
        (squares / pictures - mean**2) * (pictures / (pictures - 1)),
        filters[middle, middle],
        pictures,
    )


def black_dn(model: SensorModel) -> np.ndarray:
    """Return the black level (capture, 1, 1), DN. It is subtracted before squares are summed, so
    that they lose no digits.
    """
    return np.array([r.black_dn for r in model.readings], float)[:, None, None]


def pictures_needed(noise_dn2: float, pattern_dn2: float, pixels: int) -> int:
    """Return the number of pictures after which the relative error of the pattern's variance is
    `SHARE`, in closed form.

    The noise that remains in the mean of n pictures has the variance noise / n, which is known to a
    relative error of sqrt(2 / pixels). The number is planned from the sensor's fields and not from
    the pictures, because a series that ends when its result looks certain is biased.

    Parameters
    ----------
    noise_dn2 : temporal variance of one dark picture, DN^2.
    pattern_dn2 : variance of the fixed pattern, DN^2; 0: no pictures are needed.
    pixels : number of pixels.
    """
    return ceil(sqrt(2 / pixels) * noise_dn2 / (SHARE * pattern_dn2)) if pattern_dn2 > 0 else 0

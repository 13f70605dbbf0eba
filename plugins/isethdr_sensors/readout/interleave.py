"""Interleaving: pixels of one filter array that collect less light or expose for a shorter time,
written in lower case.
"""

from __future__ import annotations

import numpy as np

from ..sensor_model import SensorModel
from ..spectral.colour_filter_array import channels, filter_map


def dark_map(model: SensorModel, rows: int, columns: int) -> float | np.ndarray:
    """Return the (y, x) dark charge of every pixel relative to an upper case one, or the number 1.

    The black clamp puts darkness of both kinds of pixels at the level of the upper case pixels,
    like separate reference pixels for each exposure. The offset of the reading makes up for the
    lower dark charge.

    Parameters
    ----------
    model : `SensorModel` with the filter array, and the share of a lower case pixel.
    rows, columns : size of the sensor, pixels.
    """
    if model.lower_case_dark == 1.0:
        return 1.0
    share = np.array(
        [model.lower_case_dark if letter.islower() else 1.0 for letter in channels(model.cfa)]
    )
    return share[filter_map(model.cfa, rows, columns)]

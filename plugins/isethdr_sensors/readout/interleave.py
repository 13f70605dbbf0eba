"""Interleaving: some pixels of the filter array collect less light or expose for a shorter time.
Their filters are written in lower case.
"""

from __future__ import annotations

import numpy as np

from ..sensor_model import SensorModel
from ..spectral.colour_filter_array import channels, filter_map


def dark_map(model: SensorModel, rows: int, columns: int) -> float | np.ndarray:
    """Return the (y, x) dark charge of every pixel relative to an upper case pixel, or the number 1
    if all pixels have the same.

    The black clamp gives both kinds of pixels the dark level of the upper case pixels, as separate
    reference pixels for each exposure would. An offset of the reading compensates the lower dark
    charge.

    Parameters
    ----------
    model : `SensorModel` with the filter array, and the relative dark charge of lower case pixels.
    rows, columns : size of the sensor, pixels.
    """
    if model.lower_case_dark == 1.0:
        return 1.0
    share = np.array(
        [model.lower_case_dark if letter.islower() else 1.0 for letter in channels(model.cfa)]
    )
    return share[filter_map(model.cfa, rows, columns)]

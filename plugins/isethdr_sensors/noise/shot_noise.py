"""Shot noise: the Poisson count of light and dark electrons, drawn once per photodiode and
exposure.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from isethdr_core.physics.detector import noise

if TYPE_CHECKING:
    import numpy as np


def collect(mean_e: np.ndarray, stream: tuple, first_row: int) -> np.ndarray:
    """Return Poisson counts of electrons, (y, x) float64, of a block of rows of the sensor.

    Parameters
    ----------
    mean_e : mean electrons (y, x), 0 to 1e18.
    stream : key of the noise of one photodiode in one shot.
    first_row : first row of `mean_e`, counted from the sensor's upper left pixel.
    """
    return noise.poisson_image(mean_e, stream, first_row)

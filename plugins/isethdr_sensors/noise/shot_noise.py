"""Shot noise: the Poisson count of light and dark electrons, drawn once per photodiode and
exposure.
"""

from __future__ import annotations

from isethdr_core.physics.detector import noise


def collect(mean_e, stream: tuple, first_row: int):
    """Return whole electrons, (y, x) float64, for the mean of rows `first_row`... of the sensor."""
    return noise.poisson_image(mean_e, stream, first_row)

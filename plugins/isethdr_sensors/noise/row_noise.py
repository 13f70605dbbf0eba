"""Row noise: one normally distributed offset per row and reading, new in every shot. It comes from
the circuits that all pixels of a row share.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.detector import noise, random_words


def row_noise(row_noise_e: float, stream: tuple, first_row: int, rows: int) -> np.ndarray:
    """Return (rows, 1) float32 electrons of zero mean and rms `row_noise_e`, for the rows from
    `first_row`.

    Parameters
    ----------
    row_noise_e : rms over the rows, electrons.
    stream : key of the noise of one reading in one shot.
    first_row : first row, counted from the sensor's upper left pixel.
    rows : number of rows.
    """
    return np.float32(row_noise_e) * noise.normal_float32(
        random_words.words(stream, first_row, first_row + rows, 0, 1)
    )

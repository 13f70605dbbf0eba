"""Read noise: one normal draw per pixel and reading, in electrons before the converter. It may make a value negative."""

from __future__ import annotations

from isethdr_core.physics import noise, random_words


def read_noise(read_noise_e: float, stream: tuple, first_row: int, rows: int, columns: int):
    """Return (y, x) float32 electrons of zero mean and rms `read_noise_e` for `rows` rows from `first_row`."""
    return read_noise_e * noise.normal_float32(random_words.words(stream, first_row, first_row + rows, 0, columns))

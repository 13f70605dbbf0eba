"""Spectral curves: fitted curves of colour filters on silicon, and a user's own curve from a CSV
file.

Each filter is a sum of skewed Gaussians (amplitude, centre nm, width nm below the centre, width nm
above it). They are fitted by least squares to the curves of the AR0132AT data sheet, as ISETCam
distributes them: 380-780 nm in steps of 5 nm, relative to the largest peak. Residuals, rms and
largest: R 0.008 and 0.023, G 0.005 and 0.014, B 0.007 and 0.039, W 0.005 and 0.017. ISETCam's
public IMX363 curves are the same RGB shapes times 0.62.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from isethdr_core.data import csv_table
from isethdr_core.errors import ConfigError, did_you_mean

FIRST_LINE = "wavelength_nm,R,G,B"  # example of the first line of a table
FITTED_NM = (380.0, 780.0)  # range of the fitted curves

# {filter: skewed Gaussians}, see above
AR0132AT = {
    "R": (
        (0.235, 350.0, 300.0, 49.2),
        (0.084, 542.6, 38.0, 23.2),
        (0.877, 596.9, 12.0, 53.7),
        (0.404, 709.0, 46.5, 300.0),
    ),
    "G": (
        (0.110, 350.0, 92.2, 34.7),
        (0.571, 534.4, 17.2, 31.2),
        (0.531, 577.1, 54.7, 27.3),
        (0.092, 714.3, 72.3, 13.7),
        (0.248, 798.0, 52.7, 24.0),
    ),
    "B": (
        (0.438, 412.1, 22.9, 23.1),
        (0.762, 461.9, 26.8, 32.0),
        (0.111, 488.5, 14.0, 86.3),
        (0.061, 709.2, 46.3, 300.0),
    ),
    "W": ((0.632, 425.3, 58.4, 58.0), (0.347, 499.7, 40.7, 56.1), (0.894, 621.2, 73.6, 283.0)),
}


# Filters that the data sheet does not show are modelled as edges on the clear curve (assumption):
# C is clear like W, yellow transmits above 500 nm, and magenta all but a band around 540 nm. Edges
# of common dyes are about 30 nm wide (10 to 90 %).
LETTERS = (*AR0132AT, "C", "Y", "M")


def check_letters(letters: str | Sequence[str]) -> None:
    """Raise ConfigError for a letter without a curve.

    A lower case letter is the same filter on a less sensitive pixel.
    """
    for letter in letters:
        if letter.upper() not in LETTERS:
            raise ConfigError(
                f"no spectral curve for filter {letter!r} of"
                f" sensor.cfa{did_you_mean(letter, LETTERS)}; give your own with"
                " sensor.qe_csv=<file>"
            )


def filter_curve(letter: str, wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the relative quantum efficiency of a filter.

    Outside 380-780 nm it has the value at the end of this range.

    Raises
    ------
    ConfigError : the filter has no curve.
    """
    check_letters(letter)
    clipped_nm = np.clip(np.asarray(wavelength_nm, float), *FITTED_NM)
    if letter == "C":
        return filter_curve("W", clipped_nm)
    if letter == "Y":
        return filter_curve("W", clipped_nm) / (1.0 + np.exp((500.0 - clipped_nm) / 7.0))
    if letter == "M":
        return filter_curve("W", clipped_nm) * (
            1.0 - 0.9 * np.exp(-0.5 * ((clipped_nm - 540.0) / 35.0) ** 2)
        )
    return sum(
        a
        * np.exp(-0.5 * ((clipped_nm - centre) / np.where(clipped_nm < centre, below, above)) ** 2)
        for a, centre, below, above in AR0132AT[letter]
    )


def infrared_cut(wavelength_nm: np.ndarray) -> np.ndarray:
    """Return the transmittance of a camera's filter that blocks ultraviolet and infrared.

    It is a product of three edges, fitted to ISETCam's public measured filter at 380-780 nm. The
    residual is 0.020 rms, 0.051 at most.
    """
    nm = np.asarray(wavelength_nm, float)

    def edge(centre: float | np.ndarray, width: float | np.ndarray) -> float | np.ndarray:
        return 1.0 / (1.0 + np.exp(np.clip((nm - centre) / width, -700, 700)))

    return 0.98 * edge(414.16, -2.88) * edge(645.85, 31.16) * edge(685.37, 4.22)


def read_csv(path: str) -> dict[str, np.ndarray]:
    """Return the columns of a quantum efficiency table: `wavelength_nm` and one per filter,
    electrons per photon. They are those of the file as it is now.

    Raises
    ------
    ConfigError : the file cannot be read, is no table of numbers with commas, names a column twice,
        has no column wavelength_nm with finite, increasing values, or has a value outside 0..1.
    """
    try:
        columns = _columns(csv_table.read_text(path), path)
    except OSError as problem:
        raise ConfigError(
            f"sensor.qe_csv={path!r} cannot be read ({problem.strerror}); expected a CSV file"
        ) from problem
    except ValueError as problem:
        raise ConfigError(f"sensor.qe_csv={path!r} {problem}") from None
    if "wavelength_nm" not in columns or len(columns) < 2:
        raise ConfigError(
            f"sensor.qe_csv={path!r} has columns {list(columns)}; expected wavelength_nm and one"
            " per filter, e.g. R,G,B"
        )
    nm = columns["wavelength_nm"]
    if len(nm) < 2 or not np.all(np.isfinite(nm)) or np.any(np.diff(nm) <= 0):
        raise ConfigError(
            f"sensor.qe_csv={path!r}: wavelength_nm must hold at least two finite, increasing"
            " values"
        )
    values = np.stack([column for name, column in columns.items() if name != "wavelength_nm"])
    if not np.all((values >= 0) & (values <= 1)):
        raise ConfigError(
            f"sensor.qe_csv={path!r} holds values {values.min():g}..{values.max():g}; "
            "expected electrons per photon within 0..1"
        )
    return columns


@lru_cache(maxsize=8)
def _columns(text: str, path: str) -> dict[str, np.ndarray]:
    """Return the columns of a table of numbers under one header line, by name. The result is cached
    and must not be changed.
    """
    return csv_table.columns_of(text, path, FIRST_LINE)

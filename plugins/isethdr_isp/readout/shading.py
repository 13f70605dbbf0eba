"""Shading: the relative illumination of the lens, by which every sample is divided.

The lens states it, or it is measured on a flat field. A measured table has `radius_mm`, the
distance from the axis on the sensor, and the illumination relative to the axis. Four even powers of
the radius fit any lens without sharp vignetting.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.data import csv_table
from isethdr_core.errors import ConfigError, UnitError

from ..spectra import light
from .captures_check import check_captures
from .electrons import chosen, falloff, readouts

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

POWERS = (0, 2, 4, 6, 8)  # powers of the radius in the fit
ENTRIES = 65  # number of rows of a measured table
COLUMNS = ("radius_mm", "relative_illumination")


def shading(captures: xr.Dataset, path: str = "") -> np.ndarray:
    """Return the relative illumination (y, x) of the pixels of a sensor.

    Parameters
    ----------
    captures : the captures Dataset.
    path : file with a measured table; empty: the illumination that the lens states.

    Raises
    ------
    ConfigError : the file is no table of two columns with increasing radii and values above 0.
    UnitError : some pixels lie beyond the table.
    """
    if not path:
        return falloff(captures)
    radius_mm, relative = read_shading(path)
    radius_of_pixels = radii_mm(captures)
    if radius_of_pixels.max() > radius_mm[-1] * (1 + 1e-6):
        raise UnitError(
            f"isp.shading_csv={path!r} ends at {radius_mm[-1]:g} mm; expected up to"
            f" {radius_of_pixels.max():g}"
            " mm, the corner of this sensor; measure it on the whole sensor"
        )
    return np.interp(radius_of_pixels, radius_mm, relative)


def radii_mm(captures: xr.Dataset) -> np.ndarray:
    """Return the distance (y, x) of every pixel from the axis, mm on the sensor."""
    return 1e3 * np.hypot(captures.x.values[None, :], captures.y.values[:, None])


def measured_shading(
    captures: xr.Dataset, capture: str = ""
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (radius_mm, relative, standard_error) of a lens, each (entry,), from captures of a
    flat field.

    An even polynomial of the radius is fitted to each channel. All samples have the same weight, so
    that noise causes no bias. Each fit is divided by its value on the axis. The result is the mean
    of these curves over the channels, weighted by the electrons of the channels.

    Parameters
    ----------
    captures : the captures Dataset of the flat field.
    capture : name of the capture to use; empty takes the first.

    Raises
    ------
    UnitError : samples are saturated, or the field is too dark: a channel has no light on the axis,
        or the standard error at the border exceeds 2 %.
    """
    check_captures(captures)
    single = chosen(captures, capture)
    [read] = readouts(single, light("daylight", single.wavelength.values))
    if read.saturated.any():
        raise UnitError(
            f"{read.saturated.mean():.1%} of the flat field is saturated; expected none; expose"
            " less"
        )
    radius = radii_mm(single)
    filters = single["filter"].values
    largest = max(float(radius.max()), 1e-12)
    grid = np.linspace(0, 1, ENTRIES)
    basis = np.stack([(radius / largest) ** p for p in POWERS], -1)
    at = np.stack([grid**p for p in POWERS], -1)
    total = variance = weight = 0.0
    for channel in np.unique(filters):
        of_channel = filters == channel
        a = basis[of_channel]
        e = (read.charge_e - read.dark_e)[of_channel]
        inverse = np.linalg.pinv(a)
        fit = inverse @ e
        spread = (inverse * read.variance_e2()[of_channel]) @ inverse.T
        if not fit[0] > 0:
            raise UnitError(
                f"channel {channel} of the flat field is dark on the axis; expected light"
                " everywhere"
            )
        curve = at @ fit / fit[0]
        # derivative of the curve with respect to the fit; at[0] is the axis
        step = (at - curve[:, None] * at[:1]) / fit[0]
        sum_e = float(e.sum())
        total = total + sum_e * curve
        weight = weight + sum_e
        variance = variance + sum_e**2 * np.einsum("ip,pq,iq->i", step, spread, step)
    relative = total / weight
    error = np.sqrt(variance) / weight
    if error[-1] > 0.02 * relative[-1] or not np.all(relative > 0):
        raise UnitError(
            f"the flat field gives {relative[-1]:.3g} +- {error[-1]:.2g} on its border; expected 2"
            " % or better; expose more"
        )
    return grid * largest, relative, error


def write_shading(path: Path, radius_mm: ArrayLike, relative: ArrayLike) -> None:
    """Write a measured table for `isp.shading_csv`.

    Parameters
    ----------
    path : file to write.
    radius_mm : (row,) distance from the axis on the sensor plane.
    relative : (row,) relative illumination.
    """
    with open(path, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(zip(np.asarray(radius_mm).tolist(), np.asarray(relative).tolist()))


def read_shading(path: str | Path) -> tuple[np.ndarray, np.ndarray]:
    """Return (radius_mm, relative), the columns of a table.

    Raises
    ------
    ConfigError : the file cannot be read, or is no such table.
    """
    try:
        columns = csv_table.columns_of(csv_table.read_text(path), path, ",".join(COLUMNS))
    except OSError as err:
        raise ConfigError(
            f"isp.shading_csv={str(path)!r} cannot be read ({err}); expected the columns"
            f" {', '.join(COLUMNS)}"
        ) from None
    except ValueError as err:
        raise ConfigError(f"isp.shading_csv={str(path)!r} {err}") from None
    if tuple(columns) != COLUMNS:
        raise ConfigError(
            f"isp.shading_csv={str(path)!r} has the columns {', '.join(columns)}; expected a first"
            f" line {','.join(COLUMNS)}"
        )
    radius_mm, relative = columns.values()
    if (
        len(radius_mm) < 2
        or not np.all(np.isfinite([radius_mm, relative]))
        or np.any(np.diff(radius_mm) <= 0)
        or not np.all(relative > 0)
    ):
        raise ConfigError(
            f"isp.shading_csv={str(path)!r} holds values that no lens has; expected two or more"
            f" lines of finite numbers, with rising {COLUMNS[0]}, and {COLUMNS[1]} above 0"
        )
    return radius_mm, relative

"""Picture rounding: pictures in float32 with no more bits than their noise justifies.

Bits below the noise of a pixel contain no information and cannot be compressed. Each value is
rounded to a multiple of a power of two that follows from its own variance. The rest of its mantissa
is then the same along a whole row and compresses to almost nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr
    from xarray.core.variable import Variable

# equals `reference_picture.FIXED_PATTERN`, without the imports of that module
FIXED_PATTERN = "fixed_pattern_variance"
ROUNDING = "rounding"  # attribute of a rounded variable: its largest error
SHARE_OF_SIGMA = 1 / 20  # largest rounding error of a value, in its standard deviations
# largest rounding error of a denoised value, in standard deviations before denoising: denoised
# values are means of about a hundred values
DENOISED_SHARE = SHARE_OF_SIGMA / 10
# numbers of mantissa bits that are kept
EXACT_BITS = 16  # for a value without variance: relative error 2^-17
LUMINANCE_BITS = 7  # for the variance of Y, which every score reads: relative error 2^-8
COLOUR_BITS = 2  # for the variances of X and Z: relative error 2^-3
FIXED_PATTERN_BITS = 6  # for the fixed pattern's variance: error 2^-7 of the total variance
# number of grids for Y; rows take them in turn. More grids make medians more accurate, but take
# more disk if neighbouring pixels have grids of different spacing
ROW_SHIFTS = {"xyz": 8, "variance": 64, FIXED_PATTERN: 1}
TINY = np.finfo(np.float64).tiny
EXPONENT = np.int64(0x7FF0_0000_0000_0000)  # exponent bits of a float64; alone, a power of two
NOTES = {
    "xyz": "at most 1/20 of the standard deviation; without variance 2^-17, relative",
    "variance": "at most 2^-8 (Y) and 2^-3 (X and Z), relative",
    FIXED_PATTERN: "at most 2^-7 (Y) and 2^-3 (X and Z) of the total variance",
}


UNDENOISED = "undenoised_"  # equals `reference_picture.UNDENOISED`
DENOISED_NOTE = "at most 1/200 of the standard deviation before denoising"


def rounded_picture(ds: xr.Dataset) -> dict:
    """Return the rounded variables of a picture, by name; empty if `ds` is no picture.

    Parameters
    ----------
    ds : Dataset in memory. A picture has `xyz` with the dimension `xyz_channel`, and may have
        `variance` and `fixed_pattern_variance` of the same shape.

    Returns
    -------
    dict : float32 variables, each with the attribute `ROUNDING`.

    Notes
    -----
    The luminances of neighbouring rows are rounded to grids that are shifted against each other.
    The largest error is the same, but medians and shares over many pixels do not fall on one grid.
    Values that float32 itself resolves less well are only as exact as float32.
    """
    variables = {n: ds.variables[n] for n in NOTES if n in ds.variables}
    rounded_notes = _rounded(variables, ds.variables.get(UNDENOISED + "variance"))
    undenoised_names = {n: UNDENOISED + n for n in NOTES if UNDENOISED + n in ds.variables}
    rounded = _rounded({n: ds.variables[long] for n, long in undenoised_names.items()})
    return rounded_notes | {undenoised_names[n]: variable for n, variable in rounded.items()}


def _rounded(variables: dict, before_denoising: Variable | None = None) -> dict:
    """Return the rounded variables of one picture by name; empty if they are no picture.

    Parameters
    ----------
    variables : variables of the picture, by name.
    before_denoising : the variance before denoising, of the same shape; None if there is none.
    """
    if "xyz" not in variables or variables["xyz"].dims[-1:] != ("xyz_channel",):
        return {}
    if any(v.dims != variables["xyz"].dims or v.dtype.kind != "f" for v in variables.values()):
        return {}
    values = {name: variable.values.astype(np.float64) for name, variable in variables.items()}
    denoised = before_denoising is not None and before_denoising.dims == variables["xyz"].dims
    denoised = denoised and not ("variance" in values and np.isfinite(values["variance"]).any())
    rounded = {}
    for name, variable in variables.items():
        quanta = _quanta(name, values)
        note = NOTES[name]
        if name == "xyz" and denoised:
            quanta = _by_variance(values[name], before_denoising.values, DENOISED_SHARE)
            note = DENOISED_NOTE
        values_on_grid = _on_grids(values[name], quanta, ROW_SHIFTS[name])
        rounded[name] = variable.copy(deep=False, data=values_on_grid)
        rounded[name].attrs = {**variable.attrs, ROUNDING: note}
    return rounded


def _quanta(name: str, values: dict) -> np.ndarray:
    """Return the spacing of the grid to which each value of the variable `name` is rounded."""
    xyz = values["xyz"]
    variance = values.get("variance")
    if name == "xyz":
        return _by_variance(xyz, variance, SHARE_OF_SIGMA)
    total = variance
    luminance_bits = LUMINANCE_BITS
    if name == FIXED_PATTERN:
        total = values[name] + (0.0 if variance is None else np.nan_to_num(variance))
        luminance_bits = FIXED_PATTERN_BITS
    quanta = np.empty(total.shape)
    quanta[..., ::2] = _relative(total[..., ::2], COLOUR_BITS)
    quanta[..., 1] = _relative(total[..., 1], luminance_bits)
    return quanta


def _by_variance(values: np.ndarray, variance: np.ndarray | None, share: float) -> np.ndarray:
    """Return the spacing of a grid that rounds by at most `share` of the standard deviation. Values
    without variance get the spacing of `EXACT_BITS`.
    """
    if variance is None:
        return _relative(values, EXACT_BITS)
    noisy = np.isfinite(variance) & (variance > 0)
    sigma = np.sqrt(np.where(noisy, variance, 1.0))
    quanta = _power_of_two(2 * share * sigma)
    if not noisy.all():
        quanta[~noisy] = _relative(values[~noisy], EXACT_BITS)
    return quanta


def _relative(values: np.ndarray, bits: int) -> np.ndarray:
    """Return the spacing of numbers with `bits` mantissa bits at each value."""
    return _power_of_two(np.where(np.isfinite(values), np.abs(values), 1.0)) * 2.0**-bits


def _power_of_two(values: np.ndarray) -> np.ndarray:
    """Return the largest power of two that is at most each value above 0."""
    whole = np.maximum(values, TINY * 2.0**64)
    return (whole.view(np.int64) & EXPONENT).view(np.float64)


def _on_grids(values: np.ndarray, quanta: np.ndarray, row_shifts: int) -> np.ndarray:
    """Return float32 values (y, x, 3) on grids of the spacing `quanta`, shifted by row for Y."""
    on_grid = np.empty(values.shape, np.float32)
    shifts = _shifts(len(values), row_shifts)[:, None]
    for channel in range(values.shape[-1]):
        plane = values[..., channel]
        quantum = quanta[..., channel]
        shift = shifts if channel == 1 else 0.0
        representable = np.isfinite(plane)
        representable &= plane != 0  # 0 is kept exactly: it means no light, or no variance
        grid = np.where(representable, plane, 0.0) * (1 / quantum) - shift
        np.rint(grid, out=grid)
        grid += shift
        grid *= quantum
        on_grid[..., channel] = np.where(representable, grid, plane)
    return on_grid


def _shifts(rows: int, count: int) -> np.ndarray:
    """Return the shift of each row's grid, in spacings: `count` values from 0 to 1, in turn.

    The order is that of row numbers with their bits reversed, so that neighbours are far apart.
    """
    row = np.arange(rows)
    shift = np.zeros(rows)
    for bit in range(count.bit_length() - 1):
        shift += ((row >> bit) & 1) * 2.0 ** -(bit + 1)
    return shift

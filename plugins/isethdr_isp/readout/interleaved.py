"""Interleaved: one capture in which some pixels of the filter array collect less light. Its two
kinds of pixels are merged and interpolated in one step.

Every colour has a long sample t at its upper case pixels and a short sample z at its lower case
pixels, never both at one pixel. Let G be the weight of `combine`, A = t G(t) - v G'(t) - d G(t + 1)
and B = 1 - G(t + 1). Let U be the linear interpolation from the upper case pixels, and z' the
linear interpolation of z from the lower case pixels to every pixel. Then

    x = U[A + z' B] + U[B] (z' - U[z'])

t and z come from different pixels and are independent. The mean of x is therefore the signal on
every linear ramp, for any G. The last term keeps the detail of the short samples where they are
used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.errors import UnitError

from ..demosaic.interpolation import demosaic
from ..spectra import Illuminant, light
from .combine import read_charge, weight
from .electrons import Readout, charge_variance, readouts
from .fixed_pattern import fixed_pattern
from .shading import shading

if TYPE_CHECKING:
    import xarray as xr


def is_interleaved(captures: xr.Dataset) -> bool:
    """Return whether some colour is sampled by both upper and lower case pixels."""
    return has_two_cases({str(name) for name in captures["channel"].values})


def has_two_cases(names: set[str]) -> bool:
    """Return whether some colour among the names of filters is in upper and in lower case."""
    return any(name.islower() and name.upper() in names for name in names)


class Interleaved(NamedTuple):
    """A merged capture of two exposures."""

    planes: np.ndarray  # (channel, y, x) electrons
    variances: np.ndarray  # (channel, y, x) temporal variance, e^2
    fixed: np.ndarray  # (channel, y, x) variance of the fixed pattern, e^2
    valid: np.ndarray  # (y, x) bool
    response: np.ndarray  # (channel, wavelength) electrons per band mean radiance
    read: Readout


def merge_interleaved(
    captures: xr.Dataset, balance: Illuminant, shading_csv: str = ""
) -> Interleaved:
    """Return the capture in electrons of upper case pixels, with one channel per colour.

    A colour with letters of only one case keeps its channel. Dark charge is subtracted, and
    electrons are divided by the relative illumination of the lens.

    Parameters
    ----------
    captures : a captures Dataset with one capture.
    balance : light in which grey is reproduced exactly.
    shading_csv : file with measured relative illumination; empty: the illumination that the lens
        states.

    Raises
    ------
    UnitError : there are several captures, or a filter transmits no light of `balance`.
    """
    if captures.sizes["capture"] != 1:
        raise UnitError(
            f"a shot of {captures.sizes['capture']} captures has upper and lower case filters;"
            " expected one capture; choose one with captures.isel(capture=[0])"
        )
    [read] = readouts(captures, light(balance, captures.wavelength.values))
    names = [str(name) for name in captures["channel"].values]
    filters = captures["filter"].values
    colours = [name for name in names if name.isupper() or name.upper() not in names]
    pairs = {
        names.index(c): names.index(c.lower())
        for c in colours
        if c.isupper() and c.lower() in names
    }
    faint = [names[k] for pair in pairs.items() for k in pair if not read.sensitivity[k] > 0]
    if faint:
        raise UnitError(
            f"filter {', '.join(faint)} transmits no light of {balance}, so its pixels cannot be"
            " compared; expected a quantum efficiency above 0 somewhere in the bands"
        )
    level = shading(captures, shading_csv)
    lit = level > 0  # other pixels get no light through the lens, and are not valid
    level = np.where(lit, level, 1.0)
    ratio_of = np.ones(len(names))
    for long, short in pairs.items():
        ratio_of[long] = ratio_of[short] = read.sensitivity[short] / read.sensitivity[long]
    ratio = ratio_of[filters]
    long_here = np.isin(filters, list(pairs))
    charge = read_charge([read], read.sensitivity[filters])

    # each sample alone; short samples are converted to electrons of long samples
    scale = np.where(long_here, 1.0, ratio) * level
    single = (charge.t_e - charge.dark_e) / scale
    single_var = charge_variance(charge.t_e, charge.read_var_e2) / scale**2
    g, slope = weight(charge.t_e, charge, charge, ratio)
    g_next, _ = weight(charge.t_e + 1, charge, charge, ratio)
    part = (charge.t_e * g - charge.read_var_e2 * slope - charge.dark_e * g_next) / level

    # each sample has its own silicon; deviations that columns or rows share are treated as
    # independent
    pattern = fixed_pattern(list(charge.reads), single * scale, single_var * scale**2).scaled(
        1 / scale
    )
    single_fixed = pattern.total_e2() + np.zeros(filters.shape)

    alone, alone_var, invalid = demosaic(
        single, filters, len(names), single_var, (~charge.good & ~long_here) | ~lit
    )
    alone_fixed = demosaic(single, filters, len(names), single_fixed)[1]
    short_there = np.zeros(filters.shape)
    for long, short in pairs.items():
        short_there[filters == long] = alone[short][filters == long]
    blended, _, _ = demosaic(part + short_there * (1 - g_next), filters, len(names))
    share_short, _, _ = demosaic(1 - g_next, filters, len(names))
    share_of_short, _, _ = demosaic(short_there, filters, len(names))
    long_var, long_fixed = (
        demosaic(part, filters, len(names), g**2 * np.where(long_here, of_sample, 0.0))[1]
        for of_sample in (single_var, single_fixed)
    )
    planes, variances, fixed = np.empty((3, len(colours), *filters.shape))
    for plane, colour in enumerate(colours):
        k = names.index(colour)
        if k in pairs:
            short = pairs[k]
            planes[plane] = blended[k] + share_short[k] * (alone[short] - share_of_short[k])
            variances[plane] = long_var[k] + share_short[k] ** 2 * alone_var[short]
            fixed[plane] = long_fixed[k] + share_short[k] ** 2 * alone_fixed[short]
        else:
            planes[plane], variances[plane], fixed[plane] = alone[k], alone_var[k], alone_fixed[k]
    return Interleaved(
        planes, variances, fixed, ~invalid, read.response[[names.index(c) for c in colours]], read
    )

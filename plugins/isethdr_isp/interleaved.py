"""Interleaved: one capture in which some pixels of the filter array collect less, merged with the interpolation.

Every colour has a long sample t at its upper case pixels and a short one at its lower case pixels, never both at one place. With
the weight G of `combine`, A = t G(t) - v G'(t) - d G(t + 1), B = 1 - G(t + 1), and the linear interpolations U from the upper case
pixels and L from the lower case ones, L taking z to z' at every pixel,

    x = U[A + z' B] + U[B] (z' - U[z'])

t and z come from different pixels and are independent, so the mean of x is the signal on every linear ramp, whatever G. The last
term keeps the detail of the short samples where they count.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.errors import UnitError

from .combine import read_charge, weight
from .demosaic import demosaic
from .readout import charge_variance, readouts
from .shading import shading
from .spectra import light


def is_interleaved(captures) -> bool:
    """Return whether some colour is sampled both by upper and by lower case pixels."""
    names = {str(name) for name in captures["channel"].values}
    return any(name.islower() and name.upper() in names for name in names)


def merge_interleaved(captures, balance: str, shading_csv: str = ""):
    """Return (planes, variances, valid, response, read): electrons (channel, y, x) of upper case pixels, one channel per colour.

    A colour that comes in one case alone keeps it. Electrons are freed of dark charge and of the lens's falloff; response is
    (channel, wavelength) electrons per band mean radiance; read is the one `Readout`.
    """
    if captures.sizes["capture"] != 1:
        raise UnitError(f"a shot of {captures.sizes['capture']} captures has upper and lower case filters; expected one capture; "
                        "choose one with captures.isel(capture=[0])")
    [read] = readouts(captures, light(balance, captures.wavelength.values))
    names, filters = [str(name) for name in captures["channel"].values], captures["filter"].values
    colours = [name for name in names if name.isupper() or name.upper() not in names]
    pairs = {names.index(c): names.index(c.lower()) for c in colours if c.isupper() and c.lower() in names}
    faint = [names[k] for pair in pairs.items() for k in pair if not read.sensitivity[k] > 0]
    if faint:
        raise UnitError(f"filter {', '.join(faint)} passes nothing of {balance}, so its pixels cannot be compared; expected a quantum "
                        "efficiency above 0 somewhere in the bands")
    level = shading(captures, shading_csv)
    ratio_of = np.ones(len(names))
    for long, short in pairs.items():
        ratio_of[long] = ratio_of[short] = read.sensitivity[short] / read.sensitivity[long]
    ratio, long_here = ratio_of[filters], np.isin(filters, list(pairs))
    charge = read_charge([read], read.sensitivity[filters])

    # every sample by itself, short ones in electrons of long ones
    scale = np.where(long_here, 1.0, ratio) * level
    single, single_var = (charge.t_e - charge.dark_e) / scale, charge_variance(charge.t_e, charge.read_var_e2) / scale**2
    g, slope = weight(charge.t_e, charge, charge, ratio)
    g_next, _ = weight(charge.t_e + 1, charge, charge, ratio)
    part = (charge.t_e * g - charge.read_var_e2 * slope - charge.dark_e * g_next) / level

    alone, alone_var, touched = demosaic(single, filters, len(names), single_var, ~charge.good & ~long_here)
    short_there = np.zeros(filters.shape)
    for long, short in pairs.items():
        short_there[filters == long] = alone[short][filters == long]
    blended, _, _ = demosaic(part + short_there * (1 - g_next), filters, len(names))
    rest, _, _ = demosaic(1 - g_next, filters, len(names))
    again, _, _ = demosaic(short_there, filters, len(names))
    _, long_var, _ = demosaic(part, filters, len(names), g**2 * np.where(long_here, single_var, 0.0))
    planes, variances = np.empty((2, len(colours), *filters.shape))
    for place, colour in enumerate(colours):
        k = names.index(colour)
        if k in pairs:
            z, z_var = alone[pairs[k]], alone_var[pairs[k]]
            planes[place] = blended[k] + rest[k] * (z - again[k])
            variances[place] = long_var[k] + rest[k] ** 2 * z_var
        else:
            planes[place], variances[place] = alone[k], alone_var[k]
    return planes, variances, ~touched, read.response[[names.index(c) for c in colours]], read

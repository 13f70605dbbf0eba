"""Scene light: the known light, or mixture of two, in which a shot was taken.

The mean colour of all cells without lamps is taken for grey (Buchsbaum 1980), in the channels of
the sensor. The light of the scene is the mixture whose white has the most similar channel ratios.
White balance and colour matrix follow it.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger

from .demosaic.interpolation import array_period
from .readout.electrons import Readout, readouts
from .spectra import LIGHTS, Illuminant, Mixture, light

if TYPE_CHECKING:
    import xarray as xr

AUTOMATIC = "automatic"
REFERENCE = "daylight"  # captures are compared in this light; also the answer where nothing is seen
# a cell brighter than this multiple of the percentile is a lamp, or its glare
LAMP_PERCENTILE = 95.0
LAMP_MULTIPLE = 2.0
STEPS = 100  # of a mixture's share


def illuminant(captures: xr.Dataset, balance: str) -> Illuminant:
    """Return the light that `balance` names, or for "automatic" the one found in `captures`. The
    ledger states how well its channel ratios fit.
    """
    if balance != AUTOMATIC:
        return balance
    wavelength_nm = captures.wavelength.values
    reads = readouts(captures, light(REFERENCE, wavelength_nm))
    means = channel_means(reads, captures["filter"].values, captures.sizes["channel"])
    if means is None:
        return REFERENCE
    mixture, distance = nearest_mixture(means, reads[0], wavelength_nm)
    ledger.error(
        distance,
        "relative",
        "measured",
        f"channel ratios of the frame against those of {mixture}, automatic white balance",
    )
    return mixture


def channel_means(reads: list[Readout], filters: np.ndarray, channels: int) -> np.ndarray | None:
    """Return the mean of each channel over the cells of the filter array that hold no lamp and no
    saturated sample, in cd/m2 of daylight; None of one channel, or where some mean is not above 0.

    Each sample comes from the most sensitive capture that measures it.

    Parameters
    ----------
    reads : readouts of the captures.
    filters : (y, x) number of the channel that each pixel samples.
    channels : number of channels.
    """
    if channels < 2 or not all(np.all(read.sensitivity > 0) for read in reads):
        return None
    level = np.full(filters.shape, np.nan)
    for read in sorted(reads, key=lambda r: (float(np.mean(r.sensitivity)), -r.top_e)):
        use = ~read.saturated & (read.charge_e < read.clear_top_e)
        level[use] = ((read.charge_e - read.dark_e) / read.sensitivity[filters])[use]
    rows, columns = array_period(filters)
    height, width = (size // side * side for size, side in zip(filters.shape, (rows, columns)))
    shape = height // rows, rows, width // columns, columns
    cells = np.moveaxis(level[:height, :width].reshape(shape), 2, 1)
    bright = cells.mean((2, 3))
    finite = np.isfinite(bright)
    if not finite.any():
        return None
    limit = LAMP_MULTIPLE * max(float(np.percentile(bright[finite], LAMP_PERCENTILE)), 0.0)
    grey = cells[finite & (np.nan_to_num(bright) <= limit)].mean(0)
    channel_of = filters[:rows, :columns]
    means = np.array(
        [grey[channel_of == c].mean() for c in range(channels) if np.any(channel_of == c)]
    )
    return means if len(means) == channels and np.all(means > 0) else None


def nearest_mixture(
    means: np.ndarray, read: Readout, wavelength_nm: np.ndarray
) -> tuple[Mixture, float]:
    """Return the mixture of two lights whose white has the channel ratios of `means`, and how far
    these are apart: rms over channels of the logarithm's difference.

    Parameters
    ----------
    means : (channel,) in units of the white for which `read` states its sensitivity.
    read : a readout of the captures, for response and sensitivity.
    wavelength_nm : centres of the bands.
    """
    white = np.array([read.response @ light(name, wavelength_nm) for name in LIGHTS])
    white /= read.sensitivity
    share = np.linspace(0.0, 1.0, STEPS + 1)[:, None]
    best = Mixture(REFERENCE, REFERENCE, 0.0)
    least = np.inf
    for a, b in combinations(range(len(LIGHTS)), 2):
        log_ratios = np.log((1 - share) * white[a] + share * white[b]) - np.log(means)
        rms = log_ratios.std(axis=1)  # the level is free
        k = int(rms.argmin())
        if rms[k] < least:
            best = Mixture(LIGHTS[a], LIGHTS[b], float(share[k, 0]))
            least = float(rms[k])
    return best, least

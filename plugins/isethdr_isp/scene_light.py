"""Scene light: an estimate of the light in which a shot was taken, as one known light or a mixture
of two.

The mean of all cells without lamps is assumed to be grey (Buchsbaum 1980), in the channels of the
sensor. Of all mixtures of two known lights, the one with the most similar channel ratios of white
is the light of the scene. White balance and colour matrix use it. Tungsten light (`incandescent`)
is mixed with halogen only, and selected only if it is clearly nearer than every other mixture.
"""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger

from .demosaic.interpolation import array_period
from .readout.electrons import Readout, readouts
from .spectra import LIGHTS, Illuminant, Light, Mixture, light

if TYPE_CHECKING:
    import xarray as xr

AUTOMATIC = "automatic"
# light in which captures are compared; also the result if the light cannot be estimated
REFERENCE = "daylight"
# a cell that is brighter than this multiple of this percentile is a lamp or its glare
LAMP_PERCENTILE = 95.0
LAMP_MULTIPLE = 2.0
STEPS = 100  # number of steps of the share of the second light in a mixture
# Tungsten lamps. A sensor without separate green and red sees them nearly as it sees halogen with
# sodium, so their channel ratios must be nearer by this difference of the distances.
TUNGSTEN: tuple[Light, Light] = ("halogen", "incandescent")
TUNGSTEN_MARGIN = 0.003


def illuminant(captures: xr.Dataset, balance: str) -> Illuminant:
    """Return the light `balance`, or for "automatic" the light estimated from `captures`. The
    ledger states the error of its channel ratios.
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
    """Return the mean (channel,) of each channel over the cells of the filter array without lamps
    and saturated samples, in cd/m2 of daylight. Return None for a single channel, for a filter
    without response, or if a mean is not above 0.

    Each sample comes from the most sensitive capture that is not saturated there.

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
    """Return the mixture of two lights with channel ratios of white nearest to those of `means`,
    and the distance: the standard deviation over channels of the difference of logarithms.

    Parameters
    ----------
    means : (channel,) in units of the white to which the sensitivity of `read` refers.
    read : a readout of the captures, for response and sensitivity.
    wavelength_nm : (wavelength,) centres of the bands, nm.
    """
    white = {
        name: read.response @ light(name, wavelength_nm) / read.sensitivity
        for name in (*LIGHTS, *TUNGSTEN)
    }
    share = np.linspace(0.0, 1.0, STEPS + 1)[:, None]
    best = Mixture(REFERENCE, REFERENCE, 0.0)
    least = np.inf
    for pair in (*combinations(LIGHTS, 2), TUNGSTEN):
        first, second = pair
        log_ratios = np.log((1 - share) * white[first] + share * white[second]) - np.log(means)
        rms = log_ratios.std(axis=1)  # a common factor of all channels does not count
        k = int(rms.argmin())
        margin = TUNGSTEN_MARGIN if pair == TUNGSTEN else 0.0
        if rms[k] < least - margin:
            best = Mixture(first, second, float(share[k, 0]))
            least = float(rms[k])
    return best, least

"""Lens errors: what a lens knows, tile by tile, of how wrong its light of one scene is."""

from __future__ import annotations

import numpy as np

from ..data.temporal_modulation import DIM
from ..pipeline import bands, window
from ..plugins.protocols import StatesErrors
from .earlier_terms import maps_of


def asked_of(lens, flares, cameras, demand, mixed):
    """Return function(mean light, weights) -> `ErrorMaps` or None, as `lens.spread_errors` returns;
    None where a lens cannot say.

    Parameters
    ----------
    demand : None where nothing was to be left out of the light. `mixed` : mixed radiance that the
        light was made of.
    weights : (channel, band), for every band of the mean light; the lens is asked for those that it
        made light of, so that no kernel has to be made again.
    """
    if not isinstance(lens, StatesErrors):
        return None
    every = mixed.wavelength.values
    seen = every
    if demand is not None:
        seen = np.array(bands.lit(mixed, bands.sensed_nm(cameras, every)).kept)
    response = None if demand is None or DIM in mixed.dims else demand.response
    kept = np.isin(every, seen)

    def errors(mean, weights):
        part = mean
        if demand is not None:
            part = window.without_unseen(lens, mean, flares, demand.window_m).kept
        return maps_of(
            lens.spread_errors(part.sel(wavelength=every[kept]), flares, weights[:, kept], response)
        )

    return errors

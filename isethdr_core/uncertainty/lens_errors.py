"""Lens errors: what a lens knows of how wrong its kernels make the light of one scene, asked as the
light itself was asked for.
"""

from __future__ import annotations

import numpy as np

from ..data.temporal_modulation import DIM
from ..pipeline import bands, window
from . import ledger


def asked_of(lens, flares, cameras, demand, mixed):
    """Return function(mean light, weights) -> what `lens.spread_errors` returns; None where a lens
    cannot say.

    Parameters
    ----------
    demand : None where nothing was to be left out of the light. `mixed` : mixed radiance that the
        light was made of.
    weights : (channel, band), for every band of the mean light; the lens is asked for those that it
        made light of, so that no kernel has to be made again.
    """
    if not hasattr(lens, "spread_errors"):
        return None
    every = mixed.wavelength.values
    with ledger.stage(ledger.Ledger(), "bands"):  # the lens's stage has said what was left out
        seen = (
            every if demand is None else np.array(bands.lit(mixed, bands.sensed_nm(cameras, every)))
        )
    response = None if demand is None or DIM in mixed.dims else demand.response
    kept = np.isin(every, seen)

    def errors(mean, weights):
        with ledger.stage(ledger.Ledger(), "window"):  # said, too
            part = (
                mean
                if demand is None
                else window.without_unseen(lens, mean, flares, demand.window_m)
            )
        return lens.spread_errors(
            part.sel(wavelength=every[kept]), flares, weights[:, kept], response
        )

    return errors

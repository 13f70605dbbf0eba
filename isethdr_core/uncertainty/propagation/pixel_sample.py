"""Pixel sample: a regular grid of pixels with errors that represent those of all pixels."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...data import camera_geometry
from .. import ledger
from .share_within import SHARE

if TYPE_CHECKING:
    import xarray as xr

ENOUGH = 32768  # smallest regular sample of the pixels of a capture


def regular_sample(captures: xr.Dataset) -> xr.Dataset:
    """Subsample the captures on a regular grid of at least `ENOUGH` pixels.

    Distorting lenses need every pixel, so their captures are returned unchanged. The ledger states
    the error of the sample: three standard errors of the share of pixels within a figure.
    """
    sizes = [captures.sizes[d] for d in ("y", "x")]
    step = int(np.sqrt(np.prod(sizes) / ENOUGH))
    step -= step % 2 == 0  # odd: every colour of a filter array is sampled
    if step < 3 or not isinstance(camera_geometry.map_of(captures), camera_geometry.Identity):
        return captures
    sampled = captures.isel(
        {d: slice(min(step // 2, n - 1), None, step) for d, n in zip(("y", "x"), sizes)}
    )
    count = sampled.sizes["y"] * sampled.sizes["x"]
    ledger.left_out(
        f"errors of {np.prod(sizes) - count} of {np.prod(sizes)} pixels",
        f"estimated from a sample: one pixel in {step} along each axis",
        3 * float(np.sqrt(SHARE * (1 - SHARE) / count)),
        f"of the pixels, added to or subtracted from the {SHARE:.0%} of a figure",
        needless=True,
    )
    return sampled

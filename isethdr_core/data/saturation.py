"""Saturation: which pixels of a picture are saturated in every capture, so that no exposure
measured them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


def with_saturation(picture: xr.Dataset, captures: xr.Dataset) -> xr.Dataset:
    """Return the picture with the variable `saturated` (y, x): True where every capture is
    saturated and the pixel is not valid.

    A pixel may be valid although its captures are saturated: the table of a nonlinear response
    covers it, or the isp has replaced the sample of a defect. A picture that already has
    `saturated`, or whose grid differs from that of the captures, is returned unchanged.
    """
    if "saturated" in picture or "saturated" not in captures:
        return picture
    everywhere = captures["saturated"].all("capture")
    if everywhere.shape != picture["valid"].shape:
        return picture
    lost = everywhere.values.astype(bool) & ~picture["valid"].values.astype(bool)
    return picture.assign(saturated=(("y", "x"), lost))


def saturated(picture: xr.Dataset) -> np.ndarray:
    """Return which pixels (y, x) are saturated: as the picture states, or all that are not
    valid.
    """
    return picture["saturated"].values if "saturated" in picture else ~picture["valid"].values

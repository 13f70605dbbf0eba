"""Black level: as the sensor states it, or measured on its optical black rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import ledger
from isethdr_core.errors import UnitError

from .electrons import linear_dn

if TYPE_CHECKING:
    import xarray as xr

BLACK = "optical_black"  # variable of the captures, (capture, black_row, x) DN


def with_black_level(captures: xr.Dataset, source: str) -> xr.Dataset:
    """Return captures with `black_dn` from the given source.

    The mean linear DN of a capture's optical black pixels is the sum of black level and mean dark
    charge. The dark charge that the sensor states (`dark_e`) is subtracted. The ledger gets the
    largest standard error of the captures.

    Parameters
    ----------
    captures : captures Dataset.
    source : "stated", which returns the captures unchanged, or "optical".

    Raises
    ------
    UnitError : `source` is "optical", and the captures have no optical black pixels.
    """
    if source == "stated":
        return captures
    if BLACK not in captures or not captures[BLACK].size:
        raise UnitError(
            f"captures have no {BLACK!r}, on which isp.black=optical measures; expected a sensor"
            " with sensor.black_rows above 0; or type isp.black=stated"
        )
    raw = captures[BLACK].values.astype(float)
    gain = captures["gain_dn_per_e"].values
    linear = np.array([linear_dn(captures, i, codes)[0] for i, codes in enumerate(raw)])
    pixels = linear[0].size
    error_e = linear.std(axis=(1, 2)) / np.sqrt(pixels) / gain
    ledger.error(
        float(error_e.max()),
        "electrons",
        "statistical",
        f"black level measured on {pixels} optical black pixels, standard error",
    )
    black = linear.mean(axis=(1, 2)) - gain * captures["dark_e"].values
    moved = black - captures["black_dn"].values
    corrected = captures.assign(black_dn=captures["black_dn"].copy(data=black))
    if "response_dn" in captures:
        table = captures["response_dn"]
        corrected = corrected.assign(response_dn=table.copy(data=table.values + moved[:, None]))
    return corrected

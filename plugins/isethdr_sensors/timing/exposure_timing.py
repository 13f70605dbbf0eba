"""Exposure timing: when each row of each capture is exposed, and how much varying light it receives
then.

Time 0 is the start of the first row's first exposure. Each row starts `line_time_s` after the
previous one. Both photodiodes of a split pixel expose at the same time. Staggered exposures of a
row follow each other. An interleaved shorter exposure ends at the same time as the longer one.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.physics.detector.temporal_modulation import constant, relative_light, row_starts_s

from ..sensor_model import Photodiode, SensorModel
from ..spectral.colour_filter_array import channels

if TYPE_CHECKING:
    from isethdr_core.physics.detector.temporal_modulation import Modulation


def starts_s(model: SensorModel, diode: Photodiode, rows: int) -> np.ndarray:
    """Return the start (rows, 1), s, of the exposure of `diode` in each row.

    Parameters
    ----------
    model : `SensorModel` with the line time and the exposure.
    diode : photodiode; its exposure may start later than the first exposure of the row.
    rows : number of rows of the sensor.
    """
    return row_starts_s(rows, model.line_time_s, model.exposure_s * diode.start_share)


def shot_time_s(model: SensorModel, rows: int, exposure_s: float) -> float:
    """Return the time, s, from the start of the first exposure of a shot to the end of the last.

    Parameters
    ----------
    model : `SensorModel` with the line time and the photodiodes.
    rows : number of rows.
    exposure_s : exposure time, s; exposures of photodiodes and their starts are shares of it.
    """
    last = max(diode.start_share + diode.exposure_share for diode in model.photodiodes)
    return model.line_time_s * (rows - 1) + exposure_s * last


def relative(
    model: SensorModel, diode: Photodiode, modulation: Modulation, filters: np.ndarray
) -> float | np.ndarray:
    """Return the light of each exposure relative to that of the mean over time: (rows, 1), (y, x),
    or 1 for constant light.

    Parameters
    ----------
    model : `SensorModel` with line time, exposure and filter array.
    diode : photodiode with its exposure.
    modulation : `Modulation` of the light in time.
    filters : index of each pixel's channel (y, x).
    """
    if constant(modulation):
        return 1.0
    start_s = starts_s(model, diode, len(filters))
    exposure_s = model.exposure_of(diode)
    full_exposure = relative_light(modulation, start_s, exposure_s)
    if model.lower_case_dark == 1.0:  # no pixel exposes for a shorter time
        return full_exposure
    short_s = exposure_s * model.lower_case_dark
    lower = np.array([letter.islower() for letter in channels(model.cfa)])[filters]
    return np.where(
        lower, relative_light(modulation, start_s + (exposure_s - short_s), short_s), full_exposure
    )


def together(
    model: SensorModel, parts: Sequence[tuple[Modulation, list[Any]]], filters: np.ndarray
) -> list:
    """Return for each photodiode the mean electrons (y, x) of its exposure to varying light.

    Parameters
    ----------
    model : `SensorModel` with line time, exposure and filter array.
    parts : components of the light, [(Modulation, list over photodiodes of (y, x) electrons at the
        mean light over time), ...].
    filters : (y, x) index of each pixel's channel.
    """
    out = None
    for modulation, means in parts:
        shares = [relative(model, diode, modulation, filters) for diode in model.photodiodes]
        mean_electrons = [
            mean if np.ndim(share) == 0 else mean * share
            for mean, share in zip(means, shares, strict=True)
        ]
        out = (
            mean_electrons
            if out is None
            else [so_far + more for so_far, more in zip(out, mean_electrons, strict=True)]
        )
    return out

"""Exposure timing: when each row of each capture is exposed, and how much of light that varies
falls into it.

Time 0 is the start of the first row's first exposure. Rows follow each other by `line_time_s`; both
photodiodes of a split pixel expose together, staggered exposures of a row one after the other. An
interleaved shorter exposure ends with the longer one.
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
    """Return when each row's exposure of `diode` starts, (rows, 1) seconds.

    Parameters
    ----------
    model : `SensorModel` with the line time and the exposure.
    diode : photodiode, whose exposure may start later than the row's first.
    rows : number of rows of the sensor.
    """
    return row_starts_s(rows, model.line_time_s, model.exposure_s * diode.start_share)


def shot_time_s(model: SensorModel, rows: int, exposure_s: float) -> float:
    """Return the time from the start of the first exposure of a shot to the end of the last one.

    Parameters
    ----------
    model : of the sensor.
    rows : number of rows.
    exposure_s : of which the exposures and their starts are shares.
    """
    last = max(diode.start_share + diode.exposure_share for diode in model.photodiodes)
    return model.line_time_s * (rows - 1) + exposure_s * last


def relative(
    model: SensorModel, diode: Photodiode, modulation: Modulation, filters: np.ndarray
) -> float | np.ndarray:
    """Return the light that falls into each exposure over that of the mean over time: (rows, 1),
    (y, x), or 1 for constant light.

    Parameters
    ----------
    model : `SensorModel` with line time, exposure and filter array.
    diode : photodiode whose exposure counts.
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
    """Return per photodiode the mean electrons (y, x) of the exposure as it falls in time.

    Parameters
    ----------
    parts : [(Modulation, per photodiode (y, x) electrons at the mean light over time), ...].
    filters : (y, x) index of each pixel's channel.
    model : `SensorModel` with line time, exposure and filter array.
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

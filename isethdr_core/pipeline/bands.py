"""Bands that can be left out: outer bands that neither a sensor nor the reference picture needs.

Only outer bands are dropped, and at least two bands stay: the width of a band follows from the
distance to its neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..data.score_checks import in_line
from ..errors import PluginError, UnitError
from ..physics.photometry import xyz_weights
from ..plugins.protocols import KnowsItsBands, NarrowsDemand
from ..plugins.ranges import LEAST_NM, MOST_NM
from ..uncertainty import ledger
from .demand import Demand

if TYPE_CHECKING:
    import xarray as xr
    from numpy.typing import ArrayLike

    from ..plugins.protocols import Scene

BANDS = "bands"  # key of the ledger entry for bands left out of the light
# a band adds nothing to the reference picture where the colour matching functions are below this
# share of the largest one
UNSEEN = 1e-6


def offered_nm(source: Scene) -> tuple[float, ...] | None:
    """Return the band centres, nm, that a scene or renderer would make; None if it does not state
    them in advance.

    Raises
    ------
    UnitError : a band lies outside the range of wavelengths, for example in micrometres or metres.
    PluginError : the bands are not ascending finite numbers, or there are none.
    """
    if not isinstance(source, KnowsItsBands):
        return None
    stated = source.bands_nm()
    bands_nm = _as_numbers(stated)
    if not bands_nm or any(later <= band for band, later in pairwise(bands_nm)):
        raise PluginError(
            f"{type(source).__name__}.bands_nm() returned {in_line(bands_nm or stated)}; expected"
            " the centres of all bands, nm, finite, ascending, at least one"
        )
    if not all(LEAST_NM <= band <= MOST_NM for band in bands_nm):
        raise UnitError(
            f"{type(source).__name__} has bands from {min(bands_nm):g} to {max(bands_nm):g}; "
            f"expected nanometres, {LEAST_NM:g} to {MOST_NM:g}; multiply micrometres by 1e3, "
            "metres by 1e9"
        )
    return bands_nm


def _as_numbers(values: Any) -> tuple[float, ...]:
    """Return finite numbers as a tuple; empty if `values` are something else."""
    if isinstance(values, str | bytes):
        return ()
    try:
        numbers = tuple(map(float, values))
    except (TypeError, ValueError):
        return ()
    return numbers if all(map(math.isfinite, numbers)) else ()


def for_sensors_and_truth(
    offered: tuple[float, ...] | None, sensed: tuple[float, ...] | None
) -> tuple[float, ...] | None:
    """Return the bands out of `offered` that the sensors (`sensed`) or the reference picture need;
    None if these are all bands, or are not known.
    """
    if offered is None or sensed is None:
        return None

    weight = xyz_weights(offered).max(0)
    inside = outer(np.isin(offered, sensed) | (weight > UNSEEN * weight.max()))
    needed = offered[inside]
    if len(needed) == len(offered):
        return None
    dropped = [w for w in offered if w not in needed]
    ledger.left_out(
        f"{len(dropped)} of {len(offered)} bands, {dropped[0]:g} to {dropped[-1]:g} nm",
        "neither a sensor nor the reference picture responds to them",
        UNSEEN,
        "electrons, and luminance, of the same light at the peak",
        key=BANDS,
        needless=True,
    )
    return needed


def of_demand(scene: xr.Dataset, demand: Demand) -> xr.Dataset:
    """Select the bands of `demand` from scene radiance, without reading it. The scene is returned
    unchanged if the demand names no bands, or a band that the scene lacks.
    """
    bands = demand.wavelength_nm
    if bands is None or not set(bands) < set(scene.wavelength.values.tolist()):
        return scene
    every = scene.sizes["wavelength"]
    ledger.left_out(
        f"chunks of {every - len(bands)} of {every} bands of the scene's light",
        "no component needs them",
        0.0,
        "W m-2 sr-1 nm-1",
        key=BANDS,
        needless=True,
    )
    return scene.sel(wavelength=list(bands))


def outer(flags: ArrayLike) -> slice:
    """Return the slice from the first to the last true entry, with at least two entries; the slice
    of all entries if none is true.
    """
    where = np.flatnonzero(flags)
    if not len(where) or len(flags) < 2:
        return slice(0, len(flags))
    first = int(where[0])
    last = int(where[-1])
    return slice(first, last + 1) if first < last else slice(max(last - 1, 0), max(last - 1, 0) + 2)


def sensed_nm(sensors: Iterable[Any], bands: ArrayLike) -> tuple[float, ...]:
    """Return those of `bands` that at least one sensor needs."""
    all_bands = Demand(wavelength_nm=tuple(map(float, bands)))
    needed_nm: set[float] = set()
    for sensor in sensors:
        narrowed = sensor.narrow(all_bands) if isinstance(sensor, NarrowsDemand) else all_bands
        needed_nm |= set(narrowed.wavelength_nm or all_bands.wavelength_nm)
    return tuple(sorted(needed_nm))

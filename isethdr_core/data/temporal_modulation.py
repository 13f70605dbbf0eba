"""Temporal modulation: components of mixed radiance and irradiance, each with one modulation.

Light without the dim `component` is constant. Otherwise each component holds the mean of its light
over time, and the coordinates `frequency_hz`, `duty`, `depth` and `phase` describe its modulation
(`physics.detector.temporal_modulation.Modulation`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
import xarray as xr

from ..errors import UnitError
from ..physics.detector.temporal_modulation import Modulation
from ..uncertainty import ledger

DIM = "component"

Owner = TypeVar("Owner")
Arguments = ParamSpec("Arguments")


def stacked(
    names: Iterable[str], modulations: Sequence[Modulation], planes: Iterable[xr.DataArray]
) -> xr.DataArray:
    """Return a DataArray (component, ...) from planes that share dims, coordinates and attributes,
    copied one at a time.

    Parameters
    ----------
    names : names of the components.
    modulations : one `Modulation` for each component.
    planes : iterable of as many DataArrays.
    """
    out: np.ndarray | None = None
    for k, plane in enumerate(planes):
        if out is None:
            out = np.empty((len(modulations), *plane.shape), plane.dtype)
        out[k] = plane.values
    how: dict[str, tuple[Any, ...]] = {
        field: (DIM, np.array(values, float))
        for field, values in zip(Modulation._fields, zip(*modulations), strict=True)
    }
    how["frequency_hz"] += ({"units": "Hz"},)
    return xr.DataArray(
        out,
        dims=(DIM, *plane.dims),
        attrs=plane.attrs,
        coords={DIM: np.array(list(names), object), **how, **plane.coords},
    )


def components(light: xr.DataArray) -> list[tuple[Modulation, xr.DataArray]]:
    """Return [(Modulation, plane without the dim component), ...]; light without that dim is one
    constant plane.

    Raises
    ------
    UnitError : the dim is not the first or is empty, or a coordinate is missing or invalid.
    """
    if DIM not in getattr(light, "dims", ()):
        return [(Modulation(), light)]
    if light.dims[0] != DIM or not light.sizes[DIM]:
        raise UnitError(
            f"light has dims {tuple(map(str, light.dims))} of sizes {tuple(light.sizes.values())}; "
            f"expected {DIM!r} first, with at least one component"
        )
    for field in Modulation._fields:
        if field not in light.coords:
            raise UnitError(
                f"light with components has no coordinate {field!r}; expected"
                f" {', '.join(Modulation._fields)} along {DIM!r}"
            )
    pairs = []
    for k in range(light.sizes[DIM]):
        modulation = Modulation(*(float(light[field].values[k]) for field in Modulation._fields))
        if problem := wrong(modulation):
            raise UnitError(f"component {k} of the light: {problem}")
        pairs.append((modulation, light.isel({DIM: k}, drop=True)))
    return pairs


def wrong(modulation: Modulation) -> str:
    """Return the error in a modulation and the expected value; "" if it is valid."""
    frequency_hz, duty, depth, phase = modulation
    if not 0 <= frequency_hz < np.inf:
        return f"frequency_hz is {frequency_hz:g}; expected a finite number of Hz, 0 or more"
    if not 0 < duty <= 1:
        return f"duty is {duty:g}; expected a share of the period above 0, at most 1"
    if not 0 <= depth <= 1:
        return f"depth is {depth:g}; expected amplitude / mean from 0 to 1: light is never negative"
    if duty < 1 and depth > 0:
        return (
            f"duty is {duty:g} and depth {depth:g}; expected pulses (duty) or a ripple (depth), not"
            " both"
        )
    if not -np.inf < phase < np.inf:
        return f"phase is {phase:g}; expected a finite number of periods"
    return ""


def time_mean(light: xr.DataArray) -> xr.DataArray:
    """Return the mean over time: the sum of all components in float64, rounded once. Constant light
    is returned unchanged.

    If the scene moves during a shot, the components are its sub-frames, and this mean is the light
    of the longest shot of all cameras. A shorter exposure integrates the components instead
    (`physics.modulation.light_s`).
    """
    planes = [plane for _, plane in components(light)]
    if len(planes) == 1:
        return planes[0]
    mean = planes[0].copy(data=np.empty(planes[0].shape, planes[0].dtype))
    for band in np.ndindex(mean.shape[:-2]):
        mean.values[band] = sum(part.values[band].astype(np.float64) for part in planes)
    return mean


def each_component(
    call: Callable[Concatenate[Owner, xr.DataArray, Arguments], xr.DataArray],
) -> Callable[Concatenate[Owner, xr.DataArray, Arguments], xr.DataArray]:
    """Make a method `(self, light, ...)` that is linear in constant light accept light with
    components, one after the other.
    """

    @wraps(call)
    def over_components(
        self: Owner, light: xr.DataArray, /, *args: Arguments.args, **kwargs: Arguments.kwargs
    ) -> xr.DataArray:
        if DIM not in getattr(light, "dims", ()):
            return call(self, light, *args, **kwargs)
        components_of_light = components(light)
        rows = []

        def of_one(plane: xr.DataArray) -> xr.DataArray:
            result, row = ledger.collected(lambda: call(self, plane, *args, **kwargs))
            ledger.record_light_parts(row)
            rows.append(row)
            return result

        out = stacked(
            light[DIM].values,
            [m for m, _ in components_of_light],
            (of_one(plane) for _, plane in components_of_light),
        )
        ledger.record_row(ledger.row_of_sum(rows))
        return out

    return over_components

"""Field errors: effect of kernel errors if point spreads vary over the field, or with lateral
colour.

Point spreads that vary: the kernel of the axis spreads the light beyond the cores. It is scaled for
each tile to the energy that the tile's own core leaves. Its errors are those of one kernel with
scaled light. A second error comes from using the kernel of the axis for other field points; it is
at most the difference to the kernel of the outermost field point. A third error comes from the
cores of field points beyond their exact part. It is not known whether the errors e of adjacent
field points are correlated. Their weights w sum to 1, so that (sum of w e)^2 is at most the sum of
w e^2 (Jensen's inequality). The light is therefore multiplied by the root of the weight before it
is squared.

Lateral colour: errors are computed on the grid of the convolution and moved with the bands. Bands
are moved together if their images lie closer than the resolution of the errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ..imaging.spread_errors import are_exact
from ..imaging.spread_errors import spread_errors as one_spread
from .lateral_colour import READ, Course

if TYPE_CHECKING:
    import xarray as xr

    from ..imaging.field_optics import FieldOptics

# share of the frame's longer side, and at least half a tile: images of bands that lie closer than
# this count as one. The resolution of the errors is twice as wide.
APART = 1 / 192


def spread_errors(
    mixed: xr.DataArray, optics: FieldOptics, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return (deviation, bound) of the light on the sensor's tiles, each (channel, y, x).

    Parameters
    ----------
    mixed : mixed radiance (wavelength, y, x).
    optics : `field_optics.FieldOptics` of its field.
    weights : (channel, band) factors on irradiance, for example electrons per m2 and second.
    """
    weights = np.asarray(weights, float)
    sensor = optics.sensor
    if sensor.scales is None:
        return tuple(sensor.move(e) for e in _spread_of_part(mixed, optics, weights))
    squares, bound = np.zeros((2, len(weights), len(sensor.y), len(sensor.x)))
    for bands in _grouped(sensor.scales, mixed.shape[1:]):
        alone = np.where(np.isin(np.arange(weights.shape[1]), bands), weights, 0.0)
        if alone.any():
            for channel, (deviation, most) in enumerate(
                zip(*_spread_of_part(mixed, optics, alone))
            ):
                squares[channel] += sensor.move_band(deviation, bands[0]) ** 2
                bound[channel] += sensor.move_band(most, bands[0])
    return np.sqrt(squares).astype(np.float32), bound.astype(np.float32)


def _grouped(scales: Sequence[Course | float], shape: tuple[int, int]) -> list[list[int]]:
    """Return groups of bands with images that differ by less than the resolution of the errors."""
    near = max(0.5, APART * max(shape))
    radius = np.hypot(*shape) / 2
    at = [
        (s.ratio if isinstance(s, Course) else s * np.ones(READ)) * np.linspace(0, radius, READ)
        for s in scales
    ]
    groups: list[list[int]] = []
    for band, place in enumerate(at):
        home = next((g for g in groups if np.abs(at[g[0]] - place).max() <= near), None)
        groups.append([band]) if home is None else home.append(band)
    return groups


def _spread_of_part(
    mixed: xr.DataArray, optics: FieldOptics, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return (deviation, bound), each (row of `weights`, y, x), on the field's own tiles."""
    still = replace(optics, sensor=replace(optics.sensor, areas=None, scales=None), field=None)
    field = optics.field
    if field is None:
        return one_spread(mixed, still, weights)
    beyond = np.stack([field.far_scale(b) for b in range(len(mixed))]) * mixed.values
    deviation, bound = one_spread(
        mixed.copy(data=beyond), replace(still, kernels=field.far), weights
    )
    elsewhere = np.ones(mixed.shape[1:])  # share of the light at field points off the axis
    elsewhere[field.shares[0][0]] -= field.shares[0][1]
    unlike, _ = one_spread(
        mixed.copy(data=beyond * np.sqrt(elsewhere)),
        replace(still, kernels=field.unlike_far),
        weights,
    )
    squares = deviation**2 + unlike**2
    for window, light, core in field.parts(mixed.values, 0.5):
        if are_exact(core):
            continue
        y, x = window
        part_light = mixed.isel(y=y, x=x).copy(data=light)
        relative = optics.relative if optics.relative is None else optics.relative[window]
        part_errors, most = one_spread(
            part_light, replace(still, kernels=core, relative=relative), weights
        )
        squares[:, y, x] += part_errors**2
        bound[:, y, x] += most
    return np.sqrt(squares), bound

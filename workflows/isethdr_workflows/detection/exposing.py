"""The exposure that a camera chooses for a scene at any level of light.

Mean electrons are proportional to the light. So the light is imaged on the pixels once, and other
levels are metered by multiplying with a factor. Captures of a few pixels state exposure, gain and
noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr
from isethdr_sensors.imaging_sensor import ImagingSensor
from isethdr_sensors.timing import auto_exposure
from isethdr_sensors.timing.auto_exposure import Solved

from isethdr_core import generator
from isethdr_core.data.temporal_modulation import time_mean

SIDE = 8  # side of the crop that states a camera's exposure, pixels


@dataclass(frozen=True, eq=False)
class Metered:
    """The mean electrons that decide the exposure of a camera.

    Parameters
    ----------
    sensor : sensor that meters them.
    electrons_per_s : (capture, y, x) mean electrons per second, dark charge included.
    dark_e_per_s : (capture, 1, 1) the dark charge among them.
    focal_length_m : focal length of the lens, m.
    """

    sensor: ImagingSensor
    electrons_per_s: np.ndarray
    dark_e_per_s: np.ndarray
    focal_length_m: float

    def settled(self, factor: float) -> Solved:
        """Return the exposure and the gain for the light times `factor`."""
        electrons_per_s = self.electrons_per_s
        if factor != 1:
            light_e_per_s = self.electrons_per_s - self.dark_e_per_s
            electrons_per_s = factor * light_e_per_s + self.dark_e_per_s
        return auto_exposure.settled_at(self.sensor, electrons_per_s, self.focal_length_m)


@dataclass(eq=False)
class Exposing:
    """A camera with the light on its sensor plane, which may be scaled.

    Parameters
    ----------
    sensor : sensor of the camera.
    light : light on the sensor plane; for an `ImagingSensor` the tiles under the middle.
    metered : electrons that decide the exposure; None if no electrons do.
    """

    sensor: Any
    light: xr.DataArray
    metered: Metered | None = None
    _known: dict[tuple[float, float], xr.Dataset] = field(default_factory=dict)

    def captures(self, factor: float = 1.0) -> xr.Dataset:
        """Return captures of a few pixels at the exposure that the camera chooses for the light
        times `factor`. Only their exposure, gain and noise are meant for use: the pixels
        themselves show the light as it is. Levels of equal exposure and gain share the captures, so
        they must not be changed.
        """
        if not isinstance(self.sensor, ImagingSensor):
            return self._once(
                (factor, 0.0),
                lambda: self.sensor(
                    self.light if factor == 1 else scaled(self.light, factor), generator()
                ),
            )
        if self.metered is None:
            return self._once((0.0, 0.0), lambda: few(self.sensor, self.light))
        solved = self.metered.settled(factor)
        key = solved.exposure_s, solved.gain
        return self._once(key, lambda: few(self.sensor, self.light, solved))

    def _once(self, key: tuple[float, float], make: Callable[[], xr.Dataset]) -> xr.Dataset:
        if key not in self._known:
            self._known[key] = make()
        return self._known[key]


def exposing(sensor: Any, light: xr.DataArray, mean: xr.DataArray | None = None) -> Exposing:
    """Return a camera with the light for which it chooses its exposure.

    Parameters
    ----------
    sensor : sensor of the camera.
    light : light on the sensor plane.
    mean : (capture, y, x) electrons that `sensor` expects from this light; None: not known yet.
    """
    if not isinstance(sensor, ImagingSensor):
        return Exposing(sensor, light)
    under_middle = middle(light, sensor.pitch_um)
    if sensor.exposure_rule == "fixed":
        return Exposing(sensor, under_middle)
    metering = auto_exposure.metered(sensor)
    constant = time_mean(light)
    if mean is None or metering is not sensor or constant is not light:
        mean = metering.expected(constant)
    focal_length_m = 1e-3 * light.attrs["focal_length_mm"]
    electrons_per_s = mean.values / metering.exposure_s
    dark_e_per_s = in_darkness(metering, light)[:, None, None] / metering.exposure_s
    deciding, pixels = decisive(metering, electrons_per_s)
    metered = Metered(deciding, pixels, dark_e_per_s, focal_length_m)
    return Exposing(sensor, under_middle, metered)


def decisive(
    sensor: ImagingSensor, electrons_per_s: np.ndarray
) -> tuple[ImagingSensor, np.ndarray]:
    """Return the one or two pixels (capture, 1, pixel) of each capture that decide its metered
    level, and the sensor that meters them alone. If more pixels decide, the arguments are returned.

    The rules `percentile`, `histogram` and, without a limit for lamps, `highlights` meter pixels
    by their rank. Multiplying by a factor and adding dark charge keep the ranks, also after
    rounding, so the same pixels decide at every level of light and every gain.

    Parameters
    ----------
    sensor : sensor as `auto_exposure.metered` returns it.
    electrons_per_s : (capture, y, x) mean electrons per second.
    """
    count = electrons_per_s[0].size
    if sensor.exposure_rule == "highlights" and np.isinf(sensor.exposure_lamp_ratio):
        return sensor, electrons_per_s.max((1, 2), keepdims=True)
    if sensor.exposure_rule == "histogram":
        return sensor, _ranked(electrons_per_s, [(count - 1) // 2, count // 2])
    # np.percentile calculates the rank in the type of the pixels
    if sensor.exposure_rule != "percentile" or electrons_per_s.dtype != np.float64:
        return sensor, electrons_per_s
    # a percentile lies at this rank; np.percentile interpolates between the two ranks beside it
    rank = (count - 1) * (sensor.exposure_percentile / 100)
    first = int(rank)
    share = rank - first
    percentile = 100 * share
    if percentile / 100 != share:  # not the same number after rounding: only a few pixels
        return sensor, electrons_per_s
    of_two = replace(sensor, exposure_percentile=percentile)
    return of_two, _ranked(electrons_per_s, [first, min(first + 1, count - 1)])


def _ranked(planes: np.ndarray, ranks: list[int]) -> np.ndarray:
    """Return the values (capture, 1, rank) of some ranks, 0 for the smallest."""
    flat = planes.reshape(len(planes), -1)
    return np.stack([np.partition(plane, ranks)[ranks] for plane in flat])[:, None]


def few(sensor: ImagingSensor, light: xr.DataArray, solved: Solved | None = None) -> xr.Dataset:
    """Return captures of a few pixels in the middle, which state exposure, gain and noise.

    Parameters
    ----------
    sensor : sensor of the camera.
    light : light on the sensor plane, at least the tiles that `middle` returns.
    solved : exposure and gain, as `auto_exposure.settle` returns them; None: those of the sensor.
    """
    fixed = sensor
    if solved is not None:
        fixed = sensor.with_gain(solved.gain) if solved.gain > 1 else sensor
        fixed = replace(fixed, exposure_rule="fixed", exposure_s=solved.exposure_s)
    return replace(fixed, rows=SIDE, columns=SIDE)(middle(light, sensor.pitch_um), generator())


def middle(light: xr.DataArray, pitch_um: float) -> xr.DataArray:
    """Return the tiles of light under the few pixels in the middle, and two more tiles on each
    side, in all bands.

    Parameters
    ----------
    light : light on the sensor plane.
    pitch_um : pitch of the pixels, um.
    """
    cut = {}
    for dim in ("y", "x"):
        places_m = light[dim].values
        reach_m = SIDE / 2 * 1e-6 * pitch_um + 2.5 * (places_m[1] - places_m[0])
        inside = np.flatnonzero(np.abs(places_m) <= reach_m)
        cut[dim] = slice(int(inside[0]), int(inside[-1]) + 1)
    return light.isel(cut)


def in_darkness(sensor: Any, light: xr.DataArray) -> np.ndarray:
    """Return the mean electrons (capture,) of a pixel without light. This dark charge is the same
    in all pixels.

    Parameters
    ----------
    sensor : sensor of the camera.
    light : light on the sensor plane, for its grid.
    """
    if isinstance(sensor, ImagingSensor):
        sensor = replace(sensor, rows=SIDE, columns=SIDE)
        light = middle(light, sensor.pitch_um)
    return sensor.expected(scaled(light, 0.0)).values[:, 0, 0]


def scaled(light: xr.DataArray, factor: float) -> xr.DataArray:
    """Return light multiplied by a factor, with the same coordinates and attributes."""
    return light.copy(data=light.values * np.float32(factor))


def even(light: xr.DataArray) -> xr.DataArray:
    """Return an even field with the mean of light, with the same coordinates and attributes."""
    mean = light.mean(["y", "x"]).broadcast_like(light).transpose(*light.dims)
    return light.copy(data=mean.values)

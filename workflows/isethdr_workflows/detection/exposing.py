"""The exposure that a camera chooses for a scene at any level of light.

Mean electrons are proportional to the light. So the light is imaged on the pixels once, and other
levels are metered by multiplying with a factor. Captures of a few pixels state exposure, gain and
noise.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr
from isethdr_sensors.imaging_sensor import ImagingSensor
from isethdr_sensors.timing import auto_exposure

from isethdr_core import generator
from isethdr_core.data.temporal_modulation import time_mean

SIDE = 8  # side of the crop that states a camera's exposure, pixels


@dataclass(eq=False)
class Exposing:
    """A camera with the light on its sensor plane, which may be scaled."""

    sensor: Any
    light: xr.DataArray
    at_one: xr.Dataset  # captures of a few pixels of the light as it is
    light_e_per_s: np.ndarray | None = None  # (capture, y, x), computed for the first other level

    def captures(self, factor: float = 1.0) -> xr.Dataset:
        """Return captures of a few pixels at the exposure that the camera chooses for the light
        times `factor`. Only their exposure, gain and noise are meant for use: the pixels
        themselves show the light as it is.
        """
        if factor == 1:
            return self.at_one
        sensor = self.sensor
        if not isinstance(sensor, ImagingSensor):
            return sensor(scaled(self.light, factor), generator())
        if sensor.exposure_rule == "fixed":
            return self.at_one
        metered = auto_exposure.metered(sensor)
        dark_e_per_s = in_darkness(metered, self.light)[:, None, None] / metered.exposure_s
        if self.light_e_per_s is None:
            mean_e = metered.expected(time_mean(self.light)).values
            self.light_e_per_s = mean_e / metered.exposure_s - dark_e_per_s
        electrons_per_s = factor * self.light_e_per_s + dark_e_per_s
        focal_length_m = 1e-3 * self.light.attrs["focal_length_mm"]
        solved = auto_exposure.settled_at(metered, electrons_per_s, focal_length_m)
        return few(sensor, self.light, solved)


def exposing(sensor: Any, light: xr.DataArray) -> Exposing:
    """Return a camera with the light for which it chooses its exposure."""
    if not isinstance(sensor, ImagingSensor):
        return Exposing(sensor, light, sensor(light, generator()))
    solved = None
    if sensor.exposure_rule != "fixed":
        solved = auto_exposure.settle(sensor, light)
    return Exposing(sensor, light, few(sensor, light, solved))


def few(sensor: ImagingSensor, light: xr.DataArray, solved: Any = None) -> xr.Dataset:
    """Return captures of a few pixels in the middle, which state exposure, gain and noise.

    Parameters
    ----------
    sensor : sensor of the camera.
    light : light on the sensor plane.
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

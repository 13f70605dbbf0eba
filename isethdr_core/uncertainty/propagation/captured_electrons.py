"""Captured electrons: the light electrons of each capture, their noise, and parts of the light."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...data.temporal_modulation import time_mean
from ...errors import PluginError
from ...physics.radiometry import photons_per_energy
from ...physics.resampling.area import detail_error, resample_mean
from ..error_terms import ErrorMaps, LightPart, Reading
from ..ledger import Row
from ..render_noise import relative_noise
from .electron_rates import Rates, electron_rates, light_plane

if TYPE_CHECKING:
    import xarray as xr

    MapsOfErrors = Callable[[xr.DataArray, np.ndarray], ErrorMaps | None]


@dataclass(frozen=True, eq=False)
class Electrons:
    """Mean light electrons of one capture (y, x), those of direct light, and the noise."""

    capture: str
    total: np.ndarray
    image: np.ndarray  # electrons of direct light, neither blurred nor scattered
    sigma: np.ndarray  # standard deviation of shot, read and converter noise
    renderer: np.ndarray  # standard deviation that the noise of the scene causes
    unsaturated: np.ndarray
    per_irradiance: float  # electrons per W m-2 nm-1 in every band, of the most sensitive channel
    maps: ErrorMaps | None = None  # (y, x) each: errors that the lens states pixel by pixel
    # electrons of the parts of the light that stages declared
    parts: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Exposure:
    """The captures of one shot, and the light from which they were made.

    Attributes
    ----------
    captures : captures Dataset.
    light : irradiance or photocurrent on the sensor plane.
    mixed : mixed radiance from which the light was computed, W m-2 sr-1 nm-1.
    scene : scene radiance, with `xyz_noise` if a renderer states it.
    """

    captures: xr.Dataset
    light: xr.DataArray
    mixed: xr.DataArray
    scene: xr.Dataset


def missing(captures: xr.Dataset) -> list[str]:
    """Return the variables and attributes that `electrons` needs and the captures lack. Captures
    that a bundled isp can read lack none.
    """
    needed = (
        "quantum_efficiency",
        "filter",
        "saturated",
        "exposure_s",
        "area_m2",
        "read_noise_e",
        "quantisation_e",
        "dark_e",
    )
    return [n for n in needed if n not in captures] + [
        n for n in ("focal_length_mm", "throughput_sr", "pitch_um") if n not in captures.attrs
    ]


class RatesOfLight(NamedTuple):
    """Electron rates of captures with one response, and the errors that the lens states."""

    rates: Rates
    maps: ErrorMaps | None  # (y, x) at the pixels, per m2 and second


def electrons(
    exposure: Exposure, scene_noise: float = 0.0, error_maps: MapsOfErrors | None = None
) -> list[Electrons]:
    """Return the electrons of each capture, computed from the light.

    Parameters
    ----------
    exposure : the captures and their light.
    scene_noise : relative noise of a scene that states none tile by tile, as `stated_noise`.
    error_maps : function(mixed, weights) -> `ErrorMaps` of `weights` (channel, band) times
        irradiance, on the grid of the light, or None. Without maps, the terms that the lens states
        are used.
    """
    captures = exposure.captures
    light = time_mean(exposure.light)
    mixed = time_mean(exposure.mixed)
    at_mean = replace(exposure, light=light, mixed=mixed)
    noise = relative_noise(exposure.scene, mixed)
    photons = photons_per_energy(captures.wavelength.values)
    # by the response of a capture: most captures of a sensor have the same response
    of_light: dict[bytes, RatesOfLight] = {}
    out = []
    for k, name in enumerate(map(str, captures.capture.values)):
        capture = captures.isel(capture=k)
        counting = capture["quantum_efficiency"].values * photons
        key = counting.tobytes()
        if key not in of_light:
            maps = error_maps(mixed, counting) if error_maps else None
            of_light[key] = RatesOfLight(
                electron_rates(counting, at_mean, noise, scene_noise),
                _at_filters(maps, captures, light),
            )
        out.append(_electrons_of(name, capture, counting, of_light[key]))
    return out


def _electrons_of(
    name: str, capture: xr.Dataset, counting: np.ndarray, of_light: RatesOfLight
) -> Electrons:
    """Return the electrons of one capture.

    Parameters
    ----------
    name : name of the capture.
    capture : its data.
    counting : (channel, band) electrons per energy.
    of_light : rates of captures with this `counting`.
    """
    scale = float(capture["exposure_s"]) * float(capture["area_m2"])
    rates = of_light.rates.scaled(scale)
    maps = of_light.maps
    if maps is not None:
        maps = maps._replace(deviation=scale * maps.deviation, bound=scale * maps.bound)
    read = float(capture["read_noise_e"]) ** 2 + float(capture["quantisation_e"]) ** 2 / 12
    variance = np.maximum(rates.total + float(capture["dark_e"]) + read, np.finfo(float).tiny)
    return Electrons(
        capture=name,
        total=rates.total,
        image=rates.image,
        sigma=np.sqrt(variance),
        renderer=rates.renderer,
        unsaturated=capture["saturated"].values == 0,
        per_irradiance=scale * float(counting.sum(1).max()),
        maps=maps,
    )


def with_parts(
    shots: list[Electrons], captures: xr.Dataset, rows: Sequence[Row]
) -> list[Electrons]:
    """Return the shots with the electrons of every part of the light that a row declares
    (`ledger.light_part`).

    Parameters
    ----------
    shots : one per capture, as `electrons` returns them.
    captures : captures Dataset to which the shots belong.
    rows : rows of the ledger.
    """
    declared = {name: part for row in rows for name, part in row.light_parts.items()}
    if not declared:
        return shots
    out = []
    for k, shot in enumerate(shots):
        parts = {}
        for name, part in declared.items():
            if part.reading is Reading.IMAGE:
                parts[name] = shot.image
            elif part.reading is Reading.REST:
                parts[name] = np.maximum(shot.total - shot.image, 0.0)
            else:
                parts[name] = _at_pixels(captures.isel(capture=k), part)
        out.append(replace(shot, parts=parts))
    return out


def _at_pixels(captures: xr.Dataset, part: LightPart) -> np.ndarray:
    """Return the electrons of one capture that a part of the light makes at each pixel in its own
    channel.
    """
    light = part.light
    assert light is not None  # a part without light is read from all light
    energy = photons_per_energy(captures.wavelength.values)
    counting = captures["quantum_efficiency"].values * energy
    scale = float(captures["exposure_s"]) * float(captures["area_m2"])
    over_pixels = detail_error if part.reading is Reading.DEVIATION else resample_mean
    side = captures.attrs["pitch_um"] * 1e-6
    place = (captures.x.values, captures.y.values)
    filters = captures["filter"].values
    out = np.zeros(filters.shape)
    for channel, row in enumerate(counting):
        mine = filters == channel
        if mine.any():
            plane = light_plane(row, captures, light)
            out[mine] = over_pixels(plane, light.x.values, light.y.values, *place, side, side)[mine]
    return scale * out


def _at_filters(
    maps: ErrorMaps | None, captures: xr.Dataset, light: xr.DataArray
) -> ErrorMaps | None:
    """Return error maps (y, x) of the pixels from maps (channel, y, x) of light.

    Errors of neighbouring tiles are taken as fully correlated.

    Raises
    ------
    PluginError : the maps do not lie on the tiles of the light.
    """
    if maps is None:
        return None
    _check_maps(maps, (captures.sizes["channel"], light.sizes["y"], light.sizes["x"]))
    side = captures.attrs["pitch_um"] * 1e-6
    filters = captures["filter"].values
    out = np.zeros((2, *filters.shape))
    for pixel_errors, planes in zip(out, (maps.deviation, maps.bound)):
        for channel, plane in enumerate(planes):
            if (mine := filters == channel).any():
                pixel_errors[mine] = resample_mean(
                    plane,
                    light.x.values,
                    light.y.values,
                    captures.x.values,
                    captures.y.values,
                    side,
                    side,
                )[mine]
    return maps._replace(deviation=out[0], bound=out[1])


def _check_maps(maps: ErrorMaps, shape: tuple[int, ...]) -> None:
    """Raise PluginError unless error maps have the shape (channel, y, x) of the light."""
    for name, plane in (("deviation", maps.deviation), ("bound", maps.bound)):
        if np.shape(plane) != shape:
            raise PluginError(
                f"light_errors of the lens: {name} has the shape {np.shape(plane)}; expected"
                f" (channel, y, x) of its light, {shape}"
            )

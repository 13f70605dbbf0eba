"""Noise limit: the noise of the scene's light that stays below the noise of every camera.

A renderer need not be more precise than the cameras. Approximate light, exposed with the camera's
automatic exposure, gives the shot, read and quantisation noise in each tile. Noise of the light is
limited to the same size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import correlate1d

from ..data import camera_geometry
from ..data.quantities import full_field, tile_pitch
from ..data.temporal_modulation import time_mean
from ..physics.photometry import xyz_weights
from ..physics.radiometry import photons_per_energy
from ..plugins.protocols import KnowsImageSize
from ..uncertainty import ledger, propagation
from ..uncertainty.render_noise import levels, nearest_xyz, on_light
from . import window
from .demand import NoiseLimit

if TYPE_CHECKING:
    import xarray as xr

REACH = 1  # noisy light is replaced by the mean over tiles up to this distance
# share of the saturated pixels with less light than that at which a capture counts as saturated
SATURATED = 0.05
CHANGED = 0.2  # relative change of light with which an automatic exposure is tested
# shares of the field whose images are compared to find distortion. An image in proportion to the
# field is right to a few roundings of float64, far below `IN_PROPORTION`.
COMPARED = (1.0, 0.7, 0.4)
IN_PROPORTION = 1e-12
# relative limit for a sensor whose captures do not state its noise: that of renderers without
# cameras
UNKNOWN = 0.1


@dataclass(frozen=True, eq=False)
class CameraNoise:
    """Noise limits of the cameras of a run, from scene radiance that is nearly right.

    Attributes
    ----------
    lighting, lens, cameras : components of the run.
    on_sensor : function(mixed radiance) -> light on the sensor plane, for a lens of which
        `sharp_light` returns None.
    generator : key of the cameras' noise.
    """

    lighting: Any
    lens: Any
    cameras: dict[str, Any]
    on_sensor: Any
    generator: Any

    def __call__(self, scene: xr.Dataset) -> NoiseLimit:
        """Return the noise of the light of `scene` that equals the noise of the least noisy camera.

        The errors that the components state here do not enter the ledger. They will state them
        again for the final light.
        """
        return ledger.collected(lambda: self._limit(scene)).result

    def _limit(self, scene: xr.Dataset) -> NoiseLimit:
        mixed = self.lighting(scene)
        mixed = time_mean(mixed)
        limits = []
        exposures = []
        light = sharp_light(self.lens, mixed)
        if light is None:
            light = time_mean(self.on_sensor(mixed))
        steady = True
        for sensor in self.cameras.values():
            captures = sensor(light, self.generator)
            if propagation.missing(captures):  # a sensor of a plugin whose noise is not known
                xyz = levels(mixed, xyz_weights(mixed.wavelength.values))
                limits.append(UNKNOWN * np.stack([_around(values) for values in xyz]))
                continue
            limits.append(limit_of(captures, light, mixed))
            exposures.append(_exposures(captures))
            for change in (1 + CHANGED, 1 / (1 + CHANGED)):
                if not steady:  # one exposure that changes is enough
                    break
                changed = light.copy(data=light.values * light.dtype.type(change))
                changed_exposures = _exposures(
                    sensor(changed.assign_attrs(light.attrs), self.generator)
                )
                steady = bool(np.allclose(changed_exposures, exposures[-1]))
        rows, columns = mixed.shape[-2:]
        xyz = np.min(limits, axis=0) if limits else np.full((3, rows, columns), np.inf)
        exposures_s = np.concatenate(exposures) if exposures else np.zeros(0)
        return NoiseLimit(dict(mixed.attrs["weights"]), xyz, exposures_s, steady)


def sharp_light(lens: Any, mixed: xr.DataArray) -> xr.DataArray | None:
    """Return the irradiance on the sensor plane without blur and flare, on the tiles of `mixed`;
    None if the lens distorts, or states its relative illumination by a table.

    The lens images a few tiles on its axis, which is enough to measure its throughput without
    imaging the whole field. Flare would add shot noise, so without flare the limit is too low
    rather than too high.
    """
    field = [
        mixed.attrs.get(k) or n for k, n in zip(("field_width", "field_height"), full_field(mixed))
    ]
    # a lens that distorts may move all light of a few tiles beyond them, so it is not called
    if _distorts(lens, field, camera_geometry.projection_of(mixed)):
        return None
    inside = window.tiles(mixed, [tile_pitch(mixed, d) for d in ("x", "y")])
    # what the lens states of these tiles is not what it states of the whole field
    few = ledger.collected(lambda: lens(window.cut(mixed, inside), flares=())).result
    if not isinstance(camera_geometry.map_of(few), camera_geometry.Identity):
        return None
    if few.attrs.get("falloff") == "table":  # it may end with these tiles
        return None
    f_m = few.attrs["focal_length_mm"] * 1e-3
    gain = few.attrs["throughput_sr"] * camera_geometry.relative_illumination(
        few.attrs, mixed.x.values[None, :], mixed.y.values[:, None]
    )
    light = mixed.copy(data=(mixed.values * gain.astype(mixed.dtype)).astype(mixed.dtype))
    light = light.assign_coords(x=mixed.x.values * f_m, y=mixed.y.values * f_m)
    light.attrs = {**few.attrs, "field_width": field[0] * f_m, "field_height": field[1] * f_m}
    return light


def _distorts(lens: Any, field: Sequence[float], projection: str) -> bool:
    """Return whether a lens that knows the size of its image distorts a field.

    Without distortion, the image of a part of the field has the same share of the whole image.

    Parameters
    ----------
    lens : lens of the run.
    field : (width, height) of the camera's field, in the unit of `projection`.
    projection : "tangent" or "equidistant".
    """
    if not isinstance(lens, KnowsImageSize):
        return False
    per_field = [
        np.array(lens.image_size_m(*(share * side for side in field), projection)) / share
        for share in COMPARED
    ]
    return not all(
        np.allclose(size, per_field[0], rtol=IN_PROPORTION, atol=0) for size in per_field
    )


def _exposures(captures: xr.Dataset) -> np.ndarray:
    """Return the numbers that determine the noise of the captures for given light: exposure times
    (s) and read noise (e), in one array.
    """
    return np.concatenate([captures[v].values.ravel() for v in ("exposure_s", "read_noise_e")])


def limit_of(captures: xr.Dataset, light: xr.DataArray, mixed: xr.DataArray) -> np.ndarray:
    """Return the noise limit of one camera: standard deviations (3, y, x) of X, Y and Z of the
    tiles of `mixed`, cd/m2.

    The limit is the noise of the least noisy unsaturated capture at each tile, and infinite where
    all captures are saturated. Each channel limits the one of X, Y and Z that its response
    resembles most.

    Parameters
    ----------
    captures : captures of the camera.
    light : light on its sensor plane, constant over time, computed from `mixed`.
    mixed : (wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1, constant over time.
    """
    wavelength_nm = mixed.wavelength.values
    f_m = light.attrs["focal_length_mm"] * 1e-3
    gain = light.attrs["throughput_sr"] * camera_geometry.relative_illumination(
        light.attrs, light.x.values[None, :] / f_m, light.y.values[:, None] / f_m
    )
    xyz = on_light(levels(mixed, xyz_weights(wavelength_nm)), mixed, light)
    limits = np.full(xyz.shape, np.inf)
    for k in range(captures.sizes["capture"]):
        capture = captures.isel(capture=k)
        counting = capture["quantum_efficiency"].values * photons_per_energy(
            captures.wavelength.values
        )
        scale = float(capture["exposure_s"]) * float(capture["area_m2"])
        constant = (
            float(capture["read_noise_e"]) ** 2
            + float(capture["quantisation_e"]) ** 2 / 12
            + float(capture["dark_e"])
        )
        planes = [scale * propagation.light_plane(row, captures, light) for row in counting]
        end_e = _end(capture, planes, light)
        for row, total in zip(counting, planes):
            image = scale * gain * on_light(propagation.band_sum(row, mixed.values), mixed, light)
            nearest = nearest_xyz(row, wavelength_nm)
            # this light is noisy itself: a tile that is dark by chance has no less noise than the
            # tiles around it
            noise = np.sqrt(np.maximum(total, _around(total)) + constant)
            per_electron = _around(xyz[nearest]) / np.maximum(_around(image), np.finfo(float).tiny)
            limit = np.where((total < end_e) & (image > 0), noise * per_electron, np.inf)
            limits[nearest] = np.minimum(limits[nearest], limit)
    # a pixel larger than a tile is the mean of several tiles
    side = captures.attrs["pitch_um"] * 1e-6
    tiles = side**2 / (tile_pitch(light, "x") * tile_pitch(light, "y"))
    return _at_tiles(limits * np.sqrt(max(tiles, 1.0)), light, mixed)


def _around(values: np.ndarray) -> np.ndarray:
    """Return the mean (y, x) over the tiles around each tile. It is not computed by a running sum,
    which would carry the rounding error of a lamp along its row.
    """
    equal = np.full(2 * REACH + 1, 1 / (2 * REACH + 1))
    rows = correlate1d(values, equal, axis=0, mode="nearest")
    mean: np.ndarray = correlate1d(rows, equal, axis=1, mode="nearest")
    return mean


def _end(capture: xr.Dataset, planes: list[np.ndarray], light: xr.DataArray) -> float:
    """Return the electrons at which a capture stops measuring light; infinite where it never does.

    Parameters
    ----------
    planes : electrons (y, x) of each channel on the grid of `light`.
    """
    saturated = capture["saturated"].values
    if not saturated.any():
        return np.inf
    row, column = np.nonzero(saturated)
    at = [
        np.clip(
            np.round((capture[d].values[k] - light[d].values[0]) / tile_pitch(light, d)), 0, n - 1
        )
        for d, k, n in (("y", row, light.sizes["y"]), ("x", column, light.sizes["x"]))
    ]
    channel = capture["filter"].values[row, column].astype(int)
    electrons = np.stack(planes)[channel, at[0].astype(int), at[1].astype(int)]
    return float(np.quantile(electrons, SATURATED))


def _at_tiles(values: np.ndarray, light: xr.DataArray, mixed: xr.DataArray) -> np.ndarray:
    """Return values (k, y, x) on the grid of `light` at the tiles of `mixed`; infinite where no
    light falls from a tile on that grid, and beyond the camera's field.
    """
    lens = camera_geometry.map_of(light)
    f_m = light.attrs["focal_length_mm"] * 1e-3
    x, y = lens.forward(mixed.x.values[None, :], mixed.y.values[:, None])
    indices = [
        np.round((np.broadcast_to(p, mixed.shape[-2:]) * f_m - light[d].values[0]) / pitch)
        for d, p, pitch in (("y", y, tile_pitch(light, "y")), ("x", x, tile_pitch(light, "x")))
    ]
    inside_grid = np.ones(mixed.shape[-2:], bool)
    for index, d in zip(indices, ("y", "x")):
        inside_grid &= (index >= 0) & (index < light.sizes[d])
    for d, name in (("y", "field_height"), ("x", "field_width")):
        centre = mixed[d].values
        side = mixed.attrs.get(name) or np.inf
        inside = np.abs(centre) < side / 2
        inside_grid &= inside[:, None] if d == "y" else inside[None, :]
    row, column = (np.where(inside_grid, index, 0).astype(int) for index in indices)
    return np.where(inside_grid, values[:, row, column], np.inf)

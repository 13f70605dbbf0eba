"""Small inputs for the conformance kit, made from formulas, and damaged versions of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..data.quantities import IRRADIANCE, RADIANCE, centres, plane, scene_radiance
from ..data.temporal_modulation import stacked
from ..errors import PluginError
from ..physics.detector.temporal_modulation import Modulation
from ..plugins.component import Component
from ..plugins.registry import build, components
from .lazy import sealed

GROUPS = ("sky", "headlights", "streetlights", "other")
FOCAL_LENGTH_MM = 4.0
F_NUMBER = 2.8
THROUGHPUT_SR = np.pi / (1 + 4 * 2.8**2)


def bands_nm(count: int = 7) -> np.ndarray:
    """Return `count` band centres from 400 to 700 nm."""
    return np.linspace(400.0, 700.0, count)


def pattern(shape: tuple[int, ...]) -> np.ndarray:
    """Return an array of positive float64 values from 0.05 to 1 that never repeat; from a fixed
    formula, without random numbers.
    """
    n = np.arange(np.prod(shape), dtype=float)
    return (0.05 + 0.95 * (n * 0.6180339887498949 % 1.0)).reshape(shape)


def scene(
    height: int = 16,
    width: int = 24,
    bands: int = 7,
    pitch: float = 0.01,
    groups: Sequence[str] = GROUPS,
    level: float = 0.01,
) -> xr.Dataset:
    """Return scene radiance with labels of two objects.

    Parameters
    ----------
    height, width : tiles along y and x.
    bands : number of wavelengths.
    pitch : side of a tile, tangents of the field angle.
    groups : names of the light groups.
    level : largest radiance, W m-2 sr-1 nm-1.
    """
    cube = level * pattern((len(groups), bands, height, width))
    instance = np.zeros((height, width), np.uint32)
    instance[2:8, 3:10] = 1
    instance[9:14, 12:20] = 2
    category = np.where(instance == 1, 3, np.where(instance == 2, 1, 0)).astype(np.uint16)
    distance = np.where(instance == 0, np.inf, 10.0 * np.maximum(instance, 1))
    normal = np.zeros((height, width, 3), np.float32)
    normal[..., 0] = np.where(instance > 0, -1.0, 0.0)
    ds = scene_radiance(
        cube,
        groups,
        bands_nm(bands),
        centres(width, width * pitch),
        centres(height, height * pitch),
        depth=distance.astype(np.float32),
        distance=distance.astype(np.float32),
        instance=instance,
        category=category,
        normal=normal,
    )
    ds.attrs["objects"] = [
        {
            "instance": 1,
            "category": "car",
            "name": "car",
            "box": [3, 2, 7, 6],
            "visible_fraction": 1.0,
            "distance_m": 10.0,
            "position_m": [10.0, 0.5, 0.0],
        },
        {
            "instance": 2,
            "category": "person",
            "name": "person",
            "box": [12, 9, 8, 5],
            "visible_fraction": 1.0,
            "distance_m": 20.0,
            "position_m": [20.0, -0.5, 0.0],
        },
    ]
    ds.attrs["lamps"] = [
        {"object": "car", "kind": "low_beam", "group": "headlights", "luminance_cd_m2": 1e5}
    ]
    return ds


def mixed(
    values: npt.ArrayLike | None = None,
    height: int = 24,
    width: int = 32,
    bands: int = 5,
    pitch: float = 0.01,
) -> xr.DataArray:
    """Return mixed radiance of a pattern, or of the given values.

    Parameters
    ----------
    values : array that broadcasts to (bands, height, width), W m-2 sr-1 nm-1; None: a pattern up to
        0.01.
    height, width : tiles along y and x.
    bands : number of wavelengths.
    pitch : side of a tile, tangents of the field angle.
    """
    shape = (bands, height, width)
    values = 0.01 * pattern(shape) if values is None else np.broadcast_to(values, shape)
    return plane(
        np.array(values, np.float32),
        bands_nm(bands),
        centres(width, width * pitch),
        centres(height, height * pitch),
        RADIANCE,
        weights={"sky": 1.0},
        field_width=width * pitch,
        field_height=height * pitch,
    )


def irradiance(
    values: npt.ArrayLike, height: int, width: int, pitch_m: float, bands: int = 31
) -> xr.DataArray:
    """Return irradiance on the sensor plane of an f/2.8 lens of 4 mm.

    Parameters
    ----------
    values : array that broadcasts to (bands, height, width), W m-2 nm-1.
    height, width : tiles along y and x.
    pitch_m : side of a tile on the sensor plane, m.
    bands : number of wavelengths.
    """
    values = np.array(np.broadcast_to(values, (bands, height, width)), np.float32)
    return plane(
        values,
        bands_nm(bands),
        centres(width, width * pitch_m),
        centres(height, height * pitch_m),
        IRRADIANCE,
        f_number=F_NUMBER,
        focal_length_mm=FOCAL_LENGTH_MM,
        throughput_sr=THROUGHPUT_SR,
        falloff="none",
        field_width=width * pitch_m,
        field_height=height * pitch_m,
    )


def in_components(light: xr.DataArray, **modulation: float) -> xr.DataArray:
    """Return mixed radiance or irradiance as one component, constant unless `modulation` gives
    fields of a `Modulation`.
    """
    component: xr.DataArray = stacked(["lamps"], [Modulation(**modulation)], [light])
    return component


def damaged_planes(valid: xr.DataArray) -> Iterator[tuple[str, xr.DataArray]]:
    """Yield (mistake, data) for each possible mistake in mixed radiance or irradiance. Values are
    sealed if the form of the data already shows the mistake.
    """
    for fault, value in (
        ("NaN light", np.nan),
        ("infinite light", np.inf),
        ("negative light", -1e-6),
    ):
        damaged = valid.copy(deep=True)
        damaged[1, 2, 3] = value
        yield fault, damaged
    valid = sealed(valid)
    yield (
        "unsorted wavelengths",
        valid.isel(wavelength=[1, 0, *range(2, valid.sizes["wavelength"])]),
    )
    yield "wavelengths in micrometres", valid.assign_coords(wavelength=valid.wavelength * 1e-3)
    yield "wavelengths in metres", valid.assign_coords(wavelength=valid.wavelength * 1e-9)
    yield "missing wavelengths", valid.drop_vars("wavelength")
    yield "other dims", valid.transpose("y", "x", "wavelength")
    yield "a missing dim", valid.isel(wavelength=0)
    yield "other units", valid.assign_attrs(units="W m-2")
    yield "missing units", valid.assign_attrs(units=None)
    yield "no bands", valid.isel(wavelength=[])
    yield "no tiles", valid.isel(x=[])


def damaged_scenes(valid: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield (mistake, data) for each possible mistake in scene radiance. Values are sealed if the
    form of the data already shows the mistake.
    """
    for fault, value in (
        ("NaN light", np.nan),
        ("infinite light", np.inf),
        ("negative light", -1e-6),
    ):
        damaged = valid.copy(deep=True)
        # in every group: a lighting reads no group of weight 0
        damaged["radiance"][:, 1, 2, 3] = value
        yield fault, damaged
    valid = sealed(valid, "radiance")
    yield (
        "unsorted wavelengths",
        valid.isel(wavelength=[1, 0, *range(2, valid.sizes["wavelength"])]),
    )
    yield "missing wavelengths", valid.drop_vars("wavelength")
    yield (
        "other dims",
        valid.assign(radiance=valid["radiance"].transpose("light_group", "y", "x", "wavelength")),
    )
    yield "other units", valid.assign(radiance=valid["radiance"].assign_attrs(units="W m-2"))
    yield "no bands", valid.isel(wavelength=[])
    yield "no tiles", valid.isel(x=[])
    yield "no variable radiance", valid.drop_vars("radiance")


def some(kind: str, *preferred: str, **fields: Any) -> Any:
    """Return an installed component of `kind`, the first available of `preferred`, for tests of
    another kind.

    `fields` set fields of a preferred component. Any other component is built with its defaults.
    """
    components_of_kind: dict[str, Component] = {
        n: c for (k, n), c in components().items() if k == kind
    }
    for name in (*preferred, *sorted(components_of_kind)):
        if name in components_of_kind:
            return build(kind, name, **(fields if name in preferred else {}))
    raise PluginError(
        f"no {kind} is installed, and one is needed to check this component; install isethdr's own"
        " plugins"
    )

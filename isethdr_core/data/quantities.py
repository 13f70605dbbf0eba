"""The quantities that stages exchange: dims, units, attributes, and checks.

Every stage sets `units` on its output with one of the functions below, and checks its input with
one of the `check_*` functions. Attributes that xarray propagated by itself are never trusted.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..errors import UnitError, did_you_mean
from ..physics.optics.projection import PROJECTIONS
from ..physics.photometry import xyz
from ..plugins.ranges import LEAST_NM, MOST_NM
from .temporal_modulation import time_mean

RADIANCE = "W m-2 sr-1 nm-1"
IRRADIANCE = "W m-2 nm-1"
PHOTOCURRENT = "electrons m-2 s-1"
LUMINANCE = "cd m-2"

SCENE_DIMS = ("light_group", "wavelength", "y", "x")
MIXED_DIMS = ("wavelength", "y", "x")
CHANNEL_DIMS = ("channel", "y", "x")
LABELS = ("depth", "distance", "instance", "category", "normal")
MOTION = "motion"  # a label of scenes that state their next frame
# A label is a coordinate of mixed radiance under its name with this prefix. Light with components
# has a coordinate `depth` of another meaning: the depth of its modulation.
LABEL_PREFIX = "label_"
PARTS_OF_LABELS = {"normal": ("xyz",), MOTION: ("uv",)}  # dimensions besides y and x
LARGEST_HALF_FIELD_DEG = 75.0


def names(values: Iterable[str]) -> np.ndarray:
    """Return strings as the dtype that zarr stores portably."""
    return np.array(list(values), dtype=object)


def centres(count: int, full_width: float) -> np.ndarray:
    """Return the centres of `count` equal tiles that span `full_width` around 0, in its unit."""
    return (np.arange(count) - (count - 1) / 2) * (full_width / count)


def scene_radiance(  # noqa: PLR0913 - plugins call it with these arguments
    radiance: npt.ArrayLike,
    groups: Iterable[str],
    wavelength_nm: npt.ArrayLike,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    field: tuple[float, float] | None = None,
    projection: str = "tangent",
    **labels: npt.ArrayLike,
) -> xr.Dataset:
    """Return a scene radiance Dataset.

    Parameters
    ----------
    radiance : (light_group, wavelength, y, x) array, W m-2 sr-1 nm-1; stored as float32.
    groups : names of the light groups.
    wavelength_nm : band centres in nm, increasing.
    x, y : tile centres as tangents of the field angle (x right, y down, 0 on the axis), or as
        `projection` says.
    field : (width, height), the camera's full field in the unit of x and y; tiles beyond it are
        overscan, rendered so that lamps just outside the frame can flare into it. None: all tiles.
    projection : tangent or equidistant (`physics.optics.projection`).
    labels : any of depth (m), distance (m), instance, category (y, x), normal (y, x, xyz), and
        motion (y, x, uv): the displacement of a tile's content until the next frame, in the unit of
        x and y.

    Raises
    ------
    UnitError : as `check_scene`, or a label is unknown.
    """
    cube = xr.DataArray(
        np.asarray(radiance, np.float32), dims=SCENE_DIMS, attrs={"units": RADIANCE}
    )
    ds = xr.Dataset(
        {"radiance": cube},
        coords={
            "light_group": names(groups),
            "wavelength": np.asarray(wavelength_nm, float),
            "y": np.asarray(y, float),
            "x": np.asarray(x, float),
        },
    )
    ds.wavelength.attrs["units"] = "nm"
    for name, value in labels.items():
        if name not in (*LABELS, MOTION):
            known = ", ".join((*LABELS, MOTION))
            raise UnitError(f"label {name!r} is unknown; expected one of {known}")
        dims = ("y", "x", *PARTS_OF_LABELS.get(name, ()))
        ds[name] = (dims, value, {"units": "m"} if name in ("depth", "distance") else {})
    ds.attrs["field_width"], ds.attrs["field_height"] = field or full_field(ds)
    if projection != "tangent":
        ds.attrs["projection"] = projection
    check_scene(ds)
    return ds


def full_field(data: xr.DataArray | xr.Dataset) -> tuple[float, float]:
    """Return the full width and height that the tiles of `data` cover, in the unit of x and y."""
    return data.sizes["x"] * tile_pitch(data, "x"), data.sizes["y"] * tile_pitch(data, "y")


def tile_pitch(data: xr.DataArray | xr.Dataset, dim: str) -> float:
    """Return the distance between neighbouring tiles along `dim`, in the unit of the coordinate.

    A single tile has no neighbour: it then carries its width in the attribute `pitch_x` or
    `pitch_y`.
    """
    c = np.asarray(data[dim].values, float)
    if len(c) > 1:
        return float((c[-1] - c[0]) / (len(c) - 1))
    return float(data.attrs.get(f"pitch_{dim}", 1.0))


def plane(
    values: npt.ArrayLike,
    wavelength_nm: npt.ArrayLike,
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    units: str,
    **attrs: Any,
) -> xr.DataArray:
    """Return a (wavelength, y, x) DataArray of mixed radiance or irradiance with its units and
    attributes.

    Parameters
    ----------
    values : (wavelength, y, x) array in `units`.
    wavelength_nm : (wavelength,) band centres, nm.
    x, y : (x,) and (y,) tile centres: field coordinates for mixed radiance, m for irradiance; x
        right, y down.
    units : unit of the values, `RADIANCE` or `IRRADIANCE`.
    attrs : further attributes of the array, by name.
    """
    out = xr.DataArray(
        values,
        dims=MIXED_DIMS,
        coords={"wavelength": np.asarray(wavelength_nm, float), "y": y, "x": x},
        attrs={"units": units, **attrs},
    )
    out.wavelength.attrs["units"] = "nm"
    return out


def photocurrent(
    values: npt.ArrayLike,
    channels: Iterable[str],
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    wavelength_nm: npt.ArrayLike,
    efficiency: npt.ArrayLike,
    **attrs: Any,
) -> xr.DataArray:
    """Return a (channel, y, x) DataArray of photocurrent on the sensor plane.

    The efficiency and the bands identify the sensor that it was computed for.

    Parameters
    ----------
    values : (channel, y, x) array, electrons m-2 s-1.
    channels : names of the channels, in the order of `values`.
    x, y : (x,) and (y,) tile centres on the sensor plane, m; x right, y down.
    wavelength_nm : (wavelength,) band centres of the light, nm.
    efficiency : (channel, wavelength) quantum efficiency, electrons per photon.
    attrs : further attributes of the array, by name.
    """
    return xr.DataArray(
        values,
        dims=CHANNEL_DIMS,
        coords={"channel": names(channels), "y": y, "x": x},
        attrs={
            "units": PHOTOCURRENT,
            "wavelength_nm": np.asarray(wavelength_nm, float),
            "efficiency": efficiency,
            **attrs,
        },
    )


def bands_nm(light: xr.DataArray) -> np.ndarray:
    """Return the band centres of irradiance, or of the light from which a photocurrent was
    computed.
    """
    return np.asarray(
        light.wavelength.values if "wavelength" in light.dims else light.attrs["wavelength_nm"],
        float,
    )


def tristimulus(mixed: xr.DataArray) -> xr.Dataset:
    """Return `xyz` (y, x, xyz_channel) of mixed radiance: X, Y, Z with Y in cd/m2. Light that
    varies is averaged over time.
    """
    mixed = time_mean(mixed)
    return xr.Dataset(
        {
            "xyz": (
                ("y", "x", "xyz_channel"),
                xyz(mixed.values, mixed.wavelength.values),
                {"units": LUMINANCE},
            )
        },
        coords={"y": mixed.y.values, "x": mixed.x.values, "xyz_channel": names("XYZ")},
        attrs={
            k: mixed.attrs[k]
            for k in ("field_width", "field_height", "projection")
            if k in mixed.attrs
        },
    )


def check_scene(ds: xr.Dataset) -> None:
    """Raise UnitError unless `ds` is scene radiance: dims, units, increasing bands, and finite
    values of 0 or more.
    """
    check_scene_form(ds)
    _check_light(ds["radiance"], "scene radiance")


def check_scene_form(ds: xr.Dataset) -> None:
    """Do only those checks of `check_scene` that read no light. They suit a cube of which only a
    part will be read.
    """
    if "radiance" not in ds:
        raise UnitError(
            "scene radiance needs a variable 'radiance'; got "
            + (", ".join(map(str, ds)) or "an empty Dataset")
        )
    cube = ds["radiance"]
    _check_dims(cube, SCENE_DIMS, "scene radiance")
    _check_units(cube, RADIANCE, "scene radiance")
    if cube.size == 0:
        raise UnitError(
            f"scene radiance is empty: {dict(cube.sizes)}; expected at least one group, band and"
            " tile"
        )
    _check_bands(cube, "scene radiance")
    _check_uniform(cube, "scene radiance")
    _check_field(ds)


def check_mixed(mixed: xr.DataArray) -> None:
    """Raise UnitError unless `mixed` is mixed radiance on an even grid, W m-2 sr-1 nm-1."""
    _check_plane(mixed, RADIANCE, "mixed radiance")


def check_irradiance(light: xr.DataArray) -> None:
    """Raise UnitError unless `light` is irradiance on the sensor plane, W m-2 nm-1, x and y in
    metres.
    """
    _check_plane(light, IRRADIANCE, "irradiance")
    _check_lens_attributes(light, "irradiance")


def check_photocurrent(light: xr.DataArray) -> None:
    """Raise UnitError unless `light` is photocurrent on the sensor plane, electrons m-2 s-1, x and
    y in metres.
    """
    _check_dims(light, CHANNEL_DIMS, "photocurrent")
    _check_units(light, PHOTOCURRENT, "photocurrent")
    if light.size == 0:
        raise UnitError(
            f"photocurrent is empty: {dict(light.sizes)}; expected at least one channel and tile"
        )
    _check_uniform(light, "photocurrent")
    _check_light(light, "photocurrent")
    _check_lens_attributes(light, "photocurrent", ("wavelength_nm", "efficiency"))


def _check_lens_attributes(light: xr.DataArray, title: str, more: tuple[str, ...] = ()) -> None:
    for name in (
        "f_number",
        "focal_length_mm",
        "throughput_sr",
        "field_width",
        "field_height",
        *more,
    ):
        if name not in light.attrs:
            raise UnitError(
                f"{title} lacks the attribute {name!r}; a lens sets it on its output"
                " (quantities.plane, quantities.photocurrent)"
            )


def _check_plane(data: xr.DataArray, units: str, title: str) -> None:
    _check_dims(data, MIXED_DIMS, title)
    _check_units(data, units, title)
    if data.size == 0:
        raise UnitError(
            f"{title} is empty: {dict(data.sizes)}; expected at least one band and tile"
        )
    _check_bands(data, title)
    _check_uniform(data, title)
    _check_light(data, title)


def _check_dims(data: xr.DataArray, dims: tuple[str, ...], title: str) -> None:
    if tuple(data.dims) != dims:
        todo = ""
        if set(data.dims) == set(dims):
            todo = f"; use .transpose{dims}"
        elif SCENE_DIMS[0] in set(data.dims) - set(dims):
            todo = "; mix the light groups first, for example build('lighting', 'ideal')(radiance)"
        raise UnitError(f"{title} has dims {tuple(map(str, data.dims))}; expected {dims}{todo}")
    for dim in dims:
        if dim not in data.coords:
            raise UnitError(f"{title} has no coordinate {dim!r}; expected coordinates for {dims}")


def _check_units(data: xr.DataArray, units: str, title: str) -> None:
    units_of_data = data.attrs.get("units")
    if units_of_data != units:
        raise UnitError(
            f"{title} has units {units_of_data!r}; expected {units!r}; convert it and set"
            " .attrs['units']"
        )


def _check_bands(data: xr.DataArray, title: str) -> None:
    w = np.asarray(data.wavelength.values, float)
    if not np.all(np.isfinite(w)) or np.any(w <= 0):
        raise UnitError(
            f"{title} has a wavelength that is not a positive number of nm:"
            f" {w[~(np.isfinite(w) & (w > 0))][0]:g}"
        )
    if w.min() < LEAST_NM or w.max() > MOST_NM:
        raise UnitError(
            f"{title} has wavelengths from {w.min():g} to {w.max():g}; expected nanometres, "
            f"{LEAST_NM:g} to {MOST_NM:g}; multiply micrometres by 1e3, metres by 1e9"
        )
    if np.any(np.diff(w) <= 0):
        raise UnitError(
            f"{title} has unsorted or repeated wavelengths {np.array2string(w, threshold=8)};"
            " expected increasing nm; use .sortby('wavelength')"
        )


def _check_uniform(data: xr.DataArray, title: str) -> None:
    for dim in ("x", "y"):
        c = np.asarray(data[dim].values, float)
        if not np.isfinite(c).all():
            raise UnitError(
                f"{title} has {dim} with NaN or infinite values; expected finite tile centres"
            )
        if len(c) > 1:
            step = np.diff(c)
            # 1e-3 of a tile: coordinates stored as float32 still pass on a 8000-pixel row
            if np.any(step <= 0) or np.ptp(step) > 1e-3 * abs(step.mean()):
                raise UnitError(
                    f"{title} has {dim} that is not evenly spaced and increasing; "
                    f"expected tile centres, steps found {step.min():g} to {step.max():g}"
                )


def _check_field(ds: xr.Dataset) -> None:
    projection = ds.attrs.get("projection", "tangent")
    if projection not in PROJECTIONS:
        raise UnitError(
            f"projection {projection!r} is unknown{did_you_mean(str(projection), PROJECTIONS)}"
        )
    edges = [float(np.abs(ds[d].values).max()) for d in ("x", "y")]
    if (
        projection == "tangent"
        and (half := np.degrees(np.arctan(max(edges)))) > LARGEST_HALF_FIELD_DEG
    ):
        raise UnitError(
            f"a tangent grid reaches {half:.1f} degrees off axis; expected at most"
            f" {LARGEST_HALF_FIELD_DEG:g}; use projection 'equidistant' for wider cameras"
        )
    if projection == "equidistant" and (corner := np.hypot(edges[0], edges[1])) > np.pi:
        raise UnitError(
            f"the corners of an equidistant grid lie {np.degrees(corner):.1f} degrees off axis; "
            "expected at most 180: there are no directions beyond"
        )


def _check_light(data: xr.DataArray, title: str) -> None:
    if _plain_light(data.values):
        return
    # np.min and np.max return NaN if any value is NaN
    low = float(np.min(data.values))
    high = float(np.max(data.values))
    if not (np.isfinite(low) and np.isfinite(high)):
        raise UnitError(
            f"{title} holds NaN or infinite values; expected finite light (a damaged store or a"
            " failed render?)"
        )
    if low < 0:
        raise UnitError(
            f"{title} holds negative light ({low:g} {data.attrs.get('units')}); expected 0 or more,"
            " light is never negative; check a subtraction or an interpolation upstream"
        )


def _plain_light(values: np.ndarray) -> bool:
    """Return True if one comparison of bits shows that all values are finite and not negative.
    False means that the slower checks must decide.

    Read as unsigned integers, floats increase from 0 to infinity; NaN and negative numbers follow.
    """
    bits = (
        {4: np.uint32, 8: np.uint64}.get(values.dtype.itemsize)
        if values.dtype.kind == "f" and values.dtype.isnative
        else None
    )
    return bits is not None and values.view(bits).max() < np.array(np.inf, values.dtype).view(bits)

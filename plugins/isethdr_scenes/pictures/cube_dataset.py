"""Spectral cubes with coordinates: zarr stores and NetCDF files, through xarray.

The dims are `wavelength`, `y`, `x`, in any order, and may have `light_group`. Wavelengths are in
nm, or in the unit that the coordinate states. The attribute `units` states the unit of the light.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from isethdr_core.errors import IsetHdrError, UnitError
from isethdr_core.extras import needed

from .content import Content, Wanted, unreadable

DIMS = ("light_group", "wavelength", "y", "x")
NM_PER = {"nm": 1.0, "nanometer": 1.0, "nanometre": 1.0, "um": 1e3, "micrometer": 1e3, "m": 1e9}
HDF5 = b"\x89HDF"  # NetCDF 4 is HDF5
CLASSIC = b"CDF"  # NetCDF 3


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of a zarr store or a NetCDF file.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it holds several arrays and none is named, other dims, or wavelengths of an unknown
        unit.
    """
    with _opened(path) as data:
        cube = _chosen(data, selection, path)
        try:
            cube = cube.load()
        except Exception as err:  # noqa: BLE001 - damaged chunks raise errors of their codecs
            raise unreadable(path, "zarr or NetCDF", err) from None
        return content_of(cube, path)


def _opened(path: Path) -> xr.Dataset:
    try:
        if path.is_dir():
            return xr.open_dataset(path, engine="zarr", consolidated=False)
        with path.open("rb") as file:
            begin = file.read(4)
        if begin != HDF5:
            if not begin.startswith(CLASSIC):
                raise unreadable(path, "NetCDF", f"it begins with {begin!r}")
            return xr.open_dataset(path, engine="scipy")
        with needed("a NetCDF 4 file", extra="netcdf"):
            import h5netcdf  # noqa: F401 - HDF5 alone needs it
        return xr.open_dataset(path, engine="h5netcdf")
    except IsetHdrError:
        raise
    except Exception as err:  # noqa: BLE001 - damaged headers raise errors of many types
        raise unreadable(path, "zarr or NetCDF", err) from None


def _chosen(data: xr.Dataset, selection: Wanted, path: Path) -> xr.DataArray:
    cubes = [str(name) for name, v in data.data_vars.items() if "wavelength" in v.dims]
    usual = "radiance" if "radiance" in cubes else cubes[0] if len(cubes) == 1 else ""
    name = selection.variable or usual
    if name not in data:
        variables = ", ".join(f"{n} {tuple(map(str, v.dims))}" for n, v in data.data_vars.items())
        raise UnitError(
            f"{path} holds {variables or 'no array'}; expected one array with the dims wavelength,"
            f" y, x; type for example scene.variable={cubes[0] if cubes else 'radiance'}"
        )
    return data[name]


def content_of(cube: xr.DataArray, path: Path | str) -> Content:
    """Return the content of a DataArray.

    Raises
    ------
    UnitError : the DataArray has other dims than `DIMS`, wavelengths of an unknown unit, no pixels,
        or values or wavelengths that are no real numbers.
    """
    if "light_group" not in cube.dims:
        cube = cube.expand_dims(light_group=["picture"])
    if set(cube.dims) != set(DIMS) or "wavelength" not in cube.coords:
        raise UnitError(
            f"{path} has the dims {tuple(map(str, cube.dims))}; expected wavelength, y, x, with a"
            " coordinate of wavelengths in nm"
        )
    cube = cube.transpose(*DIMS)
    for what, array in (("values", cube), ("wavelengths", cube.wavelength)):
        if array.dtype.kind not in "fiu":
            raise UnitError(f"{path} holds {what} of type {array.dtype}; expected real numbers")
    if cube.size == 0:
        sizes = ", ".join(f"{name}: {count}" for name, count in cube.sizes.items())
        raise UnitError(f"{path} is empty ({sizes}); expected at least one pixel and one band")
    spelt = str(cube.wavelength.attrs.get("units", "nm"))
    if spelt not in NM_PER:
        raise UnitError(
            f"{path} states wavelengths in {spelt!r}; expected one of {', '.join(NM_PER)}"
        )
    bands = NM_PER[spelt] * np.asarray(cube.wavelength.values, float)
    unit = cube.attrs.get("units")
    return Content(
        np.asarray(cube.values),
        wavelength_nm=tuple(bands.tolist()),
        unit=None if unit is None else str(unit),
        groups=tuple(map(str, cube.light_group.values)),
    )

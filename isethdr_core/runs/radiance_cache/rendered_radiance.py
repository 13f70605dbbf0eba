"""Rendered radiance: checks of what a renderer returns, before it is stored."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from numbers import Real
from typing import Any

import numpy as np
import xarray as xr

from ...data.quantities import check_scene, full_field
from ...errors import PluginError, UnitError

OF_FIELD = {"field_width": "x", "field_height": "y"}  # attributes of the field, and their dims
OF_OBJECT = ("instance", "category", "name", "box")  # keys of an object that results are made from
# tiles may cover this share of the field less: rounding of x and y stored as float32
ROUNDING = 1e-3


def checked(radiance: Any, title: str) -> xr.Dataset:
    """Return what a renderer made, after checking that the later stages can use it.

    Parameters
    ----------
    radiance : what the renderer returned; expected is scene radiance (light_group, wavelength, y,
        x), W m-2 sr-1 nm-1, with the attributes `field_width` and `field_height`.
    title : the renderer in messages, for example "renderer 'mitsuba'".

    Raises
    ------
    PluginError : the renderer returned no Dataset.
    UnitError : wrong dims, units or values; no field, or tiles that do not cover it; an object
        without the keys that results are made from.
    """
    if not isinstance(radiance, xr.Dataset):
        raise PluginError(
            f"{title} returned {type(radiance).__name__}; expected an xarray.Dataset, for example"
            " from isethdr_core.quantities.scene_radiance"
        )
    try:
        check_scene(radiance)
    except UnitError as err:
        raise UnitError(f"{title}: {err}") from err
    for problem in (*_problems_of_field(radiance), *_problems_of_objects(radiance)):
        raise UnitError(f"{title}: {problem}")
    return radiance


def _problems_of_field(radiance: xr.Dataset) -> Iterator[str]:
    """Yield what is wrong with the field that radiance states."""
    for (key, dim), covered in zip(OF_FIELD.items(), full_field(radiance), strict=True):
        size = radiance.attrs.get(key)
        if not (isinstance(size, Real) and 0 < size < math.inf):
            yield (
                f"the attribute {key!r} is {size!r}; expected the camera's full field in the unit"
                f" of {dim}, above 0; set .attrs[{key!r}]"
            )
        elif covered < size * (1 - ROUNDING):
            yield (
                f"the tiles cover {covered:.4g} along {dim}, but {key} is {size:.4g}; expected"
                " tiles for the whole field"
            )


def _problems_of_objects(radiance: xr.Dataset) -> Iterator[str]:
    """Yield what is wrong with the table of objects, which radiance need not have."""
    objects = radiance.attrs.get("objects")
    if objects is None:
        return
    if not isinstance(objects, list | tuple):
        yield (
            f"the attribute 'objects' is of type {type(objects).__name__}; expected a list of"
            f" dictionaries with the keys {_listed(OF_OBJECT)}; set .attrs['objects'] = [] for none"
        )
        return
    for place, entry in enumerate(objects):
        at = f"entry {place} of the attribute 'objects'"
        if not isinstance(entry, Mapping):
            yield f"{at} is {entry!r}; expected a dictionary with the keys {_listed(OF_OBJECT)}"
            continue
        lacking = [key for key in OF_OBJECT if key not in entry]
        if lacking:
            yield f"{at} lacks {_listed(lacking)}; expected the keys {_listed(OF_OBJECT)}"
        elif not _is_box(entry["box"]):
            yield f"{at} has the box {entry['box']!r}; expected [x, y, width, height] in tiles"


def _is_box(box: Any) -> bool:
    """Return whether a box is four real numbers."""
    if not isinstance(box, list | tuple | np.ndarray) or len(box) != 4:
        return False
    return all(isinstance(number, Real) for number in box)


def _listed(keys: tuple[str, ...] | list[str]) -> str:
    return ", ".join(map(repr, keys))

"""Window: the part of the image plane that sensors cover.

A sensor smaller than the field states its window, centred on the axis, in the demand. Without a
statement the window is everything. The plan of the lens (`imaging_plan`) decides which light
outside the window can be left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..data.quantities import full_field

if TYPE_CHECKING:
    import numpy.typing as npt
    import xarray as xr

Size: TypeAlias = tuple[float, float]  # (width, height)

SLIVER = 1e-10  # share of a tile; a smaller overlap is a rounding error of coordinates


def wider(first: Size | None, second: Size | None) -> Size | None:
    """Return the smallest window (width, height) that contains both windows.

    None means the whole image plane.
    """
    if first is None or second is None:
        return None
    return max(first[0], second[0]), max(first[1], second[1])


def tiles(data: xr.DataArray, window: Sequence[float]) -> dict[str, slice]:
    """Return the slices {y, x} of the tiles of `data` that overlap a centred window.

    There are at least two tiles along each axis. The window (width, height) has the unit of the
    coordinates.
    """
    return {d: within(data[d].values, side) for d, side in zip(("x", "y"), window)}


def within(centres: npt.NDArray[Any], side: float) -> slice:
    """Return the slice of the tiles that overlap an interval of length `side` about 0.

    `centres` are the centres of evenly spaced tiles. There are at least two tiles in the slice.
    """
    pitch = (centres[-1] - centres[0]) / max(len(centres) - 1, 1)
    inside = np.flatnonzero(np.abs(centres) - pitch / 2 < side / 2 - SLIVER * pitch)
    if len(inside) < 2:  # a tile's size is known from its neighbour
        inside = np.sort(np.argsort(np.abs(centres), kind="stable")[:2])
    return slice(int(inside[0]), int(inside[-1]) + 1)


def cut(mixed: xr.DataArray, inside: dict[str, slice]) -> xr.DataArray:
    """Return the tiles `inside` of mixed radiance. The attributes keep the camera's full field."""
    if all(mixed.sizes[d] == len(range(mixed.sizes[d])[s]) for d, s in inside.items()):
        return mixed
    width, height = (
        mixed.attrs.get(k) or n for k, n in zip(("field_width", "field_height"), full_field(mixed))
    )
    return mixed.isel(inside).assign_attrs(field_width=width, field_height=height)

"""Camera geometry: the lines of sight of pixels, from the attributes of irradiance, captures and
pictures.

The attributes `distortion` {model: ..., its numbers} and `projection` are absent if the lens keeps
the grid of tangents. `falloff` is cos4, none or table; a table has `falloff_table` {angle_deg:
[...], relative: [...]}. Positions on the sensor are in focal lengths, so that a lens without
distortion images light at its own field coordinates.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import xarray as xr

from ..errors import ConfigError, UnitError, did_you_mean
from ..physics.optics import distortion as maps
from ..physics.optics import projection as projections
from ..physics.resampling.overlap import borders, overlap_areas
from .quantities import tile_pitch

if TYPE_CHECKING:
    from scipy.sparse._csr import csr_array

    from ..physics.optics.distortion import AngleTable, BrownConrady, KannalaBrandt, OnAngles

    DistortionMap: TypeAlias = "AngleTable | BrownConrady | KannalaBrandt | OnAngles | Identity"

# attributes of the lines of sight of pixels: sensor and isp pass them on
PLACES = (
    "projection",
    "distortion",
)
# the same attributes and the relative illumination: the sensor passes all of them on
CARRIED = (
    *PLACES,
    "falloff",
    "falloff_table",
)
MODELS = {
    "brown_conrady": maps.BrownConrady,
    "kannala_brandt": maps.KannalaBrandt,
    "table": maps.AngleTable,
}
# largest value of a parameter of a distortion model: coefficient, angle in degrees, focal length
LARGEST_NUMBER = 1000.0
FALLOFFS = ("cos4", "none", "table")
EDGE_POINTS = 65  # number of points along each side of a box


@dataclass(frozen=True)
class Identity:
    """A lens that keeps the grid."""

    def forward(
        self, x: float | np.ndarray, y: float | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (x, y)."""
        return np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))

    inverse = forward

    def area_ratio(self, x: float | np.ndarray, y: float | np.ndarray) -> np.ndarray:
        """Return 1 everywhere."""
        return np.ones(np.broadcast_shapes(np.shape(x), np.shape(y)))


def projection_of(data: xr.DataArray | xr.Dataset) -> str:
    """Return the projection that the attributes of a field state; 'tangent' if they state none.
    Raise UnitError for an unknown projection.
    """
    projection = data.attrs.get("projection", "tangent")
    if projection not in projections.PROJECTIONS:
        raise UnitError(
            f"projection {projection!r} is"
            f" unknown{did_you_mean(str(projection), projections.PROJECTIONS)}"
        )
    return projection


def distortion_map(
    distortion: str | dict[str, float | str] | None, projection: str = "tangent"
) -> DistortionMap:
    """Return the map of {model: brown_conrady | kannala_brandt | table, its numbers...}, or
    `Identity` for none.

    Zero coefficients of brown_conrady on tangents, and of kannala_brandt on angles, are the
    identity too.

    Raises
    ------
    ConfigError : an unknown model or key, or a table that does not rise.
    """
    return _map(
        json.dumps({} if distortion in (None, "none") else dict(distortion), default=list),
        projection,
    )


@lru_cache(maxsize=32)
def _map(text: str, projection: str) -> Any:
    parameters = json.loads(text)
    if not parameters:
        return Identity()
    model = parameters.pop("model", None)
    if model not in MODELS:
        raise ConfigError(
            f"lens.distortion has model {model!r}{did_you_mean(str(model), MODELS)}; "
            "type for example 'lens.distortion={model:brown_conrady,k1:-0.1}'"
        )
    parameter_names = [f.name for f in fields(MODELS[model])]
    for key in parameters:
        if key not in parameter_names:
            raise ConfigError(
                f"lens.distortion has no key {key!r} for model"
                f" {model}{did_you_mean(key, parameter_names)}"
            )
    numbers = {key: _numbers(model, key, value) for key, value in parameters.items()}
    try:
        lens = MODELS[model](**numbers)
    except (TypeError, ValueError) as err:
        raise ConfigError(f"lens.distortion of model {model}: {err}") from None
    natural = {"brown_conrady": "tangent", "kannala_brandt": "equidistant"}.get(model)
    if natural == projection and not any(parameters.values()):
        return Identity()
    return maps.on_projection(lens, projection)


def _numbers(model: str, key: str, value: float | list[float]) -> float | tuple[float, ...]:
    """Return a number as a float, or a list of numbers as a tuple of floats."""
    for number in value if isinstance(value, list) else [value]:
        plain = isinstance(number, (int, float)) and not isinstance(number, bool)
        if not (plain and abs(number) <= LARGEST_NUMBER):  # false for NaN
            raise ConfigError(
                f"lens.distortion of model {model} has {key}={value!r}; expected "
                f"{-LARGEST_NUMBER:g} to {LARGEST_NUMBER:g}; "
                "type for example 'lens.distortion={model:brown_conrady,k1:-0.1}'"
            )
    return tuple(map(float, value)) if isinstance(value, list) else float(value)


def map_of(data: xr.DataArray | xr.Dataset) -> DistortionMap:
    """Return the map from field coordinates to the sensor that the attributes of light, captures or
    a picture state.
    """
    return distortion_map(data.attrs.get("distortion"), projection_of(data))


def images_of(
    lens: DistortionMap, x: float | np.ndarray, y: float | np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions on the sensor, in focal lengths, of any field coordinates (broadcast);
    NaN where a coordinate is not finite, or lies beyond the end of the map.

    Parameters
    ----------
    lens : a map, as `distortion_map` returns it.
    x, y : field coordinates, x right, y down, 0 on the axis.
    """
    x, y = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    on_angles = isinstance(lens, maps.OnAngles)
    model = lens.lens if isinstance(lens, maps.OnAngles) else lens
    angle = projections.angle_rad(x, y, "equidistant" if on_angles else "tangent")
    largest = np.inf
    if isinstance(model, maps.AngleTable):
        largest = float(np.radians(model.angle_deg[-1]))
    elif on_angles and isinstance(model, maps.BrownConrady):
        largest = np.nextafter(np.pi / 2, 0.0)  # a direction at 90 degrees has no tangent
    known = np.isfinite(x) & np.isfinite(y) & (angle <= largest)
    images = np.full((2, *x.shape), np.nan)
    images[:, known] = lens.forward(x[known], y[known])
    return images[0], images[1]


def relative_illumination(
    attrs: dict[str, Any], x: float | np.ndarray, y: float | np.ndarray
) -> np.ndarray:
    """Return the irradiance of a uniform scene over throughput x radiance, at sensor positions in
    focal lengths (broadcast).

    This is the falloff at the field angle that is imaged there, times the field area per sensor
    area. A table already contains both.

    Parameters
    ----------
    attrs : attributes of irradiance, captures or a picture: `distortion`, `projection`, `falloff`
        and, for the falloff `table`, `falloff_table`.
    x, y : positions on the sensor in focal lengths, x right, y down, 0 on the axis; any shapes that
        broadcast.

    Raises
    ------
    UnitError : an unknown falloff, which would otherwise count as none.
    """
    projection = attrs.get("projection", "tangent")
    lens = distortion_map(attrs.get("distortion"), projection)
    u, v = lens.inverse(*np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float)))
    kind = attrs.get("falloff", "none")
    if kind not in FALLOFFS:
        raise UnitError(f"falloff {kind!r} is unknown{did_you_mean(str(kind), FALLOFFS)}")
    if kind == "table":
        return table_values(
            attrs["falloff_table"], np.degrees(projections.angle_rad(u, v, projection))
        )
    return (projections.cos4(u, v, projection) if kind == "cos4" else 1.0) / lens.area_ratio(u, v)


def table_values(table: dict[str, list[float]], angle_deg: np.ndarray) -> np.ndarray:
    """Return values of {angle_deg, relative} at angles, by monotone cubic interpolation. Raise
    ConfigError for an angle beyond the table's end.
    """
    from scipy.interpolate import PchipInterpolator

    angles, values = (np.asarray(table[k], float) for k in ("angle_deg", "relative"))
    largest = float(np.max(angle_deg, initial=0.0))
    if largest > angles[-1] * (1 + 1e-9):
        raise ConfigError(
            f"the table of relative illumination ends at {angles[-1]:g} degrees, the field reaches"
            f" {largest:.4g}; expected a longer table in lens.falloff, a smaller field, or less"
            " overscan (renderer.margin)"
        )
    return PchipInterpolator(angles, values)(np.minimum(angle_deg, angles[-1]))


def field_areas(
    lens: DistortionMap,
    x_in: np.ndarray,
    y_in: np.ndarray,
    x_out: np.ndarray,
    y_out: np.ndarray,
) -> csr_array:
    """Return the (sensor tile, field tile) matrix of shared areas, in field coordinates. The last
    two results are kept in the process.

    Parameters
    ----------
    lens : a map, as `distortion_map` returns it.
    x_in, y_in : borders of the field's tiles (n + 1,), evenly spaced.
    x_out, y_out : borders of the sensor's tiles in focal lengths.

    Raises
    ------
    ValueError : a sensor tile covers field outside the given tiles, where the light is not known.
    """
    return _areas(lens, *(np.asarray(b, float).tobytes() for b in (x_in, y_in, x_out, y_out)))


@lru_cache(maxsize=2)
def _areas(lens: DistortionMap, *grids: bytes) -> csr_array:
    return overlap_areas(
        *(np.frombuffer(g) for g in grids[:2]), lens, *(np.frombuffer(g) for g in grids[2:])
    )


@dataclass(frozen=True)
class PixelGrid:
    """Square pixels side by side, in focal lengths."""

    x: np.ndarray  # centres, one pitch apart
    y: np.ndarray
    pitch: float  # side of a pixel


def mean_over_pixels(
    tiles: np.ndarray,
    field: xr.DataArray | xr.Dataset,
    lens: Any,
    pixels: PixelGrid,
    beyond: bool = False,
) -> np.ndarray:
    """Return the mean (..., y, x) of constant tiles over the part of the field that each pixel
    covers, a quadrilateral.

    Parameters
    ----------
    tiles : (..., y, x) values on the grid of `field`.
    field : the scene's grid, with its projection.
    lens : a map, as `distortion_map` returns it.
    pixels : the grid of the means.
    beyond : whether pixels may cover field outside the tiles; the tiles at the border are then
        extended.

    Raises
    ------
    ValueError : pixels cover field outside the tiles without `beyond`, or are not evenly spaced.
    """
    x = pixels.x
    y = pixels.y
    pitch = pixels.pitch
    for centres in (x, y):
        if len(centres) > 1 and np.abs(np.diff(centres) - pitch).max() > 1e-6 * pitch:
            raise ValueError(
                "the pixels are not evenly spaced; expected centres one pixel pitch apart, which"
                " distortion needs"
            )
    grids = (
        *(borders(field[d].values, tile_pitch(field, d)) for d in ("x", "y")),
        borders(x, pitch),
        borders(y, pitch),
    )
    if beyond:
        grids, more = _widened(lens, *grids)
        tiles = np.pad(tiles, [(0, 0)] * (np.ndim(tiles) - 2) + [(more, more)] * 2, mode="edge")
    areas = field_areas(lens, *grids)
    means = (areas @ np.reshape(tiles, (-1, areas.shape[1])).T).T / areas.sum(axis=1)
    return means.reshape(*np.shape(tiles)[:-2], len(y), len(x))


def _widened(
    lens: DistortionMap,
    x_in: np.ndarray,
    y_in: np.ndarray,
    x_out: np.ndarray,
    y_out: np.ndarray,
) -> tuple[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray], int]:
    """Extend the field on every side by as many tiles as the sensor's tiles reach beyond it. Return
    all borders, and the number of tiles added on one side.
    """
    field_points = lens.inverse(*np.meshgrid(x_out, y_out))
    more = 0
    for at, given_points in zip(field_points, (x_in, y_in)):
        reach = (
            max(given_points[0] - at.min(), at.max() - given_points[-1])
            * (len(given_points) - 1)
            / np.ptp(given_points)
        )
        more = max(more, int(np.ceil(reach - 1e-6)))
    steps = np.arange(1, more + 1)
    x_in, y_in = (
        np.concatenate([b[0] - (b[1] - b[0]) * steps[::-1], b, b[-1] + (b[-1] - b[-2]) * steps])
        for b in (x_in, y_in)
    )
    return (x_in, y_in, x_out, y_out), more


def box_on_sensor(
    lens: DistortionMap,
    left: float,
    top: float,
    right: float,
    bottom: float,
) -> tuple[float, float, float, float]:
    """Return (left, top, right, bottom) in focal lengths of the smallest box around the image of a
    rectangle of the field.

    Parameters
    ----------
    lens : distortion map from field coordinates to the sensor, as `distortion_map` returns.
    left, top, right, bottom : borders of the rectangle in field coordinates: tangents of the field
        angle, or radians for an equidistant projection; x right, y down.
    """
    side = np.linspace(0, 1, EDGE_POINTS)
    u = (
        np.concatenate([side, np.ones_like(side), side, np.zeros_like(side)]) * (right - left)
        + left
    )
    v = np.concatenate([np.zeros_like(side), side, np.ones_like(side), side]) * (bottom - top) + top
    x, y = lens.forward(u, v)
    return float(x.min()), float(y.min()), float(x.max()), float(y.max())

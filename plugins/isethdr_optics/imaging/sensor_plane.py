"""Sensor plane: positions at which a lens images the tiles of a field, and their relative
illumination.

The light of a tile is multiplied by `relative` and convolved on the field's own grid. Then it is
moved by the distortion: every sensor tile gets the light of its quadrilateral in the field. The
energy of any region is conserved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core import quantities
from isethdr_core.data import camera_geometry
from isethdr_core.errors import ConfigError
from isethdr_core.ledger import Note
from isethdr_core.physics.optics import projection as projections
from isethdr_core.physics.resampling.overlap import borders
from isethdr_core.uncertainty.error_terms import ErrorTerm

from ..abilities import TracesColour
from ..field import lateral_colour, omissions
from ..psf.error_parts import term

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.data.camera_geometry import Identity
    from isethdr_core.physics.optics.distortion import AngleTable, BrownConrady, KannalaBrandt

    from ..abilities import LensOptics

BORDER_POINTS = 129  # number of points along each side of the field
CHECKED = 65  # number of points along each axis at which the map is checked for folds


@dataclass(frozen=True, eq=False)
class SensorPlane:
    """The sensor's tiles of one field and one lens."""

    relative: np.ndarray | float  # factor on the light of the field's tiles, before it is moved
    x: np.ndarray  # tile centres, focal lengths
    y: np.ndarray  # tile centres, focal lengths
    field: tuple[float, float]  # width and height of the camera's field, focal lengths
    # attributes of irradiance: falloff; distortion, projection and chief rays if there are any
    attrs: dict
    # sparse (sensor tile, field tile): shared area over the area of a tile; None: same grid
    areas: object = None
    # magnification of every band over that of the reference: a number, or a
    # `lateral_colour.Course`; None: 1 for all bands
    scales: list | None = None
    unmagnified_shape: tuple[int, int] | None = None  # (y, x) tiles before bands are magnified
    stretched: float = 0.0  # largest relative stretch of the image by distortion
    # share of a border tile that the smallest band's image leaves dark, summed over both axes
    dark_corner_share: float = 0.0
    notes: tuple[Note, ...] = ()  # errors of moving the light, and omissions

    @property
    def keeps_grid(self) -> bool:
        """Whether the sensor's tiles are the tiles of the field."""
        return self.areas is None and self.scales is None

    def of_tiles(self, tiles: dict[str, slice] | None) -> SensorPlane:
        """Return the plane of some tiles {y, x} of the field; None: all. `keeps_grid` must be
        true.
        """
        if tiles is None:
            return self
        y = tiles["y"]
        x = tiles["x"]
        relative = self.relative[y, x] if np.ndim(self.relative) else self.relative
        return replace(self, relative=relative, x=self.x[x], y=self.y[y])

    def move(self, values: np.ndarray) -> np.ndarray:
        """Return irradiance (..., y, x) moved from the field's tiles to the sensor's.

        Without distortion this is the same array.
        """
        if self.keeps_grid:
            return values
        out = np.empty((*values.shape[:-2], len(self.y), len(self.x)), values.dtype)
        for plane in np.ndindex(values.shape[:-2]):
            out[plane] = self.move_band(values[plane], plane[-1])
        return out

    def move_band(self, values: np.ndarray, band: int) -> np.ndarray:
        """Return the light (y, x) of one band moved from the field's tiles to the sensor's."""
        shape = len(self.y), len(self.x)
        if self.areas is not None:
            values = (self.areas @ values.ravel().astype(float)).reshape(
                self.unmagnified_shape or shape
            )
        return (
            values
            if self.scales is None
            else lateral_colour.moved(values, self.scales[band], shape)
        )

    def covered(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return `mixed` padded with dark tiles to the size of the sensor.

        Flares may add light in these tiles.
        """
        padding = [
            max(len(coordinates) - mixed.sizes[d], 0) // 2
            for d, coordinates in (("y", self.y), ("x", self.x))
        ]
        if not any(padding):
            return mixed
        centres = {}
        for d, count in zip(("y", "x"), padding):
            coordinates = mixed[d].values
            pitch = quantities.tile_pitch(mixed, d)
            centres[d] = np.concatenate(
                [
                    coordinates[0] - pitch * np.arange(count, 0, -1),
                    coordinates,
                    coordinates[-1] + pitch * np.arange(1, count + 1),
                ]
            )
        values = np.pad(mixed.values, ((0, 0), *((count, count) for count in padding)))
        return quantities.plane(
            values,
            mixed.wavelength.values,
            centres["x"],
            centres["y"],
            quantities.RADIANCE,
            **{k: v for k, v in mixed.attrs.items() if k != "units"},
        )

    def cut(self, added: xr.DataArray) -> xr.DataArray:
        """Return the part of irradiance on the sensor's tiles, from a larger grid of the same
        pitch.
        """
        if added.sizes["y"] == len(self.y) and added.sizes["x"] == len(self.x):
            return added
        top, left = ((added.sizes[d] - len(c)) // 2 for d, c in (("y", self.y), ("x", self.x)))
        return added[:, top : top + len(self.y), left : left + len(self.x)]


def without_geometry(lens: LensOptics) -> LensOptics:
    """Return the lens with the blur of its axis, without distortion, falloff and lateral colour.

    Kernels depend on none of these.
    """
    axis = lens.on_axis()
    traced = {"lateral_colour": "none"} if isinstance(axis, TracesColour) else {}
    return replace(axis, distortion="none", falloff="none", lateral_colour_percent={}, **traced)


def sensor_plane(lens: LensOptics, mixed: xr.DataArray) -> SensorPlane:
    """Return the sensor plane of a lens for the field of `mixed`.

    The sensor's tiles have the pitch of the field's tiles. They cover the largest centred rectangle
    that gets light only from within the field.

    Raises
    ------
    ConfigError : the distortion folds the field over; its table ends within the field; or the
        falloff is cos4 and the field reaches 90 degrees.
    """
    x, y = (mixed[d].values.astype(float) for d in ("x", "y"))
    pitch = [quantities.tile_pitch(mixed, d) for d in ("x", "y")]
    projection = camera_geometry.projection_of(mixed)
    half = [np.abs(c).max() + p / 2 for c, p in zip((x, y), pitch)]
    widest = float(projections.angle_rad(*half, projection))
    distortion = lens.distortion_to(widest)
    distortion_map = camera_geometry.distortion_map(distortion, projection)
    kept = isinstance(distortion_map, camera_geometry.Identity)
    attrs = {} if projection == "tangent" else {"projection": projection}
    if chief_rays := lens.chief_rays_to(widest):
        attrs["chief_rays"] = chief_rays
    if not kept:
        attrs["distortion"] = distortion
        _check_no_fold(distortion_map, half)
    relative, falloff = _relative_illumination(lens, distortion_map, x, y, projection, widest)
    field = tuple(
        mixed.attrs.get(k) or n
        for k, n in zip(("field_width", "field_height"), quantities.full_field(mixed))
    )
    if kept:
        nothing_moved = (omissions.NO_DISTORTION,)
        plane = SensorPlane(relative, x, y, field, attrs | falloff, notes=nothing_moved)
        return lateral_colour.coloured(lens, mixed, plane, distortion_map)
    scale = _inscribed_scale(distortion_map, half)
    sensor = [_tiles(len(c), 2 * h * scale, p) for c, h, p in zip((x, y), half, pitch)]
    grids = [borders(c, p) for c, p in zip((x, y, *sensor), (*pitch, *pitch))]
    try:
        areas = camera_geometry.field_areas(distortion_map, *grids) / (pitch[0] * pitch[1])
    except ValueError as err:
        raise ConfigError(f"lens.distortion does not fit the field: {err}") from None
    uniform = areas @ np.broadcast_to(relative, (len(y), len(x))).ravel()
    error = _error_of_uniform_light(uniform, attrs | falloff, sensor)
    inner = _inscribed_scale(distortion_map, [w / 2 for w in field])
    scale = tuple(min(w * inner, len(c) * p) for w, c, p in zip(field, sensor, pitch))
    plane = SensorPlane(
        relative,
        *sensor,
        scale,
        attrs | falloff,
        areas,
        stretched=_largest_stretch(distortion_map, half),
        notes=(error,),
    )
    return lateral_colour.coloured(lens, mixed, plane, distortion_map)


def image_size(
    lens: LensOptics, width: float, height: float, projection: str = "tangent"
) -> tuple[float, float]:
    """Return (width, height), in focal lengths, of the largest centred rectangle on the sensor
    plane that gets light only from within a field. It is at most 1e-6 too large.

    Parameters
    ----------
    lens : lens that gives the distortion.
    width, height : size of the field, in the unit of `projection`.
    projection : projection of the field, as in `isethdr_core.physics.optics.projection`.

    Notes
    -----
    `sensor_plane` may give a smaller rectangle, because it has whole tiles only.

    Raises
    ------
    ConfigError : the distortion folds the field over, or its table ends within the field.
    """
    half = width / 2, height / 2
    distortion_map = camera_geometry.distortion_map(
        lens.distortion_to(float(projections.angle_rad(*half, projection))), projection
    )
    if isinstance(distortion_map, camera_geometry.Identity):
        return width, height
    _check_no_fold(distortion_map, half)
    # 1e-6, because a table over this field differs in its last digits from one with overscan
    scale = _inscribed_scale(distortion_map, half) * (1 + 1e-6)
    return width * scale, height * scale


def _relative_illumination(
    lens: LensOptics,
    distortion_map: BrownConrady | Identity | KannalaBrandt,
    x: np.ndarray,
    y: np.ndarray,
    projection: str,
    widest: float,
) -> tuple[float | np.ndarray, dict[str, dict[Any, Any] | str] | dict[str, str]]:
    """Return the factor on the light of the field's tiles, (y, x) or 1.0, and the attributes of the
    falloff.
    """
    falloff = lens.falloff_to(widest)
    if falloff == "none":
        return 1.0, {"falloff": "none"}
    u = x[None, :]
    v = y[:, None]
    if falloff == "cos4":
        if widest >= np.pi / 2:
            raise ConfigError(
                f"the field reaches {np.degrees(widest):.4g} degrees, where cos4 leaves no light; "
                "type lens.falloff=none, or a table, for example 'lens.falloff={0:1,95:0.4}'"
            )
        return projections.cos4(u, v, projection), {"falloff": "cos4"}
    table = {
        "angle_deg": [float(a) for a in falloff],
        "relative": [float(v) for v in falloff.values()],
    }
    on_sensor = camera_geometry.table_values(
        table, np.degrees(projections.angle_rad(u, v, projection))
    )
    return on_sensor * distortion_map.area_ratio(u, v), {"falloff": "table", "falloff_table": table}


def _check_no_fold(
    distortion_map: AngleTable | BrownConrady | KannalaBrandt, half: Sequence[float]
) -> None:
    try:
        u, v = np.meshgrid(*(np.linspace(-h, h, CHECKED) for h in half))
        single = distortion_map.area_ratio(u, v) > 0
    except ValueError as err:
        raise ConfigError(f"lens.distortion does not fit the field: {err}") from None
    if not single.all():
        radius = np.hypot(u, v)[~single].min()
        raise ConfigError(
            f"lens.distortion folds the field over at {radius:.4g} from the axis, the field reaches"
            f" {np.hypot(*half):.4g}; expected other coefficients or a smaller field"
        )


def _inscribed_scale(distortion_map: BrownConrady | KannalaBrandt, half: Sequence[float]) -> float:
    """Return the largest s for which the rectangle +-s `half` on the sensor gets light only from
    within the rectangle +-`half` of the field.
    """
    side = np.linspace(-1, 1, BORDER_POINTS)
    u = np.concatenate([side, side, -np.ones_like(side), np.ones_like(side)]) * half[0]
    v = np.concatenate([-np.ones_like(side), np.ones_like(side), side, side]) * half[1]
    x, y = distortion_map.forward(u, v)
    low = 0.0
    high = float(min(x.max() / half[0], y.max() / half[1]))
    for _ in range(60):
        middle = (low + high) / 2
        try:
            a, b = distortion_map.inverse(middle * u, middle * v)
            inside = max(np.abs(a).max() / half[0], np.abs(b).max() / half[1]) <= 1
        except ValueError:  # the map may have no inverse beyond the image of the field
            inside = False
        low, high = (middle, high) if inside else (low, middle)
    return low


def _tiles(count: int, width: float | np.ndarray, pitch: float | np.ndarray) -> np.ndarray:
    """Return the centres of as many tiles as fit into `width`, symmetric about the axis.

    Their number differs from `count` by a multiple of two, so that the grid is not shifted.
    """
    fits = int(np.floor(width / pitch * (1 + 1e-12)))
    fits -= (fits - count) % 2
    if fits < 1:
        raise ConfigError(
            "lens.distortion leaves no whole tile of the field on the sensor; expected a finer or"
            " wider field"
        )
    return quantities.centres(fits, fits * pitch)


def _error_of_uniform_light(
    uniform: np.ndarray, attrs: dict[str, Any], sensor: Sequence[np.ndarray]
) -> ErrorTerm:
    """Return the error of uniform light against the relative illumination of the attributes.

    Parameters
    ----------
    uniform : (tile,) light of a uniform scene on the sensor's tiles, flat.
    attrs : attributes of irradiance.
    sensor : (x,) and (y,) centres of the sensor's tiles, focal lengths.
    """
    x, y = np.meshgrid(*sensor)
    stated = camera_geometry.relative_illumination(attrs, x, y)
    worst = np.abs(uniform.reshape(x.shape) - stated).max() / stated.max()
    label = (
        "uniform light moved along the distortion: tiles have straight sides and one relative"
        " illumination each"
    )
    return term(worst, "relative", "measured", label, key="uniform light")


def _largest_stretch(
    distortion_map: AngleTable | BrownConrady | KannalaBrandt, half: Sequence[float]
) -> float:
    """Return the largest relative stretch of an image by distortion."""
    u, v = np.meshgrid(*(np.linspace(-h, h, 17) * (1 - 1e-4) for h in half))
    step = 1e-5 * max(half)
    across, down = (
        np.stack(
            np.subtract(distortion_map.forward(u + a, v + b), distortion_map.forward(u - a, v - b))
        )
        / (2 * step)
        for a, b in ((step, 0.0), (0.0, step))
    )
    stretched = np.linalg.svd(
        np.stack([across, down], axis=-1).transpose(1, 2, 0, 3), compute_uv=False
    )
    return float(np.abs(stretched - 1).max())

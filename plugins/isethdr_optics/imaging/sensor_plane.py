"""Sensor plane: where a lens sends the tiles of a field, and how much of their light.

Light of a field's tile is multiplied by `relative`, spread by the lens on the field's own grid,
then moved along the distortion: every sensor tile gets the light of the quadrilateral of the field
that it looks at, so that the light of any region is kept.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

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

BORDER_POINTS = 129  # along each side of the field
CHECKED = 65  # x 65 points of the field at which a map must not fold


@dataclass(frozen=True, eq=False)
class SensorPlane:
    """The sensor's tiles of one field and one lens."""

    relative: np.ndarray | float  # of the light of the field's tiles, before it is moved
    x: np.ndarray  # tile centres, focal lengths
    y: np.ndarray
    field: tuple[float, float]  # width and height of the camera's field, focal lengths
    attrs: (
        dict  # for irradiance: falloff, and distortion and projection where they are not the usual
    )
    # (sensor tile, field tile) shared areas over the area of a tile; None where the grid is kept
    areas: object = None
    scales: list | None = (
        # magnification of every band over that of the reference, numbers or courses; None where all
        # are 1
        None
    )
    whole: tuple[int, int] | None = None  # (y, x) tiles before bands are magnified
    stretched: float = 0.0  # by how much images are drawn out at most, relative
    lacking: float = (
        0.0  # share of a corner tile that the smallest band's image leaves dark, at most
    )
    notes: tuple[Note, ...] = ()  # errors of moving light there, and what was spared

    @property
    def keeps_grid(self) -> bool:
        """Whether the sensor's tiles are those of the field."""
        return self.areas is None and self.scales is None

    def of_tiles(self, tiles: dict[str, slice] | None) -> SensorPlane:
        """Return the plane of some tiles {y, x} of a field whose grid is kept; None: all."""
        if tiles is None:
            return self
        y, x = tiles["y"], tiles["x"]
        relative = self.relative[y, x] if np.ndim(self.relative) else self.relative
        return replace(self, relative=relative, x=self.x[x], y=self.y[y])

    def move(self, values) -> np.ndarray:
        """Return irradiance (..., y, x) on the sensor's tiles from that on the field's; the same
        array without distortion.
        """
        if self.keeps_grid:
            return values
        out = np.empty((*values.shape[:-2], len(self.y), len(self.x)), values.dtype)
        for plane in np.ndindex(values.shape[:-2]):
            out[plane] = self.move_band(values[plane], plane[-1])
        return out

    def move_band(self, values, band: int) -> np.ndarray:
        """Return one band's light (y, x) on the sensor's tiles from that on the field's."""
        shape = len(self.y), len(self.x)
        if self.areas is not None:
            values = (self.areas @ values.ravel().astype(float)).reshape(self.whole or shape)
        return (
            values
            if self.scales is None
            else lateral_colour.moved(values, self.scales[band], shape)
        )

    def covered(self, mixed):
        """Return `mixed`, dark tiles added all around where the sensor is larger: what flares add
        may fall there.
        """
        more = [max(len(c) - mixed.sizes[d], 0) // 2 for d, c in (("y", self.y), ("x", self.x))]
        if not any(more):
            return mixed
        grown = {}
        for d, m in zip(("y", "x"), more):
            c, p = mixed[d].values, quantities.tile_pitch(mixed, d)
            grown[d] = np.concatenate(
                [c[0] - p * np.arange(m, 0, -1), c, c[-1] + p * np.arange(1, m + 1)]
            )
        values = np.pad(mixed.values, ((0, 0), *((m, m) for m in more)))
        return quantities.plane(
            values,
            mixed.wavelength.values,
            grown["x"],
            grown["y"],
            quantities.RADIANCE,
            **{k: v for k, v in mixed.attrs.items() if k != "units"},
        )

    def cut(self, added):
        """Return irradiance on the sensor's tiles, the middle of a larger grid of the same
        pitch.
        """
        if added.sizes["y"] == len(self.y) and added.sizes["x"] == len(self.x):
            return added
        top, left = ((added.sizes[d] - len(c)) // 2 for d, c in (("y", self.y), ("x", self.x)))
        return added[:, top : top + len(self.y), left : left + len(self.x)]


def without_geometry(lens):
    """Return the lens that spreads light as on the axis but has neither distortion nor falloff:
    kernels do not depend on them.
    """
    axis = lens.on_axis()
    traced = {"lateral_colour": "none"} if isinstance(axis, TracesColour) else {}
    return replace(axis, distortion="none", falloff="none", lateral_colour_percent={}, **traced)


def sensor_plane(lens, mixed) -> SensorPlane:
    """Return the sensor plane of a lens for the field of `mixed`, with what distortion does.

    The sensor's tiles have the pitch of the field's, and cover the largest centred rectangle that
    looks at known light only.

    Raises
    ------
    ConfigError : a distortion that folds, or a table that ends, within the field; cos4 beyond 90
        degrees.
    """
    x, y = (mixed[d].values.astype(float) for d in ("x", "y"))
    pitch = [quantities.tile_pitch(mixed, d) for d in ("x", "y")]
    projection = camera_geometry.projection_of(mixed)
    half = [np.abs(c).max() + p / 2 for c, p in zip((x, y), pitch)]
    widest = float(projections.angle_rad(*half, projection))
    distortion = lens.distortion_to(widest)
    bent = camera_geometry.distortion_map(distortion, projection)
    kept = isinstance(bent, camera_geometry.Identity)
    attrs = {} if projection == "tangent" else {"projection": projection}
    if not kept:
        attrs["distortion"] = distortion
        _check_field(bent, half)
    relative, falloff = _relative(lens, bent, x, y, projection, widest)
    field = tuple(
        mixed.attrs.get(k) or n
        for k, n in zip(("field_width", "field_height"), quantities.full_field(mixed))
    )
    if kept:
        spared = (omissions.NO_DISTORTION,)
        plane = SensorPlane(relative, x, y, field, attrs | falloff, notes=spared)
        return lateral_colour.coloured(lens, mixed, plane, bent)
    seen = _inscribed(bent, half)
    sensor = [_tiles(len(c), 2 * h * seen, p) for c, h, p in zip((x, y), half, pitch)]
    grids = [borders(c, p) for c, p in zip((x, y, *sensor), (*pitch, *pitch))]
    try:
        areas = camera_geometry.field_areas(bent, *grids) / (pitch[0] * pitch[1])
    except ValueError as err:
        raise ConfigError(f"lens.distortion does not fit the field: {err}") from None
    uniform = areas @ np.broadcast_to(relative, (len(y), len(x))).ravel()
    error = _error_of_uniform_light(uniform, attrs | falloff, sensor)
    inner = _inscribed(bent, [w / 2 for w in field])
    seen = tuple(min(w * inner, len(c) * p) for w, c, p in zip(field, sensor, pitch))
    plane = SensorPlane(
        relative,
        *sensor,
        seen,
        attrs | falloff,
        areas,
        stretched=_stretched(bent, half),
        notes=(error,),
    )
    return lateral_colour.coloured(lens, mixed, plane, bent)


def image_size(
    lens, width: float, height: float, projection: str = "tangent"
) -> tuple[float, float]:
    """Return (width, height) in focal lengths of the largest centred rectangle that looks into a
    field; at most 1e-6 too large.

    `sensor_plane` may find less, because it has whole tiles only.
    """
    half = width / 2, height / 2
    bent = camera_geometry.distortion_map(
        lens.distortion_to(float(projections.angle_rad(*half, projection))), projection
    )
    # 1e-6: a table over this field, without its margin, is not the last digits of the one over all
    # of it
    seen = (
        1.0 if isinstance(bent, camera_geometry.Identity) else _inscribed(bent, half) * (1 + 1e-6)
    )
    return width * seen, height * seen


def _relative(lens, bent, x, y, projection, widest):
    """Return the factor of the field's tiles, (y, x) or 1.0, and the attributes that state it."""
    falloff = lens.falloff_to(widest)
    if falloff == "none":
        return 1.0, {"falloff": "none"}
    u, v = x[None, :], y[:, None]
    if falloff == "cos4":
        if widest >= np.pi / 2:
            raise ConfigError(
                f"the field reaches {np.degrees(widest):.4g} degrees, where cos4 leaves no light; "
                "set lens.falloff=none, or a table as lens.falloff={0:1,95:0.4}"
            )
        return projections.cos4(u, v, projection), {"falloff": "cos4"}
    table = {
        "angle_deg": [float(a) for a in falloff],
        "relative": [float(v) for v in falloff.values()],
    }
    on_sensor = camera_geometry.table_values(
        table, np.degrees(projections.angle_rad(u, v, projection))
    )
    return on_sensor * bent.area_ratio(u, v), {"falloff": "table", "falloff_table": table}


def _check_field(bent, half):
    try:
        u, v = np.meshgrid(*(np.linspace(-h, h, CHECKED) for h in half))
        single = bent.area_ratio(u, v) > 0
    except ValueError as err:
        raise ConfigError(f"lens.distortion does not fit the field: {err}") from None
    if not single.all():
        radius = np.hypot(u, v)[~single].min()
        raise ConfigError(
            f"lens.distortion folds the field over at {radius:.4g} from the axis, the field reaches"
            f" {np.hypot(*half):.4g}; expected other coefficients or a smaller field"
        )


def _inscribed(bent, half) -> float:
    """Return the largest s such that the sensor's rectangle +-s `half` looks at nothing beyond
    +-`half` of the field.
    """
    side = np.linspace(-1, 1, BORDER_POINTS)
    u = np.concatenate([side, side, -np.ones_like(side), np.ones_like(side)]) * half[0]
    v = np.concatenate([-np.ones_like(side), np.ones_like(side), side, side]) * half[1]
    x, y = bent.forward(u, v)
    low, high = 0.0, float(min(x.max() / half[0], y.max() / half[1]))
    for _ in range(60):
        middle = (low + high) / 2
        try:
            a, b = bent.inverse(middle * u, middle * v)
            inside = max(np.abs(a).max() / half[0], np.abs(b).max() / half[1]) <= 1
        except ValueError:  # beyond the image of the field a map need have no inverse
            inside = False
        low, high = (middle, high) if inside else (low, middle)
    return low


def _tiles(count, width, pitch):
    """Return tile centres, symmetric about the axis, as many as fit; one more or less than a
    multiple of two from `count`.
    """
    fits = int(np.floor(width / pitch * (1 + 1e-12)))
    fits -= (fits - count) % 2
    if fits < 1:
        raise ConfigError(
            "lens.distortion leaves no whole tile of the field on the sensor; expected a finer or"
            " wider field"
        )
    return quantities.centres(fits, fits * pitch)


def _error_of_uniform_light(uniform, attrs, sensor) -> ErrorTerm:
    """Return how far uniform light comes out from what the attributes say."""
    x, y = np.meshgrid(*sensor)
    stated = camera_geometry.relative_illumination(attrs, x, y)
    worst = np.abs(uniform.reshape(x.shape) - stated).max() / stated.max()
    label = (
        "uniform light moved along the distortion: tiles have straight sides and one relative"
        " illumination each"
    )
    return term(worst, "relative", "measured", label, key="uniform light")


def _stretched(bent, half) -> float:
    """Return by how much distortion draws out images at most, relative."""
    u, v = np.meshgrid(*(np.linspace(-h, h, 17) * (1 - 1e-4) for h in half))
    step = 1e-5 * max(half)
    across, down = (
        np.stack(np.subtract(bent.forward(u + a, v + b), bent.forward(u - a, v - b))) / (2 * step)
        for a, b in ((step, 0.0), (0.0, step))
    )
    stretched = np.linalg.svd(
        np.stack([across, down], axis=-1).transpose(1, 2, 0, 3), compute_uv=False
    )
    return float(np.abs(stretched - 1).max())

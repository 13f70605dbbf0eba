"""Drops: water on a windscreen, each a small lens that is far out of focus.

The glass lies at the distance z in front of a camera with an entrance pupil of diameter D. Light
from the direction t (tangents) crosses the glass in a disc of diameter D about z t. A drop is a
plano-convex lens of focal length f = radius of its surface / (n - 1). At the point p of the glass,
a drop with the middle c turns the line of sight by -(p - c) / f. The radiance that the camera
receives from the direction t is therefore, by geometrical optics,

    L'(t) = (1 - w) L(t) + (1 / pupil area) x integral of L(t - (p - c) / f) dp

where the integral is over the part of the disc that drops cover, and w is the share of that part.
Radiance is conserved along every ray, so that uniform light stays uniform. The picture shows a drop
as a disc that is blurred by the pupil. In the disc the scene is inverted, small, and blurred by
D / f.

The integral is a sum over square cells of the drop. Each cell is multiplied by the mean of L over
the directions in which the cell refracts the line of sight. Tiles at the border of these directions
count with their exact share, so that no lamp falls between the cells, however small it is.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from isethdr_core import ledger, quantities
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.ranges import Range, Seed, check_ranges

from .in_front import check_projection, checked_values

if TYPE_CHECKING:
    import xarray as xr

    from ..abilities import FieldAngles, LensOptics
    from ..lenses.thin_lens import IdealLens

Floats = npt.NDArray[np.float64]
PerArea = Annotated[float, Range(0, 1)]  # drops 1 mm apart
Radius = Annotated[float, Range(0.02, 10)]  # millimetres: larger drops run down
Contact = Annotated[float, Range(2, 45)]  # degrees: steeper rims of water reflect totally
Index = Annotated[float, Range(1.01, 1.4)]
Distance = Annotated[float, Range(1, 2000)]  # millimetres
PATCH_MM = 10.0  # side of the squares of glass for which random drops are drawn together
# number of cells along the pupil's diameter; one cell blurs the scene in a drop
CELLS_PER_PUPIL = 6
CELLS = (6, 48)  # least and largest number of cells along a drop's diameter
# Least number of cells along the pupil's diameter. A narrower pupil counts as so wide, because the
# shares of its cells would not sum to 1. It blurs a drop by a twelfth of its diameter.
LEAST_CELLS_PER_PUPIL = 4
FINE = 8  # number of points along a cell that give the share of the cell within the drop
BLOCK = 2_000_000  # number of products of tiles and cells that are computed at a time: 16 MB
BANDS = 8  # number of bands that are computed at a time, with the same cells of a drop
ROUNDING = 1e-9  # relative rounding error of sums over tiles


class Drop(NamedTuple):
    """One drop: position of its middle on the glass, and radius of its outline."""

    x_mm: float
    y_mm: float
    radius_mm: float


class _Axis(NamedTuple):
    """Tiles and cells of a drop along one axis."""

    tiles: slice  # tiles with light through the drop
    off_mm: Floats  # (tile, cell) distance from the middle of the pupil's disc to the cell's middle
    # (tile, border) direction seen through the borders of cells, in tiles, as an index of `_sums`
    places: Floats


@dataclass(frozen=True)
class _View:
    """One drop as the camera sees it."""

    rows: _Axis
    columns: _Axis
    part: Floats  # (down, across) share of each cell that is within the drop
    side_mm: float  # side of the cells
    pupil_mm: float  # diameter of the entrance pupil

    def shares(self) -> Iterator[tuple[slice, Floats]]:
        """Yield (block of rows of the view, share of the pupil that each cell covers). The share
        has the shape (row, cell down, column, cell across).
        """
        whole = np.pi * self.pupil_mm**2 / 4
        # the pupil's rim fades over one cell, about the radius at which the disc keeps its area
        rim_mm = np.sqrt(max(self.pupil_mm**2 / 4 - self.side_mm**2 / 12, 0.0))
        across2 = self.columns.off_mm**2
        rows = max(BLOCK // (across2.size * len(self.part)), 1)
        for first in range(0, len(self.rows.off_mm), rows):
            block = slice(first, first + rows)
            down2 = self.rows.off_mm[block] ** 2
            apart = np.sqrt(down2[:, :, None, None] + across2[None, None])
            seen = np.clip((rim_mm - apart) / self.side_mm + 0.5, 0, 1)
            yield block, self.part[None, :, None, :] * seen * (self.side_mm**2 / whole)

    def covered(self) -> Floats:
        """Return the share of the pupil that the drop covers, (row, column)."""
        return np.concatenate([share.sum((1, 3)) for _, share in self.shares()])


@dataclass(frozen=True)
class DropsFlare:
    """Drops of water on the windscreen, each a lens out of focus; default values are assumptions.

    The glass is assumed to be a plane perpendicular to the optical axis.
    """

    THREAD_SAFE: ClassVar[bool] = True

    drops_per_mm2: PerArea = (
        0.01  # drops per area of the glass, before overlapping ones are removed
    )
    least_radius_mm: Radius = 0.3  # smallest radius of a drop's outline
    largest_radius_mm: Radius = 1.5  # largest radius; the distribution is uniform in log radius
    contact_deg: Contact = 30.0  # angle between glass and drop at its rim
    index: Index = 1.333  # refractive index of the drops
    distance_mm: Distance = 60.0  # distance of the glass from the entrance pupil
    # seed of positions and radii; a wider field keeps the drops, except a few at the former border
    seed: Seed = 1

    def __post_init__(self) -> None:
        """Raise ConfigError for values out of range, or if the smallest radius is above the
        largest.
        """
        check_ranges(self)
        if self.least_radius_mm > self.largest_radius_mm:
            raise ConfigError(
                f"drops least_radius_mm is {self.least_radius_mm:g} and largest_radius_mm is"
                f" {self.largest_radius_mm:g}; expected the lesser number first; type for example"
                f" flare.NAME.largest_radius_mm={self.least_radius_mm:g}"
            )

    def focal_length_mm(self, radius_mm: float) -> float:
        """Return the focal length, mm, of a drop with this radius of its outline."""
        return radius_mm / (np.sin(np.radians(self.contact_deg)) * (self.index - 1))

    def drops(self, width_mm: float, height_mm: float) -> list[Drop]:
        """Return the drops on a rectangle of glass about the axis, the largest first.

        Parameters
        ----------
        width_mm : width of the rectangle, mm.
        height_mm : height of the rectangle, mm.
        """
        reach = self.largest_radius_mm
        across, down = (
            range(-n, n)
            for n in (int(np.ceil((s / 2 + reach) / PATCH_MM)) for s in (width_mm, height_mm))
        )
        drawn = [drop for row in down for column in across for drop in self._patch(row, column)]
        drawn.sort(key=lambda one: -one.radius_mm)
        x, y, radius = np.array(drawn).reshape(-1, 3).T
        kept: list[int] = []
        for k in range(len(drawn)):
            apart = np.hypot(x[kept] - x[k], y[kept] - y[k])
            if (apart > radius[kept] + radius[k]).all():
                kept.append(k)
        return [
            drop
            for drop in (drawn[k] for k in kept)
            if abs(drop.x_mm) < width_mm / 2 + drop.radius_mm
            and abs(drop.y_mm) < height_mm / 2 + drop.radius_mm
        ]

    def _patch(self, row: int, column: int) -> list[Drop]:
        """Return the random drops of one square of glass."""
        random = np.random.default_rng([self.seed, row % 2**32, column % 2**32])
        count = int(random.poisson(self.drops_per_mm2 * PATCH_MM**2))
        place = (random.random((count, 2)) + [column, row]) * PATCH_MM
        ends = np.log([self.least_radius_mm, self.largest_radius_mm])
        radius = np.exp(random.uniform(*ends, count))
        return [Drop(float(x), float(y), float(r)) for (x, y), r in zip(place, radius, strict=True)]

    def check_lens(self, lens: LensOptics, field: FieldAngles) -> None:
        """Raise ConfigError unless the field is in tangents."""
        check_projection(field.projection, "drops")

    def redirected(self, lens: IdealLens, mixed: xr.DataArray) -> xr.DataArray:
        """Return the mixed radiance behind the drops.

        Beyond the tiles of `mixed` the light of the nearest tile is assumed.

        Parameters
        ----------
        lens : lens behind the drops; its entrance pupil blurs them.
        mixed : mixed radiance ([component,] wavelength, y, x).

        Raises
        ------
        ConfigError : the field is given in angles, not in tangents.
        UnitError : `mixed` is not mixed radiance.
        """
        values = checked_values(mixed)
        check_projection(mixed.attrs.get("projection", "tangent"), "drops")
        tangents = mixed.y.values.astype(float), mixed.x.values.astype(float)
        pitch = quantities.tile_pitch(mixed, "y"), quantities.tile_pitch(mixed, "x")
        pupil_mm = lens.focal_length_mm / lens.f_number
        size_mm = [
            2 * self.distance_mm * float(np.abs(t).max()) + pupil_mm for t in reversed(tangents)
        ]
        found = self.drops(*size_mm)
        # deflection at the rim of a drop of any size, tangent
        turn = np.sin(np.radians(self.contact_deg)) * (self.index - 1)
        beyond = tuple(int(np.ceil(turn / p)) for p in pitch)
        views = [view for d in found if (view := self._view(d, tangents, pitch, pupil_mm, beyond))]
        covered = np.zeros(mixed.shape[-2:])
        for view in views:
            covered[view.rows.tiles, view.columns.tiles] += view.covered()
        self._state(len(found), covered, turn)
        if not views:
            return mixed
        # cells of two drops that touch may count a part of the pupil twice
        scale = 1 / np.maximum(covered, 1.0)
        _state_beyond(views, scale, np.minimum(covered, 1.0), beyond)
        bands = values.reshape(-1, *values.shape[-2:])
        out = np.empty_like(bands)
        for first in range(0, len(bands), BANDS):
            some = slice(first, first + BANDS)
            out[some] = bands[some] * (1 - np.minimum(covered, 1.0))
            sums = _sums(bands[some], beyond)
            for view in views:
                _add(out[some], sums, view, scale)
        return mixed.copy(data=out.reshape(values.shape))

    def _view(
        self,
        drop: Drop,
        tangents: tuple[Floats, Floats],
        pitch: tuple[float, float],
        pupil_mm: float,
        beyond: tuple[int, int],
    ) -> _View | None:
        """Return the view of a drop from the tiles of a field; None if it covers no tile.

        Parameters
        ----------
        drop : the drop.
        tangents : (y,) and (x,) centres of the tiles, tangents.
        pitch : (y, x) pitch of the tiles, tangents.
        pupil_mm : diameter of the entrance pupil, mm.
        beyond : rows and columns that `_sums` adds on each side.
        """
        middle = drop.y_mm, drop.x_mm
        wanted = np.ceil(2 * drop.radius_mm * CELLS_PER_PUPIL / pupil_mm)
        count = int(np.clip(wanted, *CELLS))
        side = 2 * drop.radius_mm / count
        pupil_mm = max(pupil_mm, LEAST_CELLS_PER_PUPIL * side)
        reach = drop.radius_mm + pupil_mm / 2
        borders = drop.radius_mm - side * np.arange(count + 1)  # falling: directions then rise
        cells = (borders[1:] + borders[:-1]) / 2
        fine = (np.arange(FINE * count) + 0.5) * side / FINE - drop.radius_mm
        inside = np.hypot(fine[:, None], fine[None, :]) < drop.radius_mm
        part = inside.reshape(count, FINE, count, FINE).mean((1, 3))
        focal_mm = self.focal_length_mm(drop.radius_mm)
        axes = []
        for tangent, centre, step, margin in zip(tangents, middle, pitch, beyond, strict=True):
            near = np.flatnonzero(np.abs(self.distance_mm * tangent - centre) < reach)
            if not near.size:
                return None
            tiles = slice(int(near[0]), int(near[-1]) + 1)
            here = tangent[tiles, None]
            start = tangent[0] - step / 2
            places = (here - borders / focal_mm - start) / step + margin
            axes.append(_Axis(tiles, self.distance_mm * here - centre - cells, places))
        return _View(axes[0], axes[1], part, side, pupil_mm)

    def _state(self, count: int, covered: Floats, turn: float) -> None:
        """State in the ledger the drops of the field, and the error of their model.

        Parameters
        ----------
        count : number of drops.
        covered : (y, x) share of the light that passes through drops.
        turn : deflection at the rim of a drop, tangent.
        """
        sine = np.sin(np.radians(self.contact_deg))
        exact = np.arcsin(self.index * sine) - np.radians(self.contact_deg)
        ledger.left_out(
            f"refraction of {count} drops, on {100 * float(covered.mean()):.2g} % of the light,"
            " beyond small angles",
            "each drop is computed as a thin lens; at its rim Snell's law deflects light further by"
            " this angle",
            float(np.degrees(exact - np.arctan(turn))),
            "degrees",
        )


def _state_beyond(
    views: list[_View], scale: Floats, covered: Floats, beyond: tuple[int, int]
) -> None:
    """State in the ledger the share of the light through drops that comes from beyond the tiles.

    Parameters
    ----------
    views : views of the drops.
    scale : (y, x) factor on the light through drops.
    covered : (y, x) share of the light that passes through drops.
    beyond : rows and columns on each side of the field from which drops may bring light.
    """
    of_tiles = np.zeros((1, *covered.shape))
    sums = _sums(np.ones(of_tiles.shape), beyond, "constant")
    for view in views:
        _add(of_tiles, sums, view, scale)
    share = float((covered - of_tiles[0]).mean())
    if share > ROUNDING:
        ledger.left_out(
            f"light from beyond the tiles, {100 * share / float(covered.mean()):.2g} % of that"
            " through drops",
            "the light of the nearest tile is assumed; type a larger renderer.margin for more"
            " tiles",
            share,
            "relative",
        )


def _sums(
    bands: npt.NDArray[np.floating],
    beyond: tuple[int, int],
    light_there: Literal["edge", "constant"] = "edge",
) -> Floats:
    """Return, for each corner of a tile, the sum of all tiles above it and left of it, (band,
    y + 1, x + 1) for the padded field.

    Parameters
    ----------
    bands : (band, y, x) light.
    beyond : rows and columns that are added on each side.
    light_there : light of the added tiles: `edge`, that of the nearest tile; `constant`, none.
    """
    padded = np.pad(np.asarray(bands, float), [(0, 0), *((n, n) for n in beyond)], light_there)
    sums = np.zeros((len(padded), padded.shape[1] + 1, padded.shape[2] + 1))
    np.cumsum(np.cumsum(padded, 1), 2, out=sums[:, 1:, 1:])
    return sums


def _add(out: npt.NDArray[np.floating], sums: Floats, view: _View, scale: Floats) -> None:
    """Add the light through one drop.

    Parameters
    ----------
    out : (band, y, x) array to which the light is added.
    sums : sums of the light in front of the drop, from `_sums`.
    view : view of the drop.
    scale : (y, x) factor on the light through the drop.
    """
    rows = view.rows
    columns = view.columns
    area = np.prod([axis.places[0, 1] - axis.places[0, 0] for axis in (rows, columns)])
    for block, share in view.shares():
        at = slice(rows.tiles.start, rows.tiles.stop)
        tiles = slice(at.start + block.start, min(at.start + block.stop, at.stop))
        places = rows.places[block]
        for band, of_band in zip(out, sums, strict=True):
            corners = _between(_between(of_band, places.ravel()).T, columns.places.ravel()).T
            corners = corners.reshape(*places.shape, *columns.places.shape)
            boxes = np.diff(np.diff(corners, axis=1), axis=3)
            # in the dark, rounding may make differences of sums negative
            light = np.einsum("rick,rick->rc", share, np.maximum(boxes / area, 0.0))
            band[tiles, columns.tiles] += scale[tiles, columns.tiles] * light


def _between(sums: Floats, places: Floats) -> Floats:
    """Return rows of sums, interpolated linearly at fractional indices `places`. This is exact for
    tiles of uniform light.
    """
    at = np.clip(places, 0, len(sums) - 1)
    below = np.minimum(at.astype(int), len(sums) - 2)
    share = (at - below)[:, None]
    return (1 - share) * sums[below] + share * sums[below + 1]

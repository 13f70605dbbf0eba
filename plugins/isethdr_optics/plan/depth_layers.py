"""Depth layers: the light of a lens that is focused at one distance, by the depth of every tile.

Tiles of nearly the same blur form a layer. Each layer is spread by the geometric disc of its blur,
the layers are added, and the sum is imaged by the lens in focus. The light of every tile is
conserved, and no tile hides another; the resulting error at depth edges is stated. Diffraction and
defocus are treated as independent. Blur diameters are in tiles, the resolution of the light. Blur
below a share of the sensors' pixels is left out; if the demand states no pixel size, a tile takes
the place of the pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.ndimage import maximum_filter

from isethdr_core import ledger, quantities
from isethdr_core.data.quantities import LABEL_PREFIX
from isethdr_core.demand import Response
from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.ledger import LeftOut
from isethdr_core.physics.optics.defocus import blur_diameter_m, disc_on_tiles, hyperfocal_m
from isethdr_core.uncertainty.error_terms import ErrorMaps, ErrorTerm, Quantity

from ..psf.error_parts import POINT_SPREAD, term

if TYPE_CHECKING:
    import xarray as xr

    from .lens_plan import LensPlan

LEAST = 0.25  # blur diameter, in pixels, that is left out; also the least span of a layer
SPAN = 0.1  # span of a layer, as a share of its blur diameter
# largest ratio of the sides of a tile: a disc is drawn with the same number of tiles along both
SQUARE = 1.05
EDGE = 0.25  # least difference of blur diameters at a depth edge, tiles
# L1 error of a disc, share of a point's light: the largest for f/1.6 to f/4 and a blur of 0.2 to 95
# wavelengths x f-number, on tiles of 1 to 5 um; that of a sharp point spread there reaches 1.8
DISC = 0.4
WAVE_UM = 0.55  # wavelength at which diffraction and defocus are compared
QUARTER_WAVE = 2.0  # blur of a quarter wave of defocus, wavelengths x f-number
DEPTH = LABEL_PREFIX + "depth"  # coordinate of mixed radiance: depth of each tile, m
EDGES = "light at depth edges"  # part of the light that occlusion changes


class Layer(NamedTuple):
    """Tiles of nearly the same blur."""

    blur: float  # blur diameter of the layer, in tiles; 0: in focus
    tiles: npt.NDArray[np.bool_]  # (y, x) mask of the layer's tiles


@dataclass(frozen=True)
class Finest:
    """The samples with which a blur is compared: the finest pixels of the sensors, or else
    tiles.
    """

    name: str  # pixel or tile
    side_m: float  # side of a sample
    tiles: float  # side of a sample, in tiles

    @property
    def least(self) -> float:
        """The largest blur diameter, in tiles, that is left out."""
        return LEAST * self.tiles

    @property
    def unit(self) -> str:
        """The unit in which blur diameters are stated."""
        return f"{self.name}s of blur diameter"


def finest(lens: Any, mixed: xr.DataArray, response: Response | None) -> Finest:
    """Return the samples with which the blur of a field is compared.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : mixed radiance (wavelength, y, x).
    response : response of the sensors; tiles are used if it is None or does not state the pixels.
    """
    tile = tile_m(lens, mixed)
    if response is None or response.pixel_m is None:
        return Finest("tile", tile, 1.0)
    return Finest("pixel", response.pixel_m, response.pixel_m / tile)


def hyperfocal_note(lens: Any, judged_by: Finest) -> LeftOut:
    """Return the row of the ledger for the defocus that a lens leaves out when it is focused at its
    hyperfocal distance.
    """
    blur_m = LEAST * judged_by.side_m
    focus_m = hyperfocal_m(1e-3 * lens.focal_length_mm, lens.f_number, blur_m)
    return LeftOut(
        f"defocus, focused at the hyperfocal distance of {focus_m:.3g} m",
        f"beyond {focus_m / 2:.3g} m its blur is less than a quarter of a {judged_by.name}; the"
        " defocus of nearer objects is ignored",
        LEAST,
        judged_by.unit,
        key="defocus",
    )


def blur_tiles(lens: Any, mixed: xr.DataArray) -> npt.NDArray[np.float64]:
    """Return the blur diameter of every tile (y, x), in tiles; it is positive for tiles nearer than
    the distance in focus.

    Raises
    ------
    ConfigError : the radiance has no depth, or its tiles are not square.
    UnitError : a depth is not positive.
    """
    down, across = (quantities.tile_pitch(mixed, d) for d in ("y", "x"))
    if max(down, across) > SQUARE * min(down, across):
        raise ConfigError(
            f"lens.focus_m is {lens.focus_m!r}, and tiles are {across / down:.3g} times as wide as"
            " high; expected square tiles, on which blur is a disc; type lens.focus_m=hyperfocal"
        )
    if DEPTH not in mixed.coords:
        raise ConfigError(
            f"lens.focus_m is {lens.focus_m!r}, and the scene has no depth of its tiles; expected"
            " the label depth, as of a rendered scene; type lens.focus_m=hyperfocal"
        )
    depth = np.asarray(mixed[DEPTH].values, float)
    if not (depth > 0).all():
        raise UnitError(
            f"the depth of a tile is {depth[~(depth > 0)].flat[0]:g} m; expected metres along the"
            " optical axis, above 0; tiles 90 degrees off the axis and more have none: type"
            " lens.focus_m=hyperfocal"
        )
    blur_m = blur_diameter_m(1e-3 * lens.focal_length_mm, lens.f_number, lens.focus_m, depth)
    return blur_m / tile_m(lens, mixed)


def beyond_diffraction(
    lens: Any, mixed: xr.DataArray, blur: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Return the signed diameters (y, x), in tiles, of the discs that spread the image of the lens
    in focus like a defocus.

    A defocus of a quarter wave hardly changes the diffraction pattern (Rayleigh's limit). Its blur
    is subtracted in quadrature, except for a lens without diffraction.

    Parameters
    ----------
    lens : a lens of this package.
    mixed : mixed radiance (wavelength, y, x).
    blur : blur diameters (y, x), in tiles, with sign.
    """
    if not lens.blurs:
        return blur
    least = QUARTER_WAVE * 1e-6 * WAVE_UM * lens.f_number / tile_m(lens, mixed)
    return np.asarray(np.sign(blur) * np.sqrt(np.maximum(blur**2 - least**2, 0.0)))


def layers(blur: npt.NDArray[np.float64], least: float = LEAST) -> list[Layer]:
    """Return the layers of tiles, the layer in focus first. The blur of a layer is the middle of
    the range of its tiles.

    Parameters
    ----------
    blur : signed disc diameters (y, x), in tiles.
    least : largest diameter, in tiles, that is left out; also the least span of a layer.
    """
    size = np.abs(blur)
    borders = [least]
    while borders[-1] < size.max():
        borders.append(borders[-1] + max(least, SPAN * borders[-1]))
    index = np.digitize(size, borders, right=True) * np.sign(blur).astype(int)
    found = []
    for one in sorted(set(index.flat), key=lambda k: (abs(k), k)):
        tiles = index == one
        middle = (blur[tiles].min() + blur[tiles].max()) / 2 if one else 0.0
        found.append(Layer(float(middle), tiles))
    return found


def at_edges(blur: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Return the mask (y, x) of tiles that a nearer tile may hide from a part of the pupil.

    From the axis to the rim of the pupil, the view of a point shifts against that of a nearer point
    by half of the difference of their blur diameters. A difference below `EDGE` is not an edge.
    """
    span = float(np.ptp(blur))
    hidden = np.zeros(blur.shape, bool)
    for radius in range(1, int(span / 2) + 2):
        nearest = maximum_filter(blur, size=2 * radius + 1, mode="nearest")
        hidden |= nearest - blur >= max(2.0 * (radius - 1), EDGE)
    return hidden


def defocused(mixed: xr.DataArray, found: list[Layer]) -> xr.DataArray:
    """Return mixed radiance ([component,] wavelength, y, x) with every layer spread by its disc.
    Light that leaves the field is lost.
    """
    values = np.asarray(mixed.values)
    out = np.zeros_like(values)
    for layer in found:
        shares = disc_on_tiles(abs(layer.blur)) if layer.blur else np.ones((1, 1))
        _add_spread(out, values, layer.tiles, shares)
    return mixed.copy(data=out)


def _add_spread(
    out: npt.NDArray[Any],
    values: npt.NDArray[Any],
    tiles: npt.NDArray[np.bool_],
    shares: npt.NDArray[np.float64],
) -> None:
    """Add to `out` the values (..., y, x) of some tiles, spread by `shares` (n, n).

    The products are summed directly, without a Fourier transform. Rounding errors of a lamp then do
    not appear in dark tiles.
    """
    within = tuple(
        slice(int(at.min()), int(at.max()) + 1) for at in (np.nonzero(tiles)[k] for k in (0, 1))
    )
    light = np.where(tiles[within], values[..., *within], values.dtype.type(0))
    reach = shares.shape[0] // 2
    for (row, column), share in np.ndenumerate(shares.astype(values.dtype)):
        if not share:
            continue
        shift = row - reach, column - reach
        into, part = zip(
            *(_shifted(one, by, n) for one, by, n in zip(within, shift, tiles.shape, strict=True)),
            strict=True,
        )
        out[..., *into] += share * light[..., *part]


def _shifted(within: slice, by: int, size: int) -> tuple[slice, slice]:
    """Return (slice of an axis of `size` tiles that a shifted span covers, part of the span that
    lies there).
    """
    first = max(within.start + by, 0)
    last = min(within.stop + by, size)
    last = max(first, last)
    start = first - within.start - by
    return slice(first, last), slice(start, start + last - first)


@dataclass(frozen=True, eq=False)
class DefocusedPlan:
    """A plan (`isethdr_core.plugins.protocols.ImagingPlan`) of one lens, field, and its depth."""

    plan: LensPlan  # plan of the lens in focus, for the defocused field
    layers: list[Layer]
    edges: npt.NDArray[np.bool_]  # (y, x) mask from `at_edges`
    terms: tuple[ErrorTerm, ...]
    left_out: tuple[LeftOut, ...]

    def image(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return the light of mixed radiance ([component,] wavelength, y, x), as `LensPlan.image`.

        Raises
        ------
        UnitError : as `LensPlan.image`.
        """
        light = self.plan.image(defocused(mixed, self.layers))
        if ledger.records_errors() and self.edges.any():
            hidden = [one._replace(tiles=one.tiles & self.edges) for one in self.layers]
            hidden = [one for one in hidden if one.tiles.any()]
            part = ledger.collected(lambda: self.plan.image(defocused(mixed, hidden))).result
            ledger.light_part(EDGES, part)
        return light

    def light_errors(self, mixed: xr.DataArray, weights: npt.NDArray[np.float64]) -> ErrorMaps:
        """Return the errors of the light of `mixed` from the kernels' errors, as
        `LensPlan.light_errors`.
        """
        return self.plan.light_errors(defocused(mixed, self.layers), weights)


def layer_terms(lens: Any, edges: npt.NDArray[np.bool_]) -> tuple[ErrorTerm, ...]:
    """Return the errors of spreading layers by discs.

    Parameters
    ----------
    lens : a lens of this package.
    edges : (y, x) mask from `at_edges`.
    """
    label = "a disc of light in place of a defocused wave, where it is as wide as diffraction"
    disc = term(
        DISC if lens.blurs else 0.0,
        "relative",
        "measured",
        label,
        key="defocus",
        part=POINT_SPREAD,
        acts_on=Quantity.OTHER,
    )
    if not edges.any():
        return (disc,)
    label = (
        f"occlusion at depth edges, {100 * edges.mean():.2g} % of the tiles: as much may be hidden"
        " from a part of the pupil, or be added if what lies hidden beside it is as bright"
    )
    return disc, term(1.0, "relative", "bound", label, key="occlusion", part=EDGES)


def layer_notes(
    blur: npt.NDArray[np.float64],
    discs: npt.NDArray[np.float64],
    made: list[Layer],
    judged_by: Finest,
) -> list[LeftOut]:
    """Return the rows of the ledger for the defocus that layers leave out.

    Parameters
    ----------
    blur : blur diameters (y, x), in tiles.
    discs : diameters (y, x), in tiles, of the discs that spread the tiles.
    made : layers of `discs`.
    judged_by : samples with which the blur is compared.
    """
    notes = []
    if not made[0].blur:
        sharp = made[0].tiles
        notes.append(
            LeftOut(
                f"defocus of {100 * sharp.mean():.3g} % of the tiles",
                "its blur, without that of diffraction, is less than a quarter of a"
                f" {judged_by.name}",
                float(np.abs(blur[sharp]).max()) / judged_by.tiles,
                judged_by.unit,
                key="defocus",
            )
        )
    if any(one.blur for one in made):
        within = max(float(np.ptp(discs[one.tiles])) / 2 for one in made if one.blur)
        notes.append(
            LeftOut(
                "differences of defocus within a layer",
                f"{len(made)} layers represent all depths; a tile has the depth of its centre",
                within / judged_by.tiles,
                judged_by.unit,
                key="defocus within layers",
            )
        )
    return notes


def tile_m(lens: Any, mixed: xr.DataArray) -> float:
    """Return the shorter side of a tile on the sensor, m."""
    pitch = min(quantities.tile_pitch(mixed, d) for d in ("y", "x"))
    return 1e-3 * float(lens.focal_length_mm) * pitch

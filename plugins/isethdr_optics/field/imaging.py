"""Field imaging: convolution with point spreads that vary over the field.

The light of a tile is divided among the adjacent field points of a polar grid (`field.grid`). Each
share is spread by the exact core of the point spread of that field point. Beyond the cores, the
PSF wings of the axis spread the light. No weight is negative, and the energy of a point spread is
conserved. The grid is fine enough for the allowed error, which is measured between its points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.cli.progress import shown, track
from isethdr_core.ledger import LeftOut, Note
from isethdr_core.physics.optics import projection as projections

from ..imaging.threads import MOST_THREADS, cpus, executor
from ..psf import band_phase, kernels
from ..psf.error_parts import AXIS_KERNEL, SPECKLE, SPREAD, term
from . import field_point_psf, omissions
from . import grid as field_grid
from .core_reach import Reach, core_reach, reach_of_cores
from .kernels_of_field import FieldKernels
from .meridian import ALONG, Meridian, meridian
from .point_choice import Chosen, chosen_points
from .reference_bands import WIDTH_NM

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics
    from .grid import Place


class FieldTiles(NamedTuple):
    """The tiles of a field."""

    x: np.ndarray  # centres, in the unit of the projection
    y: np.ndarray  # centres, in the unit of the projection
    projection: str
    pitch_um: tuple[float, float]  # (y, x) pitch of their images

    @property
    def radius(self) -> float:
        """Distance from the axis to the farthest tile, in the unit of the projection."""
        return float(np.hypot(np.abs(self.x).max(), np.abs(self.y).max()))

    def angle_rad(self, radius: float) -> float:
        """Return the angle off the axis at a radius in the unit of the projection."""
        return float(projections.angle_rad(radius, 0.0, self.projection))


@dataclass(frozen=True, eq=False)
class PlaceCores:
    """Cores of the point spread at any point of a field."""

    lens: PupilOptics
    flares: Sequence[Flare]
    tiles: FieldTiles
    half: tuple[int, int]  # (y, x) tiles from the middle to the border of a core
    mirrors: bool  # the cores of one quadrant are mirrored into the other three

    def of_wave(self, radius: float, azimuth_rad: float, wave_nm: float) -> np.ndarray:
        """Return the core (y, x) at one wavelength.

        Parameters
        ----------
        radius : distance from the axis, in the unit of the projection.
        azimuth_rad : azimuth, rad, counter-clockwise from +x, y up.
        wave_nm : wavelength, nm.
        """
        at, flips = self._seen_from(field_grid.Place(0, radius, azimuth_rad, 1))
        core = field_point_psf.one(at, self.flares, wave_nm, self.tiles.pitch_um, self.half)
        return np.flip(core, flips)

    def of_bands(self, place: Place, wavelength_nm: np.ndarray) -> kernels.Kernels:
        """Return the cores of all bands.

        Parameters
        ----------
        place : point of the field.
        wavelength_nm : centres of the bands, nm.
        """
        at, flips = self._seen_from(place)
        made = kernels.kernels(
            kernels.KernelRequest(at, self.flares, wavelength_nm, self.tiles.pitch_um, self.half),
            field_point_psf.field_point_kernels,
        )
        return replace(made, bands=[np.flip(band, flips) for band in made.bands])

    def _seen_from(self, place: Place) -> tuple[PupilOptics, tuple[int, ...]]:
        """Return the lens of a field point, and the axes along which its cores are mirrored."""
        place, flips = field_grid.first_quadrant(place) if self.mirrors else (place, ())
        return self.lens.at_place(self.tiles.angle_rad(place.radius), place.azimuth_rad), flips


def field_kernels(
    lens: PupilOptics,
    tiles: FieldTiles,
    wavelength_nm: np.ndarray,
    flares: Sequence[Flare],
    axis: kernels.Kernels,
) -> tuple[FieldKernels | None, list[Note]]:
    """Return (kernels, notes) of a lens with a point spread that varies over the field.

    The kernels are None if the point spread does not vary. The notes are the errors of the kernels,
    or state that the point spread does not vary. The error of the grid is measured between its
    points, against kernels computed there.

    Parameters
    ----------
    lens : a lens of this package.
    tiles : coordinates and pitch of the field's tiles.
    wavelength_nm : centres of the bands, nm.
    flares : flare components of the lens.
    axis : `kernels.Kernels` of the axis.

    Raises
    ------
    ConfigError : the field reaches beyond the field angles of the wavefront.
    """
    radius = tiles.radius
    if not lens.field_varies or radius == 0:
        return None, [omissions.ONE_POINT_SPREAD]
    waves = np.asarray(wavelength_nm, float)
    angles_rad = [tiles.angle_rad(r) for r in np.linspace(0, radius, ALONG)]
    line = meridian(lens, flares, angles_rad, waves)
    shape = len(tiles.y), len(tiles.x)
    exact, least = core_reach(line.along, line.references_nm, tiles.pitch_um, shape)
    reach = reach_of_cores(
        _axis_and_border(line, flares, tiles.pitch_um, exact), least, lens.speckle_error
    )
    cores = PlaceCores(lens, flares, tiles, reach.half, line.mirrors)
    with shown("how many places the field needs"):
        chosen = chosen_points(cache(cores.of_wave), radius, line, lens.error_allowed)
    if not chosen.points:
        spared = LeftOut(
            "variation of the point spread over the field",
            "it is less than the error allowed",
            float(chosen.error + omissions.SHARED),
            "share of a point's light",
        )
        return None, [spared]
    points, shares = _shares(chosen, tiles)
    with executor(min(cpus(), MOST_THREADS)) as pool:
        made = pool.map(lambda place: cores.of_bands(place, waves), points)
        cores_of_points = list(track(made, "places of the field", len(points)))
    found = FieldKernels(axis, reach.half, shares, cores_of_points, reach.unlike)
    notes: list[Note] = [_of_choice(chosen.error, len(points), line, lens.error_allowed)]
    notes += band_phase.errors(line.along[1:], waves)
    notes += field_point_psf.errors(line.along, flares, waves, reach.half)
    notes += _of_reach(reach, shape)
    notes += _of_speckle(found)
    return found, notes


def _axis_and_border(
    line: Meridian,
    flares: Sequence[Flare],
    pitch_um: tuple[float, float],
    reach: tuple[int, int],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return [(kernel of the axis, kernel of the border), ...] at the ends of two narrow bands
    around the first and the last reference wavelength.
    """
    pairs: list[tuple[np.ndarray, np.ndarray]] = []
    for wave in {line.references_nm[0], line.references_nm[-1]}:
        ends_nm = (wave - WIDTH_NM / 2, wave + WIDTH_NM / 2)
        axis, border = (
            kernels.kernels(kernels.KernelRequest(at, flares, ends_nm, pitch_um, reach)).bands
            for at in (line.along[0], line.along[-1])
        )
        pairs += zip(axis, border)
    return pairs


def _shares(
    chosen: Chosen, tiles: FieldTiles
) -> tuple[list[Place], list[tuple[tuple[slice, slice], np.ndarray]]]:
    """Return the field points that get light of some tile, and for each of them (window of the
    frame, share of the light of each tile in the window).
    """
    points = []
    shares = []
    for place, step in chosen.points:
        share = field_grid.weight(place, step, tiles.x, tiles.y)
        if share.any():
            window = _window(share)
            points.append(place)
            shares.append((window, share[window].astype(np.float32)))
    return points, shares


def _of_choice(error: float, count: int, line: Meridian, allowed: float) -> Note:
    """Return the error of point spreads between field points."""
    more = ", more than the error allowed" if error > allowed else ""
    label = (
        f"point spread between {count} places of the field, share of a point's light, L1, worst"
        f" of {', '.join(f'{w:g}' for w in line.references_nm)} nm{more}"
    )
    return term(error, "relative", "measured", label, key="field places")


def _of_reach(reach: Reach, shape: tuple[int, int]) -> list[Note]:
    """Return the error of using the axis' kernel beyond the cores; none if the cores cover the
    frame.
    """
    if reach.half == tuple(n - 1 for n in shape):
        return []
    label = (
        f"kernel of the axis, taken for all places farther from a lamp than {reach.half[1]} x"
        f" {reach.half[0]} tiles, where the field ends"
    )
    return [term(reach.error, "relative", "measured", label, key=AXIS_KERNEL, part=SPREAD)]


def _of_speckle(found: FieldKernels) -> list[Note]:
    """Return the sampling error of the cores of field points; none if it is 0."""
    speckle = max(float(core.speckle.max(initial=0.0)) for core in found.cores)
    if speckle == 0:
        return []
    label = (
        "sampling of the kernels of places of the field: cells of their pupil, speckle beyond"
        " an exact core"
    )
    return [term(speckle, "relative", "statistical", label, key=SPECKLE, part=SPREAD)]


def _window(share: np.ndarray) -> tuple[slice, slice]:
    """Return the slices of the frame that hold all nonzero shares of a field point."""
    rows = np.flatnonzero(share.any(axis=1))
    columns = np.flatnonzero(share.any(axis=0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)

"""Field imaging: convolution with point spreads that vary over the field.

The light of a tile is divided over the adjacent field points of a polar grid (`field.grid`). Each
share is spread by the exact core of the point spread of that field point. Light that goes farther
is spread by the wings of the axis. No weight is negative, and the energy of a point spread is kept.
The grid is fine enough for the error allowed, judged by wavefronts interpolated between its points.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from isethdr_core.cli.progress import shown, track
from isethdr_core.ledger import LeftOut, Note
from isethdr_core.physics.convolution import Bound
from isethdr_core.physics.optics import projection as projections
from isethdr_core.plugins.protocols import TransmitsPupil

from ..abilities import DrawsPupil
from ..imaging.overlap_add import overlaid
from ..imaging.threads import MOST_THREADS, cpus, executor
from ..psf import band_phase, kernel_sampling_error, kernels
from ..psf.error_parts import AXIS_KERNEL, SPECKLE, SPREAD, term
from ..psf.kernels import core_size
from ..pupil import sampled_pupil
from . import field_point_psf, omissions
from . import grid as field_grid
from .reference_bands import WIDTH_NM, references_nm

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import PupilOptics
    from .grid import Place

RINGS = (0, 1, 2, 4, 8)  # tried one after the other
ALONG = 9  # field points from the axis to the border of the field, at which a lens is looked at
PARTS = (0.15, 0.25, 0.4, 0.6)  # of the exact core, tried as reach of the cores of places
OUTERMOST = 0.75  # of the widest core
ROUND = 1e-6  # radii of the stop, by which a round pupil may be off
# times the error at the widest reach: where that is more than allowed, but not twice as much, a
# narrower one is as good
NO_BETTER = 1.25


@dataclass(frozen=True, eq=False)
class FieldKernels:
    """Kernels of a lens with a varying point spread: of the axis, and one core per field point."""

    axis: kernels.Kernels
    half: tuple[int, int]  # (y, x) tiles from the middle to the border of a core
    # per field point: a window of the frame, and the share of each tile's light in it
    shares: list[tuple[tuple[slice, slice], np.ndarray]]
    cores: list[kernels.Kernels]  # per field point, the axis first
    # per octave, how much kernels of field points may differ from that of the axis, as
    # `kernel_sampling_error.deviation`
    unlike: np.ndarray

    def far_scale(self, band: int) -> np.ndarray:
        """Return the factor (y, x) of each tile's light beyond the core, which the kernel of the
        axis spreads, so that the energy is kept.

        All cores are sampled alike, that of the axis included. Their sums are close to 1, and
        another sampling would change the small remainder.
        """
        rows, columns = (n // 2 + 1 for n in self.axis.bands[band].shape)
        out = np.zeros((rows, columns))
        remaining = [1 - core.bands[band].sum(dtype=float) for core in self.cores]
        for (window, share), beyond in zip(self.shares, remaining):
            out[window] += share * (beyond / remaining[0] if remaining[0] > 0 else 1.0)
        return out

    @cached_property
    def far(self) -> kernels.Kernels | None:
        """The kernels of the light beyond the cores; None if they are exact, or if the cores hold
        all light.
        """
        return None if self.axis.deviation is None else self._beyond(self.axis.deviation)

    @cached_property
    def unlike_far(self) -> kernels.Kernels | None:
        """The kernels of the axis, with their difference to the outermost field point as error."""
        # that bound is not asked for
        return self._beyond(
            np.broadcast_to(self.unlike, (len(self.axis.bands), len(self.unlike))), wrap=1.0
        )

    def _beyond(self, deviation: np.ndarray, **more: Any) -> kernels.Kernels | None:
        if all(np.array_equal(self.half, [n // 2 for n in band.shape]) for band in self.axis.bands):
            return None
        return replace(
            self.axis,
            core=np.full(len(self.axis.bands), float(min(self.half))),
            core_deviation=0.0,
            deviation=np.array(deviation),
            **more,
        )

    def _middle(self, band: int) -> tuple[slice, ...]:
        return tuple(
            slice(n // 2 - h, n // 2 + h + 1)
            for n, h in zip(self.axis.bands[band].shape, self.half)
        )

    def spread(
        self, out: np.ndarray, light: np.ndarray, band: int, error_allowed: float = 0.0
    ) -> Bound:
        """Write the image of one band's light, and return the bound of its convolutions.

        Parameters
        ----------
        out : (y, x) array for the image.
        light : (y, x) light of the band on the field's tiles.
        band : number of the band.
        error_allowed : relative error that the convolutions may have; 0: exact computation.
        """
        axis = np.array(self.axis.bands[band], float)
        axis[self._middle(band)] = 0.0
        parts = [(wide, part, core.bands[band]) for wide, part, core in self.parts(light)]
        if axis.any():
            parts.append(((slice(None), slice(None)), self.far_scale(band) * light, axis))
        total, bound = overlaid(parts, light.shape, error_allowed)
        out[...] = total
        return bound

    def parts(
        self, light: np.ndarray, power: float = 1.0
    ) -> Iterator[tuple[tuple[slice, ...], np.ndarray, kernels.Kernels]]:
        """Yield (window, part, kernels) of every field point that has a share of the light.

        The window has room for the core around the light.

        Parameters
        ----------
        light : (..., y, x).
        power : exponent of the shares, by which light is multiplied.
        """
        for (window, share), core in zip(self.shares, self.cores):
            part = share**power * light[(..., *window)]
            if part.any():
                wide = tuple(
                    slice(max(w.start - h, 0), min(w.stop + h, n))
                    for w, h, n in zip(window, self.half, light.shape[-2:])
                )
                more = [(0, 0)] * (light.ndim - 2) + [
                    (w.start - v.start, v.stop - w.stop) for w, v in zip(window, wide)
                ]
                yield wide, np.pad(part, more), core


class Meridian(NamedTuple):
    """A lens as light along +x of the field sees it, and what of that holds around the axis."""

    along: list  # lenses of field points from the axis to the border of the field
    references_nm: list[float]  # wavelengths at which field points are chosen, rising
    symmetric: bool  # point spreads are round: one field point stands for a ring
    mirrors: bool  # a quadrant of the field holds all point spreads


def meridian(
    lens: PupilOptics,
    flares: Sequence[Flare],
    angles_rad: Sequence[float],
    wavelength_nm: np.ndarray,
) -> Meridian:
    """Return a lens whose point spread varies, along +x of the field.

    Parameters
    ----------
    lens : a lens of this package. `flares` : its flare components.
    angles_rad : off the axis, from 0 to the border of the field.
    wavelength_nm : of the bands.

    Raises
    ------
    ConfigError : the field reaches beyond the field angles of the wavefront.
    """
    along = [lens.at_place(angle, 0.0) for angle in angles_rad]
    wavefronts = [lens.wavefront_at(angle) for angle in angles_rad]
    terms = [*wavefronts, *(dict(at.uneven) for at in along)]
    symmetric = field_grid.is_symmetric(terms) and not any(
        at.rims or _stretched(at) for at in along
    )
    mirrors = (
        field_grid.is_symmetric([lens.zernike_um or {}])
        and field_grid.is_mirrored(wavefronts)
        and not _shaped(flares)
    )
    return Meridian(along, references_nm(along[-1], wavelength_nm), symmetric, mirrors)


class FieldTiles(NamedTuple):
    """The tiles of a field."""

    x: np.ndarray  # centres, in the unit of the projection
    y: np.ndarray
    projection: str
    pitch_um: tuple[float, float]  # (y, x) of their images


def field_kernels(
    lens: PupilOptics,
    tiles: FieldTiles,
    wavelength_nm: np.ndarray,
    flares: Sequence[Flare],
    axis: kernels.Kernels,
) -> tuple[FieldKernels | None, list[Note]]:
    """Return (kernels, notes) of a lens whose point spread varies over the field.

    The kernels are None if the point spread does not vary. The notes are their errors, or state
    that nothing varies. The error of the grid is measured between its points, against kernels
    computed there.

    Parameters
    ----------
    lens : a lens of this package. `tiles` : coordinates and pitch of the field's tiles.
    wavelength_nm : of the bands. `flares` : its flare components.
    axis : `kernels.Kernels` of the axis.

    Raises
    ------
    ConfigError : the field reaches beyond the field angles of the wavefront.
    """
    x, y, projection, pitch_um = tiles
    shape = len(y), len(x)
    radius = float(np.hypot(np.abs(x).max(), np.abs(y).max()))
    if not lens.field_varies or radius == 0:
        return None, [omissions.ONE_POINT_SPREAD]

    def seen_from(r: float, azimuth_rad: float) -> PupilOptics:
        angle = float(projections.angle_rad(r, 0.0, projection))
        return lens.at_place(angle, azimuth_rad)

    waves = np.asarray(wavelength_nm, float)
    angles_rad = [
        float(projections.angle_rad(r, 0.0, projection)) for r in np.linspace(0, radius, ALONG)
    ]
    line = meridian(lens, flares, angles_rad, waves)
    along = line.along
    symmetric = line.symmetric
    some = line.references_nm
    exact, least = core_reach(along, some, pitch_um, shape)
    ends = [(w - WIDTH_NM / 2, w + WIDTH_NM / 2) for w in {some[0], some[-1]}]
    pairs = [
        zip(
            *(
                kernels.kernels(kernels.KernelRequest(at, flares, pair, pitch_um, exact)).bands
                for at in (along[0], along[-1])
            )
        )
        for pair in ends
    ]
    half, unlike, far_error = _reach(
        [both for pair in pairs for both in pair], least, lens.speckle_error
    )

    def turned(place: Place, make: Callable[..., Any]) -> tuple[tuple[Any, ...], np.ndarray]:
        place, flips = field_grid.first_quadrant(place) if line.mirrors else (place, ())
        return flips, make(seen_from(place.radius, place.azimuth_rad))

    @cache
    def core(
        radius: float | np.ndarray, azimuth_rad: float | np.ndarray, wave: float | np.ndarray
    ) -> np.ndarray:
        flips, kernel = turned(
            field_grid.Place(0, radius, azimuth_rad, 1),
            lambda at: field_point_psf.one(at, flares, wave, pitch_um, half),
        )
        return np.flip(kernel, flips)

    def cores(place: field_grid.Place) -> kernels.Kernels:
        flips, cores_of_nodes = turned(
            place,
            lambda at: kernels.kernels(
                kernels.KernelRequest(at, flares, waves, pitch_um, half),
                field_point_psf.field_point_kernels,
            ),
        )
        return replace(
            cores_of_nodes, bands=[np.flip(band, flips) for band in cores_of_nodes.bands]
        )

    with shown("how many places the field needs"):
        for rings in RINGS:
            error = 0.0
            for band in some:
                error = max(
                    error,
                    _error(
                        lambda p, band=band: core(p.radius, p.azimuth_rad, band),
                        rings,
                        radius,
                        symmetric,
                    ),
                )
                if error > lens.error_allowed and rings < RINGS[-1]:
                    break
            if error <= lens.error_allowed:
                break
    if rings == 0:
        spared = LeftOut(
            "variation of the point spread over the field",
            "it is less than the error allowed",
            float(error + omissions.SHARED),
            "share of a point's light",
        )
        return None, [spared]
    chosen = [(place, radius / rings) for place in field_grid.places(rings, radius, symmetric)]
    if len(RINGS) > 1:  # a study sets a single number: all field points stay
        chosen, error = _thinned(core, rings, radius, symmetric, some, lens.error_allowed)
    grid = []
    shares = []
    for place, step in chosen:
        share = field_grid.weight(place, step, x, y)
        if share.any():
            window = _window(share)
            grid.append(place)
            shares.append((window, share[window].astype(np.float32)))
    more = ", more than the error allowed" if error > lens.error_allowed else ""
    label = (
        f"point spread between {len(grid)} places of the field, share of a point's light, L1, worst"
        f" of {', '.join(f'{w:g}' for w in some)} nm{more}"
    )
    notes: list[Note] = [term(error, "relative", "measured", label, key="field places")]
    with executor(min(cpus(), MOST_THREADS)) as pool:
        kernels_of_field = FieldKernels(
            axis,
            half,
            shares,
            list(track(pool.map(cores, grid), "places of the field", len(grid))),
            unlike,
        )
    notes += band_phase.errors(along[1:], waves)
    notes += field_point_psf.errors(along, flares, waves, half)
    if half != tuple(n - 1 for n in shape):
        label = (
            f"kernel of the axis, taken for all places farther from a lamp than {half[1]} x"
            f" {half[0]} tiles, where the field ends"
        )
        notes.append(term(far_error, "relative", "measured", label, key=AXIS_KERNEL, part=SPREAD))
    if any(one.speckle.any() for one in kernels_of_field.cores):
        speckle = max(float(one.speckle.max()) for one in kernels_of_field.cores)
        label = (
            "sampling of the kernels of places of the field: cells of their pupil, speckle beyond"
            " an exact core"
        )
        notes.append(term(speckle, "relative", "statistical", label, key=SPECKLE, part=SPREAD))
    return kernels_of_field, notes


def _stretched(place: PupilOptics) -> bool:
    """Return whether the pupil of a place is an ellipse."""
    matrix = np.array(place.pupil_matrix if place.pupil_matrix is not None else np.eye(2))
    return not np.allclose(matrix, matrix[0, 0] * np.eye(2), rtol=0, atol=ROUND)


def _shaped(flares: Sequence[Flare]) -> bool:
    return any(isinstance(f, TransmitsPupil | DrawsPupil) for f in flares)


def core_reach(
    along: Sequence[PupilOptics],
    waves: Sequence[float],
    pitch_um: tuple[float, float],
    shape: tuple[int, int],
) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the (y, x) reach of exact cores on the axis, or of the geometrical blur where it is
    wider, and the least that cores may have; tiles.

    Parameters
    ----------
    along : lenses of field points from the axis to the border of the field.
    waves : wavelengths, nm, at which they are judged, rising.
    pitch_um : (y, x) of a tile.
    shape : (y, x) tiles of the frame.
    """
    lens = along[0]
    ends = (waves[0], waves[-1])
    blur = sampled_pupil.blur_um(lens, waves[0] - WIDTH_NM / 2)
    slope = max(sampled_pupil.steepest_um(at, w) for at in along for w in ends)
    geometrical = slope / sampled_pupil.radius_mm(lens) * sampled_pupil.distance_mm(lens)
    least = [min(n - 1, max(3, int(1.5 * geometrical / p) + 3)) for n, p in zip(shape, pitch_um)]
    exact = [
        min(n - 1, int(core_size.CORE_SAMPLES / np.ceil(2 * p / blur)))
        for n, p in zip(shape, pitch_um)
    ]
    return tuple(map(max, zip(exact, least))), tuple(least)


def _reach(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]], least: tuple[int, int], allowed: float
) -> tuple[tuple[int, int], np.ndarray, float]:
    """Return the reach (y, x) of the cores, and the difference beyond it per octave and at most.

    Beyond the reach all field points use the kernel of the axis. Differences are L1 norms.

    Parameters
    ----------
    pairs : [(kernel of the axis, kernel of the outermost field point), ...] of some bands; the
        second kernel ends at the largest possible reach.
    allowed : relative per tile, mean of an octave.
    """
    wide = [n // 2 for n in pairs[0][1].shape]
    reaches = [
        tuple(min(w, max(m, int(np.ceil(part * w)))) for w, m in zip(wide, least))
        for part in (*PARTS, 1.0)
    ]
    last, *others = _unlike(pairs, wide, reaches[-1])
    allowed = max(allowed, min(NO_BETTER * last.max(), 2 * allowed))
    for half in reaches[:-1]:
        error, unlike = _unlike(pairs, wide, half)
        if error.max() <= allowed:
            return half, unlike, float(error.max())
    return reaches[-1], *others, float(last.max())


def _unlike(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]],
    wide: Sequence[int],
    half: tuple[int, int],
) -> tuple[np.ndarray, np.ndarray]:
    """Return the error per octave (relative, L1) and the deviation, if the kernel of the axis
    replaces that of the outermost field point beyond `half`.
    """
    errors = []
    deviations = []
    for axis, place in pairs:
        axis = np.asarray(axis, float)[
            tuple(slice(n // 2 - w, n // 2 + w + 1) for n, w in zip(axis.shape, wide))
        ]
        # with the widest core kept, its outermost ring speaks for what lies beyond it
        core = tuple(
            slice(w - min(h, int(OUTERMOST * w)), w + min(h, int(OUTERMOST * w)) + 1)
            for w, h in zip(wide, half)
        )
        wrong = place - axis * ((1 - place[core].sum(dtype=float)) / (1 - axis[core].sum()))
        wrong[core] = 0.0
        errors.append(kernel_sampling_error.by_octave(wrong, axis))
        deviations.append(kernel_sampling_error.deviation(wrong, axis))
    error = np.max(errors, axis=0)
    unlike = np.max(deviations, axis=0)
    unlike_nodes = np.flatnonzero(unlike)
    if len(unlike_nodes):
        # beyond the largest reach, the value at its border
        unlike[unlike_nodes[-1] + 1 :] = unlike[unlike_nodes[-1]]
    return error, unlike


def _error(core: Callable[..., Any], rings: int, radius: float, symmetric: bool) -> float:
    """Return the largest L1 distance between the core half way between two field points and the
    mean of their cores. Without rings: between the core of the axis and those off it.
    """
    if rings == 0:
        axis = core(field_grid.Place(0, 0.0, 0.0, 1))
        return max(
            float(np.abs(core(field_grid.Place(1, r * radius, 0.0, 1)) - axis).sum(dtype=float))
            for r in (0.5, 0.75, 1.0)
        )
    step = radius / rings
    worst = 0.0
    for ring in range(rings):
        inner, outer = (field_grid.Place(k, k * step, 0.0, 1) for k in (ring, ring + 1))
        between = core(field_grid.Place(ring, (ring + 0.5) * step, 0.0, 1))
        worst = max(worst, np.abs((core(inner) + core(outer)) / 2 - between).sum(dtype=float))
        if not symmetric:
            turn = np.pi / (field_grid.AROUND * (ring + 1))
            a, b, middle = (core(replace(outer, azimuth_rad=t)) for t in (0.0, 2 * turn, turn))
            worst = max(worst, np.abs((a + b) / 2 - middle).sum(dtype=float))
    return float(worst)


def _thinned(
    core: Callable[[float, float, float], np.ndarray],
    rings: int,
    radius: float,
    symmetric: bool,
    waves: Sequence[float],
    allowed: float,
) -> tuple[list[tuple[field_grid.Place, float]], float]:
    """Return the field points of a grid that are needed, each with its `step`, and the error half
    way between them.
    """

    def between(inner: float, outer: float) -> float:
        return max(_between(core, inner, outer, w) for w in waves)

    def around(r: float, turn: float) -> float:
        return max(_around(core, r, turn, w) for w in waves)

    chosen = field_grid.thinned(rings, radius, symmetric, between, around, allowed)
    counts = {place.radius: place.count for place, _ in chosen}
    radii = sorted(counts)
    errors = [between(*pair) for pair in zip(radii, radii[1:])] + [
        around(r, 2 * np.pi / counts[r]) for r in radii[1:] if not symmetric
    ]
    return chosen, max(errors)


def _between(
    core: Callable[[float, float, float], np.ndarray], inner: float, outer: float, wave: float
) -> float:
    """Return the error half way between two places on +x."""
    return float(
        np.abs(
            (core(inner, 0.0, wave) + core(outer, 0.0, wave)) / 2
            - core((inner + outer) / 2, 0.0, wave)
        ).sum()
    )


def _around(
    core: Callable[[float, float, float], np.ndarray], radius: float, turn: float, wave: float
) -> float:
    """Return the error half way between +x and a place `turn` further round."""
    return float(
        np.abs(
            (core(radius, 0.0, wave) + core(radius, turn, wave)) / 2 - core(radius, turn / 2, wave)
        ).sum()
    )


def _window(share: np.ndarray) -> tuple[slice, slice]:
    """Return the slices of the frame that hold all of a place's share."""
    rows = np.flatnonzero(share.any(axis=1))
    columns = np.flatnonzero(share.any(axis=0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)

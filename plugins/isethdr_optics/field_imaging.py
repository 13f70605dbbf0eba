"""Field imaging: point spreads that vary over the field, scattered from the source.

A tile's light is shared by the places of a polar grid (`field_grid`), each share is spread by the exact core of that place's own
point spread, and all light that goes farther by the tail of the axis: nothing is negative, and the energy is that of one point
spread. Wavefronts are interpolated, not point spreads: the grid is as fine as the error allowed asks for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from isethdr_core import geometry, ledger
from isethdr_core.physics import projection as projections
from isethdr_core.physics.convolution import Bound
from isethdr_core.physics.zernike import steepest_slope_um

from . import field_grid, kernels, omissions, pupils
from .overlaid import overlaid
from .place_lens import node_lens

RINGS = (0, 1, 2, 3, 4, 6, 8)  # tried one after the other


@dataclass(frozen=True, eq=False)
class FieldKernels:
    """What `image` needs of a lens whose point spread varies: kernels on the axis, and how to spread a band."""

    axis: kernels.Kernels
    half: tuple[int, int]  # (y, x) tiles from the middle to the border of a core
    shares: list[tuple[tuple[slice, slice], np.ndarray]]  # per place, a window of the frame and there the share of the light
    cores: list[list[np.ndarray]]  # per place, per band

    def spread(self, out, light, band: int, error_allowed: float = 0.0) -> Bound:
        """Write the image of one band's light, (y, x), into `out`; return the bound of its convolutions, right to `error_allowed`, relative."""
        axis = np.array(self.axis.bands[band], float)
        middle = tuple(slice(n // 2 - h, n // 2 + h + 1) for n, h in zip(axis.shape, self.half))
        beyond = 1 - axis[middle].sum()  # everything beyond the core, on the frame or not
        axis[middle] = 0.0
        scale, parts = np.zeros(light.shape), []
        for (window, share), cores in zip(self.shares, self.cores):
            part = share * light[window]
            scale[window] += share * ((1 - cores[band].sum(dtype=float)) / beyond if beyond > 0 else 1.0)
            if part.any():
                wide = tuple(slice(max(w.start - h, 0), min(w.stop + h, n)) for w, h, n in zip(window, self.half, light.shape))
                parts.append(
                    (wide, np.pad(part, [(w.start - v.start, v.stop - w.stop) for w, v in zip(window, wide)]), cores[band])
                )
        if axis.any():
            parts.append(((slice(None), slice(None)), scale * light, axis))
        total, bound = overlaid(parts, light.shape, error_allowed)
        out[...] = total
        return bound


def field_kernels(lens, mixed, flares, axis: kernels.Kernels, pitch_um) -> FieldKernels | None:
    """Return the kernels of a lens whose point spread varies over the field of `mixed`, None where it does not.

    States in the ledger the error of the grid, measured between its places by the kernels that belong there.

    Raises
    ------
    ConfigError : where the field reaches beyond what is known of the wavefront.
    """
    x, y = (mixed[d].values.astype(float) for d in ("x", "y"))
    projection = geometry.projection_of(mixed)
    radius = float(np.hypot(np.abs(x).max(), np.abs(y).max()))
    if not lens.field_varies or radius == 0:
        omissions.one_point_spread()
        return None

    def seen_from(r, azimuth_rad):
        angle = float(projections.angle_rad(r, 0.0, projection))
        return node_lens(lens, lens.wavefront_at(angle), azimuth_rad, angle)

    waves = mixed.wavelength.values.astype(float)
    along = [seen_from(r, 0.0) for r in np.linspace(0, radius, 9)]
    known = [lens.wavefront_at(float(projections.angle_rad(r, 0.0, projection))) for r in np.linspace(0, radius, 9)]
    symmetric = field_grid.is_symmetric(known) and not any(at.rims for at in along)
    half = _half(along, waves, pitch_um, mixed.shape[1:])

    mirrors = field_grid.is_symmetric([lens.zernike_um or {}]) and field_grid.is_mirrored(known) and not _shaped(flares)

    def cores(place, waves):
        place, flips = field_grid.first_quadrant(place) if mirrors else (place, ())
        return [np.flip(band, flips) for band in kernels.kernels(seen_from(place.radius, place.azimuth_rad), flares, waves, pitch_um, half).bands]

    for rings in RINGS:
        error = 0.0
        for band in dict.fromkeys((waves[0], waves[-1], waves[len(waves) // 2])):
            error = max(error, _error(lambda p, band=band: cores(p, np.array([band]))[0], rings, radius, symmetric))
            if error > lens.error_allowed and rings < RINGS[-1]:
                break
        if error <= lens.error_allowed:
            break
    if rings == 0:
        ledger.left_out(
            "point spreads off the axis", "they differ less than the error allowed", error + omissions.SHARED, "share of a point's light"
        )
        return None
    grid, shares = [], []
    for place in field_grid.places(rings, radius, symmetric):
        share = field_grid.weight(place, radius / rings, x, y)
        if share.any():
            window = _window(share)
            grid.append(place)
            shares.append((window, share[window].astype(np.float32)))
    more = ", more than the error allowed" if error > lens.error_allowed else ""
    ledger.error(error, "share of a point's light", "measured",
                 f"point spread between {len(grid)} places of the field, L1, worst of the first, middle and last band{more}")
    made = FieldKernels(axis, half, shares, [cores(p, waves) for p in grid])
    core = np.array([[c.sum(dtype=float) for c in per] for per in made.cores])
    if half != tuple(n - 1 for n in mixed.shape[1:]):
        ledger.error(np.ptp(core, axis=0).max(), "share of a point's light", "bound", "spread far from a lamp as on the axis")
    return made


def _shaped(flares) -> bool:
    return any(hasattr(f, "pupil") or hasattr(f, "pupil_shapes") for f in flares)


def _half(along, waves, pitch_um, shape):
    """Return the (y, x) reach of the cores: that of the exact cores on the axis, or the geometrical blur where it is wider.

    `along` : the lenses of places from the axis to the border of the field.
    """
    lens, ends = along[0], (waves[0], waves[-1])
    blur = pupils.blur_um(lens, float(waves.min()))
    slope = max(steepest_slope_um(pupils.coefficients_um(at, w)) for at in along for w in ends)
    geometrical = slope / pupils.radius_mm(lens) * pupils.distance_mm(lens)
    return tuple(
        min(n - 1, max(3, int(kernels.CORE_SAMPLES / np.ceil(2 * p / blur)), int(1.5 * geometrical / p) + 3))
        for n, p in zip(shape, pitch_um)
    )


def _error(core, rings, radius, symmetric) -> float:
    """Return the largest L1 distance between true cores half way between places and the mean of those places' cores.

    Without rings: between cores off the axis and that on it.
    """
    if rings == 0:
        axis = core(field_grid.Place(0, 0.0, 0.0, 1))
        return max(float(np.abs(core(field_grid.Place(1, r * radius, 0.0, 1)) - axis).sum(dtype=float)) for r in (0.5, 0.75, 1.0))
    step, worst = radius / rings, 0.0
    for ring in range(rings):
        inner, outer = (field_grid.Place(k, k * step, 0.0, 1) for k in (ring, ring + 1))
        between = core(field_grid.Place(ring, (ring + 0.5) * step, 0.0, 1))
        worst = max(worst, np.abs((core(inner) + core(outer)) / 2 - between).sum(dtype=float))
        if not symmetric:
            turn = np.pi / (field_grid.AROUND * (ring + 1))
            a, b, middle = (core(replace(outer, azimuth_rad=t)) for t in (0.0, 2 * turn, turn))
            worst = max(worst, np.abs((a + b) / 2 - middle).sum(dtype=float))
    return float(worst)


def _window(share):
    """Return the slices of the frame that hold all of a place's share."""
    rows, columns = np.flatnonzero(share.any(axis=1)), np.flatnonzero(share.any(axis=0))
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)

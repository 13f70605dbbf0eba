"""Rings: sampling of the pattern and of the rings beyond the exact core."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.physics.optics import half_plane_pattern as patterns
from isethdr_core.physics.optics.lattice import spline_response

if TYPE_CHECKING:
    from isethdr_core.physics.optics.half_plane_pattern import HalfLattice

    from .frame import Frame

# largest number of positions under a tile's triangle; they then lie closer together than the finest
# detail of any wavelength
MOST_PLACES = 14
MOST_SAMPLES = 3e8  # largest number of samples of the period of a lattice
FINEST = 8.0  # largest factor on the usual samples and rays
# width of tiles, wavelengths x f-number, for which the usual rays per tile are enough; wider tiles
# take more rays at the same distance from each other
USUAL_TILE = 1.9
USUAL_ERROR = 0.03  # largest relative error of a tile's light with the usual sampling
# largest relative error of the border tiles from the period of the field, as `wings.WRAP_SHARED`
WRAP = 0.0015
FINE_STRIPS = 3.0  # strips per row of pupil cells for patterns that are accurate to 1e-4


@dataclass(frozen=True)
class Level:
    """Sampling of the rings where a band moves light by less than `moves` tiles."""

    moves: float
    step: float  # distance of the lattice's samples, wavelengths x f-number
    per_tile: float  # least number of samples along each axis of a tile
    rays: float  # number of rays per tile, at the outermost tiles of a ring
    # positions under a tile's triangle, times the tiles that its light moves in a band
    places: float = 5.5

    def finer(self, times: float) -> Level:
        """Return the level with `times` the samples of a lattice. The number of samples per axis,
        of rays and of positions each grows by the root of `times`.
        """
        root = np.sqrt(times)
        return Level(
            self.moves, self.step / root, self.per_tile * root, self.rays * root, self.places * root
        )


@dataclass(frozen=True)
class Rings:
    """Sampling of all rings, and of the direct sums that give their errors."""

    levels: tuple[Level, ...]
    period: float = patterns.PERIOD  # period of the field, in reaches, where memory allows it
    # least period; where memory does not hold it, the samples are farther apart instead
    least_period: float = patterns.PERIOD
    strips: float = patterns.STRIPS  # strips per row of pupil cells
    sharpened: bool = False  # whether samples are sharpened, as in `ray_sums.Sector`
    # sampling of the direct sums: fields of `pattern_columns.Place`
    columns: Mapping[str, float] = field(default_factory=dict)

    def finer(self, times: float) -> Rings:
        """Return rings with `times` the samples in all levels, as in `Level.finer`."""
        return replace(self, levels=tuple(level.finer(times) for level in self.levels))


USUAL = Rings(
    (
        Level(1.8, 0.4, 4.0, 3.0),
        Level(5.5, 0.45, 4.0, 3.0),
        Level(np.inf, 0.7, 2.5, 2.0),
    )
)
# sampling for light next to very bright lamps: 0.02 to 0.13 of the usual errors
FINE = Rings(
    (
        Level(1.8, 0.2, 8.0, 3.0, 27.0),
        Level(5.5, 0.2, 8.0, 3.0, 27.0),
        # half the error of step 0.4 with 4 samples per tile, for a tenth more time
        Level(np.inf, 0.28, 5.7, 3.0, 27.0),
    ),
    3.2,
    2.5,
    FINE_STRIPS,
    True,
    {"step": 0.12, "moves": 0.25, "period": 6.0, "strips": 4.0},
)
# Sampling of wide tiles. A pattern has no frequency above 1 / (wavelength x f-number), and a tile
# passes hardly any frequency above 1 / width. With a step of 0.8, no frequency of the pattern
# aliases into those that tiles pass, if tiles are wider than 4 wavelengths x f-number. A step of
# 1.2 had errors up to 17 %.
WIDE = Rings((Level(np.inf, 0.8, 4.0, 3.0),), columns={"step": 0.75})
WIDE_FINE = 4.0  # argument of `Rings.finer` for wide tiles, if a sensor needs fine rings


def usual_rings(frame: Frame) -> Rings:
    """Return the usual sampling of a frame's rings."""
    if not frame.has_wide_tiles:
        return USUAL
    # fewer rays and positions, by the root of the ratio of the tile widths; the error still halves
    share = np.sqrt(USUAL_TILE / frame.tile_width)
    levels = (replace(v, rays=v.rays * share, places=v.places * share) for v in WIDE.levels)
    return replace(WIDE, levels=tuple(levels))


def fine_rings(frame: Frame) -> Rings:
    """Return the sampling of a frame's rings for light next to very bright lamps."""
    return usual_rings(frame).finer(WIDE_FINE) if frame.has_wide_tiles else FINE


def finer_rings(frame: Frame) -> Rings:
    """Return the sampling of a frame's rings for the error that the lens allows."""
    return usual_rings(frame).finer(min(FINEST, max(1.0, USUAL_ERROR / frame.lens.speckle_error)))


def reaches(frame: Frame, read: Rings = USUAL) -> Iterator[tuple[Level, list[int]]]:
    """Yield levels, and the (y, x) tiles from the axis to the border of each; none if the exact
    core covers the frame.
    """
    for level in read.levels if frame.core != frame.reach else ():
        border = level.moves / frame.narrowest
        yield level, [int(min(r, max(border, c))) for r, c in zip(frame.reach, frame.core)]


def lattices(frame: Frame, read: Rings = USUAL) -> list[HalfLattice]:
    """Return the lattices of all levels, the largest last. If the exact core covers the frame,
    return the lattice that the last level would have.
    """
    levels = list(reaches(frame, read)) or [(read.levels[-1], frame.reach)]
    return [lattice(frame, level, outer, read) for level, outer in levels]


def lattice(frame: Frame, level: Level, outer: Sequence[int], read: Rings = USUAL) -> HalfLattice:
    """Return the `half_plane_pattern.HalfLattice` of a level that ends `outer` (y, x) tiles from
    the axis.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    level : level of the rings that are read from the lattice.
    outer : (y, x) tiles from the axis to the border of the level.
    read : sampling of the rings.
    """
    pitch = min(frame.pitch_um)
    blur = frame.blur_um
    step = min(level.step * blur, pitch / level.per_tile)
    extent = [(r + 2) * p for r, p in zip(outer, frame.pitch_um)]
    finest = np.sqrt(np.prod(extent) / MOST_SAMPLES)  # for a period of one reach
    step = max(step, read.least_period * finest)
    period = max(read.least_period, min(read.period, step / finest))
    return patterns.half_lattice(extent, step, period, read.strips)


def wrap(frame: Frame, read: Rings) -> float:
    """Return the largest relative error of the border tiles from the period of the field.

    `WRAP` was measured with the usual period. A longer period suppresses the amplitude of light
    from beyond it more (`lattice.spline_response`).

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    read : sampling of the rings.
    """
    level, outer = list(reaches(frame, read))[-1]
    lattice_of_level = lattice(frame, level, outer, read)
    period = min(p / f for p, f in zip(lattice_of_level.period, lattice_of_level.samples_to_border))
    needed, usual = (
        float(spline_response(1 - 1 / p) / spline_response(1 / p))
        for p in (period, patterns.PERIOD)
    )
    return WRAP * min(1.0, needed / usual)


def rays_per_tile(frame: Frame, level: Level) -> float:
    """Return the number of rays per tile at the outermost tiles of a ring. Rays in wide tiles are
    as close as in tiles of usual width.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    level : level of the ring.
    """
    blur = frame.blur_um
    return level.rays * max(1.0, max(frame.pitch_um) / (USUAL_TILE * blur))


def places(frame: Frame, low: int, level: Level) -> int:
    """Return the number of positions at which the triangle of two tiles is sampled in a ring.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    low : tiles from the axis to the inner border of the ring.
    level : level of the ring.
    """
    count = np.ceil(level.places / (low * frame.narrowest) - 0.05)
    return int(np.clip(count, 1, MOST_PLACES))

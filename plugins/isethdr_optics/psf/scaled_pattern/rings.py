"""Rings: how finely the pattern is sampled, and read, beyond the exact core."""

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

MOST_PLACES = 14  # closer together than the finest detail of any wavelength
MOST_SAMPLES = 3e8  # of the period of a lattice
FINEST = 8.0  # times the samples and rays that are read as usual
# wavelengths x f-number wide; wider ones take more rays, so that these lie as close
USUAL_TILE = 1.9
USUAL_ERROR = 0.03  # of a tile's light that these leave at most
# largest error of the border tiles from the period of the field, as `wings.WRAP_SHARED`
WRAP = 0.0015
FINE_STRIPS = 3.0  # of a row of cells, for patterns right to 1e-4


@dataclass(frozen=True)
class Level:
    """How finely rings are read where a band moves light by less than `moves` tiles."""

    moves: float
    step: float  # of the lattice, wavelengths x f-number
    per_tile: float  # samples along each axis of a tile, at least
    rays: float  # per tile, at a ring's outermost
    places: float = 5.5  # under a tile's triangle, over the tiles that its light moves in a band

    def finer(self, times: float) -> Level:
        """Return the level with `times` the samples of a lattice, rays and positions."""
        root = np.sqrt(times)
        return Level(
            self.moves, self.step / root, self.per_tile * root, self.rays * root, self.places * root
        )


@dataclass(frozen=True)
class Rings:
    """How finely all rings are read, and how their errors are looked at."""

    levels: tuple[Level, ...]
    period: float = patterns.PERIOD  # of the field, in reaches, where memory allows it
    least_period: float = patterns.PERIOD  # where memory does not; samples then lie farther apart
    strips: float = patterns.STRIPS  # of a pupil's cell
    sharpened: bool = False  # samples, as `ray_sums.Sector`
    columns: Mapping[str, float] = field(default_factory=dict)  # of direct sums, as `Place`

    def finer(self, times: float) -> Rings:
        """Return rings with `times` the samples, rays and positions."""
        return replace(self, levels=tuple(level.finer(times) for level in self.levels))


USUAL = Rings(
    (
        Level(1.8, 0.4, 4.0, 3.0),
        Level(5.5, 0.45, 4.0, 3.0),
        Level(np.inf, 0.7, 2.5, 2.0),
    )
)
# For light beside very bright lamps: 0.02 to 0.1 of the usual errors
FINE = Rings(
    (
        Level(1.8, 0.2, 8.0, 3.0, 27.0),
        Level(5.5, 0.2, 8.0, 3.0, 27.0),
        # half the error of 0.4 and 4, for a tenth of the time
        Level(np.inf, 0.28, 5.7, 3.0, 27.0),
    ),
    3.2,
    2.5,
    FINE_STRIPS,
    True,
    {"step": 0.12, "moves": 0.25, "period": 6.0, "strips": 4.0},
)
# A pattern has no frequency above 1 / (wavelength x f-number), a tile hardly takes those above
# 1 / width: a step of 0.8 takes none of the first kind for one of the second where tiles are wider
# than 4. A step of 1.2 was up to 17 % wrong.
WIDE = Rings((Level(np.inf, 0.8, 4.0, 3.0),), columns={"step": 0.75})
WIDE_FINE = 4.0  # times the samples, rays and places, where a sensor asks for fine rings


def usual_rings(frame: Frame) -> Rings:
    """Return how rings of a frame are read, unless a sensor asks for more."""
    if not frame.has_wide_tiles:
        return USUAL
    # fewer rays and positions, by the root of the ratio of the tile widths: the error halves
    share = np.sqrt(USUAL_TILE / frame.tile_width)
    levels = (replace(v, rays=v.rays * share, places=v.places * share) for v in WIDE.levels)
    return replace(WIDE, levels=tuple(levels))


def fine_rings(frame: Frame) -> Rings:
    """Return how rings of a frame are read beside very bright lamps."""
    return usual_rings(frame).finer(WIDE_FINE) if frame.has_wide_tiles else FINE


def finer_rings(frame: Frame) -> Rings:
    """Return how rings of a frame are read for the error that the lens allows."""
    return usual_rings(frame).finer(min(FINEST, max(1.0, USUAL_ERROR / frame.lens.speckle_error)))


def reaches(frame: Frame, read: Rings = USUAL) -> Iterator[tuple[Level, list[int]]]:
    """Yield levels and the (y, x) tiles from the axis to the border of each."""
    for level in read.levels if frame.core != frame.reach else ():
        border = level.moves / frame.narrowest
        yield level, [int(min(r, max(border, c))) for r, c in zip(frame.reach, frame.core)]


def lattices(frame: Frame, read: Rings = USUAL) -> list[HalfLattice]:
    """Return the lattices of all levels, the largest last; those of a frame within its core too."""
    levels = list(reaches(frame, read)) or [(read.levels[-1], frame.reach)]
    return [lattice(frame, level, outer, read) for level, outer in levels]


def lattice(frame: Frame, level: Level, outer: Sequence[int], read: Rings = USUAL) -> HalfLattice:
    """Return the `half_plane_pattern.HalfLattice` of a level that ends `outer` (y, x) tiles from
    the axis.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    level : of the rings that are read from it.
    outer : (y, x) tiles from the axis to the border of the level.
    read : how finely rings are read.
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
    """Return the largest error that the period of the field leaves in the border tiles.

    `WRAP` was measured with the usual period; light from beyond a longer one is held back by more
    (`lattice.spline_response`), in amplitude.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    read : how finely rings are read.
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
    """Return the rays per tile at a ring's outermost: as close as in a tile of usual width.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    level : of the ring.
    """
    blur = frame.blur_um
    return level.rays * max(1.0, max(frame.pitch_um) / (USUAL_TILE * blur))


def places(frame: Frame, low: int, level: Level) -> int:
    """Return the places that stand for the triangle of two tiles in a ring from `low` tiles on.

    Parameters
    ----------
    frame : bands and tiles of the kernels.
    low : tiles from the axis to the ring.
    level : of the ring.
    """
    count = np.ceil(level.places / (low * frame.narrowest) - 0.05)
    return int(np.clip(count, 1, MOST_PLACES))

"""Ray sums: band means of a pattern that scales with the wavelength, from running sums along rays.

With P the pattern at the wavelength w0 and u = w0 / w, light at (s, t s) on the ray of slope t has
the density u^2 P(u s, t u s). Its mean over a band from a to b is

    w0 / ((b - a) s)  x  integral of P(r, t r) dr from r = s w0 / b to s w0 / a.

One running sum along a ray therefore serves bands of any width: each border of a band is one read.
A tile's width across the ray is an interval of slopes, the same for all wavelengths, so that one
sparse matrix serves all bands.

If a phase changes the pattern with the wavelength, the pattern of each band is a weighted sum of a
few patterns on the same lattice. Their running sums are added before they are averaged over tiles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

if TYPE_CHECKING:
    from .half_plane_pattern import HalfPattern

# of the outermost to the innermost tile of a ring: its tiles share rays, and running sums keep
# their digits
RATIO = 1.4
LINES = 64  # of the lattice, per block of work
TOGETHER = 30000  # rays whose means are averaged over tiles at once: some megabytes
# of second differences, that make up for steps and for lines between samples
ALONG = 1 / 24
ACROSS = 1 / 12
TILES = 16  # along the major axis, per block of work: a cache line of float32


@dataclass(frozen=True, eq=False)
class Sector:
    """The quarter plane |minor| <= major about one axis, lattice and tiles; pairs are (major,
    minor).
    """

    lines: Callable[[int, int], np.ndarray]  # (first, last) -> samples (major, minor), float32
    middle: int  # index of minor 0 in a line
    step_um: float
    pitch_um: tuple[float, float]
    wavelength_nm: float  # of the pattern
    edges_nm: np.ndarray  # (band, 2)
    # whether samples make up beforehand for what lines between them will take from fine detail
    sharpened: bool = False
    share: np.ndarray | None = None  # (band,) of the pattern in every band's; None: all of it


class Ring(NamedTuple):
    """Tiles low < major <= high, |minor| <= min(major - less, minor)."""

    low: int
    high: int
    minor: int
    less: int


class Columns(NamedTuple):
    """Means of tiles `first` and following along the major axis: (band, major, minor); of a tile j
    those with |minor| <= j hold.
    """

    first: int
    values: np.ndarray


def rings(low: int, high: int) -> list[tuple[int, int]]:
    """Return (low, high) of rings that share their rays, from the inside."""
    bounds = [high]
    while bounds[0] > low:
        bounds.insert(0, max(low, int(bounds[0] / RATIO)))
    return list(zip(bounds[:-1], bounds[1:]))


def band_means(
    sectors: Sequence[Sector],
    ring: Ring,
    rays_per_tile: float,
    places: int,
    write: Callable[[Columns], None],
    apply: Callable = map,
) -> None:
    """Compute the light from one tile to another, averaged over each band, for all tiles of one
    ring.

    Parameters
    ----------
    sectors : sectors of patterns whose weighted sum is the pattern of a band; they differ in
        samples and `share` only.
    ring : tiles to compute.
    rays_per_tile : rays per tile at the outermost tiles of the ring; there are more farther in.
    places : along the major axis, that stand for the triangle which two tiles make of a point.
    write : takes blocks of results.
    apply : how to call a function for every block: `map`, or the `map` of a pool of threads.
    """
    rays = _rays(sectors[0], ring, rays_per_tile)
    sums = [_running_sums(sector, rays, apply) for sector in sectors]
    reader = _Reader(sectors, ring, rays, sums, places)
    starts = range(ring.low + 1, ring.high + 1, TILES)
    for _ in apply(lambda j: write(reader.columns(j, min(j + TILES, ring.high + 1))), starts):
        pass


class Work(NamedTuple):
    """What `band_means` does for one ring, whatever the bands."""

    sums: float  # values of running sums
    reads: float  # rays x places of all columns, read at every border of a band
    taps: float  # weights of rays in tiles, for every band


def work(sector: Sector, ring: Ring, rays_per_tile: float, places: int) -> Work:
    """Return the work that `band_means` does for a ring.

    Parameters
    ----------
    sector : sector of the ring; its samples are not read.
    ring : tiles to compute.
    rays_per_tile : rays per tile at the outermost tiles of the ring.
    places : points along the major axis that stand for the triangle which two tiles make of a
        point.
    """
    rays = _rays(sector, ring, rays_per_tile)
    column = np.arange(ring.low + 1, ring.high + 1)
    most = np.minimum(column - ring.less, ring.minor)
    rays_read = np.minimum(rays.half, (most + 2) / (np.maximum(column - 1, 1) * rays.pace) + 1)
    wide = 2 * np.maximum(1.0, 1 / (column * rays.pace)) + 1
    return Work(
        float((rays.last - rays.first) * (2 * rays.half + 1)),
        float(places * (2 * rays_read + 1).sum()),
        float(places * ((2 * most + 1) * wide).sum()),
    )


@dataclass(frozen=True, eq=False)
class _Rays:
    pace: float  # from one slope to the next, minor tiles per major tile
    half: int  # slopes on either side of 0
    first: int  # line of the lattice that the sums start at
    last: int


def _rays(sector: Sector, ring: Ring, rays_per_tile: float) -> _Rays:
    pace = 1 / (rays_per_tile * ring.high)
    widest = min(1.0, ring.minor / (ring.low + 1)) + 2.5 / max(ring.low, 1)
    u = sector.wavelength_nm / sector.edges_nm
    per_tile = sector.pitch_um[0] / sector.step_um
    first = max(0, int((ring.low - 1) * u.min() * per_tile) - 1)
    last = int(np.ceil((ring.high + 1.2) * u.max() * per_tile)) + 2
    return _Rays(pace, int(np.ceil(widest / pace)), first, last)


def _running_sums(sector: Sector, rays: _Rays, apply: Callable[..., Any]) -> np.ndarray:
    """Return sums[k, ray] of the samples of lines first .. first + k - 1, each a line between two
    samples.
    """
    slopes = np.arange(-rays.half, rays.half + 1) * (
        rays.pace * sector.pitch_um[1] / sector.pitch_um[0]
    )
    sums = np.empty((rays.last - rays.first + 1, len(slopes)), np.float32)
    sums[0] = 0.0

    def read(start: int) -> None:
        lines = _lines(sector, start, min(start + LINES, rays.last))
        for k, line in enumerate(lines, start - rays.first + 1):
            at = slopes * (k + rays.first - 1) + sector.middle
            index = at.astype(np.int32)
            into = sums[k]
            np.take(np.diff(line), index, out=into, mode="clip")
            into *= (at - index).astype(np.float32)
            into += line.take(index, mode="clip")

    def gather(start: int) -> None:
        part = sums[:, start : start + width]
        np.cumsum(part, axis=0, out=part)

    for _ in apply(read, range(rays.first, rays.last, LINES)):
        pass
    width = 256  # rays at a time: rows of a kilobyte
    for _ in apply(gather, range(0, sums.shape[1], width)):
        pass
    return sums


def _lines(sector: Sector, first: int, last: int) -> np.ndarray:
    """Return lines first .. last - 1 of a sector, sharpened where it asks for that.

    A running sum that is read between its rows is that of a pattern of steps, sinc(f h) of a
    frequency f along the ray; a sample between two of a line is sinc(f h)^2 of one across it, h
    the distance of samples. Second differences make up for either, to the fourth power of f h.
    """
    if not sector.sharpened:
        return sector.lines(first, last)
    wide = sector.lines(max(first - 1, 0), last + 1)
    if first == 0:
        wide = np.concatenate([wide[:1], wide])
    if len(wide) < last - first + 2:
        wide = np.concatenate([wide, wide[-1:]])
    middle = wide[1:-1]
    out = middle * np.float32(1 + 2 * ALONG + 2 * ACROSS)
    out -= np.float32(ALONG) * (wide[:-2] + wide[2:])
    out[:, 1:-1] -= np.float32(ACROSS) * (middle[:, :-2] + middle[:, 2:])
    return out


class _Reader:
    """Reads running sums at the borders of all bands and averages them over tiles."""

    def __init__(
        self, sectors: list[Sector], ring: Ring, rays: _Rays, sums: list[np.ndarray], places: int
    ) -> None:
        sector = sectors[0]
        self.sector = sector
        self.ring = ring
        self.rays = rays
        self.sums = [(one, of.share) for one, of in zip(sums, sectors)]
        edges = sector.edges_nm
        self.u, where = np.unique(sector.wavelength_nm / edges, return_inverse=True)
        self.where = where.reshape(edges.shape)
        # What a sum of lines between samples is, in light on a tile at major 1, minor 0
        self.factor = sector.pitch_um[1] * sector.step_um * sector.wavelength_nm
        self.factor = self.factor / (edges[:, 1] - edges[:, 0])
        self.inside, self.weights = _triangle_rule(places)
        # If the band's width alone spreads a tile along the ray, the tile's length still widens it
        # across a slanted ray: two triangles, whose distance is the width of the tile's triangle
        # along the major axis
        self.lean = np.sqrt(1 / 6) if places == 1 else 0.0
        # A triangle across the rays is drawn narrower by what lines between samples widen it, in
        # the image of a middle wavelength
        wider = (sector.step_um / sector.pitch_um[1]) ** 2 / (6 * self.u[0] * self.u[-1])
        self.narrow = 1.0 if sector.sharpened else np.sqrt(max(0.5, 1 - 6 * wider))

    def columns(self, first: int, last: int) -> Columns:
        """Return the means of tiles first .. last - 1 along the major axis."""
        most = min(last - 1 - self.ring.less, self.ring.minor)
        out = np.zeros((len(self.where), last - first, 2 * most + 1), np.float32)
        for start in range(
            first, last, count := max(1, TOGETHER // (2 * self._rays_to(last) * len(self.inside)))
        ):
            group = range(start, min(start + count, last))
            sums_of_tiles = self._tiles(group)
            end = 0
            for j in group:
                own = self._most(j)
                begin = end
                end = end + 2 * own + 1
                out[:, j - first, most - own : most + own + 1] = sums_of_tiles[begin:end].T
        return Columns(first, out)

    def _most(self, j: int) -> int:
        return min(j - self.ring.less, self.ring.minor)

    def _rays_to(self, j: int) -> int:
        """Return the slopes on either side of 0 that tiles of column j lie on."""
        return min(self.rays.half, int((self._most(j) + 2) / ((j - 1) * self.rays.pace)) + 1)

    def _tiles(self, group: range) -> np.ndarray:
        """Return the means of the tiles of some columns, one column after the other, (tile, band).

        They are one sparse product: to set up one for every column would take longer than it takes
        itself.
        """
        changes = []
        weights = []
        ends = []
        total = 0
        for j in group:
            reach = self._rays_to(j)
            i = np.arange(-self._most(j), self._most(j) + 1)
            cut = slice(self.rays.half - reach, self.rays.half + reach + 1)
            places = []
            for inside, weight in zip(self.inside, self.weights):
                x = j + inside
                changes.append(self._changes(x, cut, weight))
                at = i / (x * self.rays.pace) + reach
                half = self.narrow / (x * self.rays.pace)
                lean = self.lean * np.abs(i) / (j * x * self.rays.pace)
                ray, share = _triangles(at, half, 2 * reach + 1, lean)
                places.append((ray + total, share))
                total += 2 * reach + 1
            taps = [np.concatenate(part, axis=1) for part in zip(*places)]
            weights.append(taps)
            ends.append(np.full(len(i), taps[0].shape[1], np.int32))
        ray, share = (np.concatenate([w[k].ravel() for w in weights]) for k in (0, 1))
        ends = np.concatenate([[0], np.cumsum(np.concatenate(ends))]).astype(np.int32)
        return csr_array((share, ray, ends), (len(ends) - 1, total)) @ np.concatenate(changes)

    def _changes(self, x: float, cut: slice, weight: float) -> np.ndarray:
        """Return the (ray, band) means along rays at place `x`, times `weight`, of all patterns
        together; reads lie on lines between rows of the sums.
        """
        per_tile = self.sector.pitch_um[0] / self.sector.step_um
        at = x * self.u * per_tile + 0.5 - self.rays.first
        index = at.astype(np.intp)
        part = (at - index).astype(np.float32)[:, None]
        scale = self.factor * (weight / x)
        total = np.float32(0.0)
        for sums, share in self.sums:
            line = sums[index, cut]
            more = sums[index + 1, cut]
            more -= line
            more *= part
            line += more
            means = line[self.where[:, 0]]
            means -= line[self.where[:, 1]]
            own = scale if share is None else scale * share
            means *= own.astype(np.float32)[:, None]
            total = total + means if len(self.sums) > 1 else means
        return np.ascontiguousarray(total.T)


def _triangle_rule(places: int) -> tuple[np.ndarray, np.ndarray]:
    """Return places within a triangle of half width 1 and their weights: sum 1 and, from two on,
    the triangle's variance of 1/6.
    """
    inside = (np.arange(places) + 0.5) / places * 2 - 1
    weights = (1 - np.abs(inside)) / (1 - np.abs(inside)).sum()
    if places > 1:
        inside *= np.sqrt(1 / 6 / (weights @ inside**2))
    return inside, weights


def _triangles(
    at: np.ndarray, half: float, size: int, lean: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return rays and weights (place, tap) of triangles of `half` width `lean` to both sides of
    every place; weights sum to 1.
    """
    half = max(half, 1.0)  # never narrower than from one ray to the next
    wide = half + float(np.max(lean))
    taps = int(2 * wide) + 1
    first = np.clip(np.ceil(at - wide), 0, max(0, size - taps))
    distance = first[:, None] + np.arange(taps) - at[:, None]
    if wide > half:
        distance = np.abs(distance)  # symmetric
        lean = lean[:, None]
        weight = np.maximum(0.0, half - np.abs(distance - lean)) + np.maximum(
            0.0, half - distance - lean
        )
    else:
        weight = np.maximum(0.0, half - np.abs(distance))
    weight /= weight.sum(axis=1, keepdims=True)
    ray = first.astype(np.int32)[:, None] + np.arange(taps, dtype=np.int32)
    return ray, weight.astype(np.float32)


def sectors(
    pattern: HalfPattern,
    pitch_um: tuple[float, float],
    edges_nm: np.ndarray,
    sharpened: bool = False,
    other: np.ndarray | None = None,
    share: np.ndarray | None = None,
) -> Iterator[Sector]:
    """Yield the sectors |y| <= x and |x| < y of a `half_plane_pattern.HalfPattern`.

    Parameters
    ----------
    pattern : the `HalfPattern` of the half plane x >= 0.
    pitch_um : (y, x) sides of a tile, um.
    edges_nm : (band, 2) borders of the bands, nm.
    sharpened : whether the samples are sharpened for the interpolation between them, as in
        `Sector`.
    share : (band,) weight of the pattern in each band; None: 1.
    other : density of the half plane x <= 0, turned by 180 degrees about the axis; None: the same,
        as that of a pupil without phase is.
    """
    middle = pattern.middle
    density = pattern.density
    other = density if other is None else other
    wide = min(len(density) - 1, int(1.1 * middle) + 8)  # |x| < y, and a little beyond

    def columns(first: int, last: int) -> np.ndarray:
        return density[first:last]

    def rows(first: int, last: int) -> np.ndarray:
        right = density[: wide + 1, middle + first : middle + last].T
        left = other[1 : wide + 1, middle - last + 1 : middle - first + 1].T[::-1, ::-1]
        return np.concatenate([left, right], axis=1)

    edges = np.asarray(edges_nm, float)
    for lines, zero, pitch in ((columns, middle, pitch_um[::-1]), (rows, wide, pitch_um)):
        common = lines, zero, pattern.step_um, tuple(pitch), pattern.wavelength_nm, edges
        yield Sector(*common, sharpened, share)

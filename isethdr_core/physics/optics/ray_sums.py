"""Ray sums: band means of a pattern that scales with the wavelength, from running sums along rays.

P is the pattern at the wavelength w0, and u = w0 / w for another wavelength w. At the point (s, t
s) of the ray with slope t, the density is u^2 P(u s, t u s). Its mean over a band from a to b is

    w0 / ((b - a) s)  x  integral of P(r, t r) dr from r = s w0 / b to s w0 / a.

One running sum along a ray therefore serves bands of any width: each border of a band is one read.
A tile's width across the ray is an interval of slopes, which is the same for all wavelengths, so
that one sparse matrix serves all bands.

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

# largest radius of a ring's tiles over the smallest. It is limited because all tiles of a ring
# share rays, and because running sums lose digits with their length.
RATIO = 1.4
LINES = 64  # number of lines of the lattice per block of work
TOGETHER = 30000  # number of rays that are averaged over tiles at once: some megabytes
# Weights of second differences that correct samples: along a ray for running sums (steps), across
# it for linear interpolation.
ALONG = 1 / 24
ACROSS = 1 / 12
TILES = 16  # number of tiles along the major axis per block of work: a cache line of float32


@dataclass(frozen=True, eq=False)
class Sector:
    """The quarter plane |minor| <= major about one axis: lattice and tiles. Pairs are (major,
    minor).
    """

    lines: Callable[[int, int], np.ndarray]  # (first, last) -> samples (major, minor), float32
    middle: int  # index of minor 0 in a line
    step_um: float  # distance between samples
    pitch_um: tuple[float, float]  # pitch of the tiles
    wavelength_nm: float  # wavelength of the pattern
    edges_nm: np.ndarray  # (band, 2) ends of the bands
    # whether samples are sharpened first, because interpolation between them blurs fine detail
    sharpened: bool = False
    share: np.ndarray | None = None  # (band,) weight of this pattern in each band's; None: 1


class Ring(NamedTuple):
    """Tiles of a ring: low < major <= high, |minor| <= min(major - less, minor)."""

    low: int
    high: int
    minor: int  # largest minor coordinate
    less: int  # 1: without the diagonals; 0: with them


class Columns(NamedTuple):
    """Means of a block of tiles along the major axis."""

    first: int  # major coordinate of the first tiles
    values: np.ndarray  # (band, major, minor); valid for |minor| up to the major coordinate


def rings(low: int, high: int) -> list[tuple[int, int]]:
    """Return (low, high) of the rings from `low` to `high`, the innermost first. The tiles of each
    ring share their rays.
    """
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
    sectors : sectors of the patterns of which the weighted sum is the pattern of a band; they
        differ only in samples and `share`.
    ring : tiles to compute.
    rays_per_tile : number of rays per tile at the outermost tiles of the ring; tiles farther in
        have more.
    places : number of positions along the major axis at which the triangle, the convolution of two
        tiles, is sampled.
    write : function that takes blocks of results.
    apply : `map`, or the `map` of a pool of threads.
    """
    rays = _rays(sectors[0], ring, rays_per_tile)
    sums = [_running_sums(sector, rays, apply) for sector in sectors]
    reader = _Reader(sectors, ring, rays, sums, places)
    starts = range(ring.low + 1, ring.high + 1, TILES)
    for _ in apply(lambda j: write(reader.columns(j, min(j + TILES, ring.high + 1))), starts):
        pass


class Work(NamedTuple):
    """Numbers of operations of `band_means` for one ring; they do not depend on the bands."""

    sums: float  # values of running sums
    reads: float  # rays x positions of all columns, which are read at every border of a band
    taps: float  # weights of rays in tiles, which are used for every band


def work(sector: Sector, ring: Ring, rays_per_tile: float, places: int) -> Work:
    """Return the numbers of operations of `band_means` for a ring.

    Parameters
    ----------
    sector : sector of the ring; its samples are not read.
    ring, rays_per_tile, places : as in `band_means`.
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
    pace: float  # difference of neighbouring slopes, minor tiles per major tile
    half: int  # number of slopes on either side of 0
    first: int  # first line of the lattice in the sums
    last: int  # line of the lattice after the last one in the sums


def _rays(sector: Sector, ring: Ring, rays_per_tile: float) -> _Rays:
    pace = 1 / (rays_per_tile * ring.high)
    widest = min(1.0, ring.minor / (ring.low + 1)) + 2.5 / max(ring.low, 1)
    u = sector.wavelength_nm / sector.edges_nm
    per_tile = sector.pitch_um[0] / sector.step_um
    first = max(0, int((ring.low - 1) * u.min() * per_tile) - 1)
    last = int(np.ceil((ring.high + 1.2) * u.max() * per_tile)) + 2
    return _Rays(pace, int(np.ceil(widest / pace)), first, last)


def _running_sums(sector: Sector, rays: _Rays, apply: Callable[..., Any]) -> np.ndarray:
    """Return sums[k, ray] over the lines first .. first + k - 1 of the pattern on a ray. In each
    line it is interpolated linearly between two samples.
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
    width = 256  # number of rays that are summed at a time: rows of 1 kB
    for _ in apply(gather, range(0, sums.shape[1], width)):
        pass
    return sums


def _lines(sector: Sector, first: int, last: int) -> np.ndarray:
    """Return lines first .. last - 1 of a sector, sharpened if the sector states so.

    h is the distance of samples. Reading a running sum between its rows multiplies a frequency f
    along the ray by sinc(f h), as if the pattern consisted of steps. Linear interpolation within a
    line multiplies a frequency across the ray by sinc(f h)^2. Second differences correct both, with
    an error of the fourth power of f h.
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
        # factor from a sum over lines to the light on a tile at major 1, minor 0
        self.factor = sector.pitch_um[1] * sector.step_um * sector.wavelength_nm
        self.factor = self.factor / (edges[:, 1] - edges[:, 0])
        self.inside, self.weights = _triangle_rule(places)
        # With one position, only the band's width averages along the ray. On a slanted ray, the
        # length of the tile also widens it across the ray. Two triangles represent this; their
        # distance follows from the width of the tile's triangle along the major axis.
        self.lean = np.sqrt(1 / 6) if places == 1 else 0.0
        # Linear interpolation between samples widens the triangle across the rays. The triangle is
        # narrower by this amount, computed for a middle wavelength.
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
        """Return the number of slopes on either side of 0 that the tiles of column j need."""
        return min(self.rays.half, int((self._most(j) + 2) / ((j - 1) * self.rays.pace)) + 1)

    def _tiles(self, group: range) -> np.ndarray:
        """Return the means of the tiles of some columns, one column after the other, (tile, band).

        All columns are one sparse product. To set up one for every column would take longer than
        the product itself.
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
        """Return the (ray, band) means along rays at the position `x`, times `weight`, of all
        patterns together. Sums are interpolated linearly between their rows.
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
    """Return positions within a triangle of half width 1, and their weights. The weights sum to 1;
    two or more positions also have the triangle's variance of 1/6.
    """
    inside = (np.arange(places) + 0.5) / places * 2 - 1
    weights = (1 - np.abs(inside)) / (1 - np.abs(inside)).sum()
    if places > 1:
        inside *= np.sqrt(1 / 6 / (weights @ inside**2))
    return inside, weights


def _triangles(
    at: np.ndarray, half: float, size: int, lean: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rays (position, tap), and their weights, of two triangles per position. The
    weights of a position sum to 1.

    Parameters
    ----------
    at : (position,) positions, in rays.
    half : half width of a triangle, rays.
    size : number of rays.
    lean : (position,) distance of both triangles from the position, rays.
    """
    half = max(half, 1.0)  # at least the distance of neighbouring rays
    wide = half + float(np.max(lean))
    taps = int(2 * wide) + 1
    first = np.clip(np.ceil(at - wide), 0, max(0, size - taps))
    distance = first[:, None] + np.arange(taps) - at[:, None]
    if wide > half:
        distance = np.abs(distance)  # both triangles together are symmetric
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
    other : density of the half plane x <= 0, rotated by 180 degrees about the axis; None: the same
        as that of x >= 0, as for a pupil without phase.
    share : (band,) weight of the pattern in each band; None: 1.
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

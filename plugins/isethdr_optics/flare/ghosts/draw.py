"""Drawing of ghosts: light sources are found in the scene, and the light of their ghost rays is
added on grids of suitable fineness. The energy is conserved.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .trace import Beam

FINE_BINS = 96  # number of bins of direction across the longer side, in which lamps are found
BLOCKS = 5  # number of blocks across the longer side, in which all other light is summed
BRIGHT = 4.0  # least light of a bin that counts as a lamp, over the mean of all bins
MOST_LAMPS = 64  # largest number of lamps
POINTS = 48  # number of light points across a beam
CELLS = 32  # largest number of cells across a ghost; wider ghosts are drawn on coarser grids


@dataclass(frozen=True, eq=False)
class Source:
    """Parallel light from a small rectangle of directions."""

    x: float  # middle of the rectangle, tangents
    y: float  # middle of the rectangle, tangents
    half_x: float  # half width of the rectangle along x, tangents
    half_y: float  # half width of the rectangle along y, tangents
    power: np.ndarray  # (band,) W m-2 nm-1 through a plane perpendicular to the axis


def sources(
    power: np.ndarray, x: np.ndarray, y: np.ndarray, pitch: Sequence[float]
) -> tuple[list[Source], float]:
    """Return light sources of an image, and the share of the light that is summed in blocks.

    Each bright bin becomes a source, at the centroid of its light and as wide as its light. The
    rest of the light is summed in blocks, and is uniform over each block.

    Parameters
    ----------
    power : (band, y, x) W m-2 nm-1 per tile through a plane perpendicular to the axis: radiance x
        solid angle x cosine.
    x, y : (x,) and (y,) tile centres, tangents.
    pitch : (y, x) pitch of the tiles, tangents.
    """
    total = power.sum(axis=0)
    total_power = float(total.sum())
    if total_power <= 0:
        return [], 0.0
    bins = [
        _bin_of(len(c), max(1, round(len(c) / FINE_BINS * (len(c) / max(len(x), len(y))))))
        for c in (y, x)
    ]
    count = [b[-1] + 1 for b in bins]
    flat = bins[0][:, None] * count[1] + bins[1]
    light = np.bincount(flat.ravel(), total.ravel(), count[0] * count[1])
    bright = np.flatnonzero(light > BRIGHT * total_power / light.size)
    bright = bright[np.argsort(light[bright], kind="stable")[::-1][:MOST_LAMPS]]
    point_sources = []
    remaining = power.astype(float)
    for index in bright:
        rows, cols = (
            np.flatnonzero(b == k) for b, k in zip(bins, divmod(int(index), int(count[1])))
        )
        window = np.ix_(np.arange(len(power)), rows, cols)
        point_sources.append(_source(remaining[window], x[cols], y[rows], pitch))
        remaining[window] = 0
    step = max(1, int(np.ceil(max(len(x), len(y)) / BLOCKS)))
    for top in range(0, len(y), step):
        for first_column in range(0, len(x), step):
            part = remaining[:, top : top + step, first_column : first_column + step]
            if part.any():
                ys = y[top : top + step]
                xs = x[first_column : first_column + step]
                point_sources.append(
                    Source(
                        (xs[0] + xs[-1]) / 2,
                        (ys[0] + ys[-1]) / 2,
                        len(xs) * pitch[1] / 2,
                        len(ys) * pitch[0] / 2,
                        part.sum(axis=(1, 2)),
                    )
                )
    return point_sources, float(remaining.sum() / power.sum())


def _bin_of(tiles: int, per_bin: int) -> np.ndarray:
    return np.arange(tiles) // per_bin


def _source(light: np.ndarray, x: np.ndarray, y: np.ndarray, pitch: Sequence[float]) -> Source:
    total = light.sum(axis=0)
    along_x = total.sum(axis=0) / total.sum()
    along_y = total.sum(axis=1) / total.sum()
    cx = float(along_x @ x)
    cy = float(along_y @ y)
    # a rectangle of the same variance; the light of each tile is uniform (pitch^2 / 12)
    half = [
        np.sqrt(3 * (float(w @ (c - m) ** 2) + p**2 / 12))
        for w, c, m, p in ((along_x, x, cx, pitch[1]), (along_y, y, cy, pitch[0]))
    ]
    return Source(cx, cy, *half, light.sum(axis=(1, 2)))


class Canvas:
    """Flux on the tiles of a sensor, summed on grids that are 1, 2, 4, ... times coarser. The grids
    have a border for light that falls just outside.
    """

    def __init__(
        self, bands: int, x_mm: np.ndarray, y_mm: np.ndarray, pitch_mm: Sequence[float]
    ) -> None:
        self.bands = bands
        self.shape = (len(y_mm), len(x_mm))
        self.pitch = pitch_mm  # (y, x)
        self.corner = (y_mm[0] - pitch_mm[0] / 2, x_mm[0] - pitch_mm[1] / 2)
        self.grids: dict[int, np.ndarray] = {}
        self.outside = np.zeros(bands)

    def _grid(self, level: int) -> np.ndarray:
        if level not in self.grids:
            size = [-(-n // 2**level) + 4 for n in self.shape]
            self.grids[level] = np.zeros((self.bands, *size))
        return self.grids[level]

    def draw(
        self, x_mm: np.ndarray, y_mm: np.ndarray, flux: np.ndarray, blur_mm: float = 0.0
    ) -> None:
        """Add points (band, n) of `flux`, each shared linearly by the four nearest cells.

        A source with the half width `blur_mm` in the ghost is drawn on cells of that size. Sharing
        and interpolation together then spread a point with the variance of the source.

        Parameters
        ----------
        x_mm : (band, n) positions on the sensor along x, mm.
        y_mm : (band, n) positions on the sensor along y, mm.
        flux : (band, n) light of every point; points without light are left out.
        blur_mm : half width of the source in the ghost, mm.
        """
        lit = flux > 0
        if not lit.any():
            return
        extent = max(np.ptp(x_mm[lit]) / self.pitch[1], np.ptp(y_mm[lit]) / self.pitch[0])
        subdivisions = max(
            np.ceil(np.log2(max(extent / CELLS, 1.0))),
            np.rint(np.log2(max(blur_mm / min(self.pitch), 1.0))),
        )
        level = int(np.clip(subdivisions, 0, np.ceil(np.log2(max(self.shape)))))
        grid = self._grid(level)
        size = 2.0**level
        # Cell centres lie at integers. Two cells lie outside the sensor, so that the inner of them
        # gets light from both sides.
        u = (x_mm - self.corner[1]) / (self.pitch[1] * size) + 1.5
        v = (y_mm - self.corner[0]) / (self.pitch[0] * size) + 1.5
        iu = np.floor(u).astype(int)
        iv = np.floor(v).astype(int)
        inside = lit & (iu >= 0) & (iv >= 0) & (iu < grid.shape[2] - 1) & (iv < grid.shape[1] - 1)
        self.outside += np.where(inside, 0.0, flux).sum(axis=1)
        if not inside.any():
            return
        low_u = iu[inside].min()
        low_v = iv[inside].min()
        width = iu[inside].max() - low_u + 2
        height = iv[inside].max() - low_v + 2
        fu = u - iu
        fv = v - iv
        part = np.where(inside, flux, 0.0)
        at = (
            np.arange(self.bands)[:, None] * height + np.where(inside, iv - low_v, 0)
        ) * width + np.where(inside, iu - low_u, 0)
        window = np.zeros(self.bands * height * width)
        for dv, wv in ((0, 1 - fv), (1, fv)):
            for du, wu in ((0, 1 - fu), (1, fu)):
                window += np.bincount(
                    (at + dv * width + du).ravel(), (part * wu * wv).ravel(), window.size
                )
        grid[:, low_v : low_v + height, low_u : low_u + width] += window.reshape(
            self.bands, height, width
        )

    def irradiance(self) -> np.ndarray:
        """Return flux per mm2, (band, y, x); coarser grids are interpolated linearly."""
        out = np.zeros((self.bands, *self.shape))
        for level, grid in self.grids.items():
            rows, cols = (
                _interpolation(n, m, 2**level) for n, m in zip(self.shape, grid.shape[1:])
            )
            out += rows @ grid @ cols.T / (4.0**level * self.pitch[0] * self.pitch[1])
        return out


def _interpolation(fine: int, coarse: int, size: int) -> np.ndarray:
    """Return the (fine, coarse) matrix of linear interpolation. The centre of coarse cell k is at
    size (k - 3/2) - 1/2 fine cells.
    """
    at = (np.arange(fine) + 0.5) / size + 1.5
    low = np.clip(np.floor(at).astype(int), 0, coarse - 2)
    out = np.zeros((fine, coarse))
    out[np.arange(fine), low] = 1 - (at - low)
    out[np.arange(fine), low + 1] += at - low
    return out


@dataclass(frozen=True)
class Iris:
    """A regular polygon inside the stop, with its corners on the stop's border."""

    blades: int  # number of sides
    rotation_deg: float  # direction of the first corner, from x towards y
    radius_mm: float  # radius of the stop

    def margin(self, x_mm: np.ndarray, y_mm: np.ndarray) -> np.ndarray:
        """Return the distance of points of the stop from the nearest blade, in apothems; it is
        negative for points that the iris blocks.
        """
        half = np.pi / self.blades
        normals = np.radians(self.rotation_deg) + half * (2 * np.arange(self.blades) + 1)
        farthest = np.max([x_mm * np.cos(a) + y_mm * np.sin(a) for a in normals], axis=0)
        return 1 - farthest / (self.radius_mm * np.cos(half))


def points(
    source: Source,
    low: Beam,
    high: Beam,
    tangents: tuple[float, float],
    limits: tuple[float, float, float, float],
    iris: Iris | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return (x mm, y mm, flux, half width mm) of one ghost of one source: positions and flux of
    points, each (band, n), and the half width of the source in the ghost.

    Parameters
    ----------
    source : source of the ghost: position, size and power.
    low, high : `trace.Beam` at the two field `tangents`. Positions, weights and margins are
        interpolated linearly between them.
    tangents : the two field tangents.
    limits : the box (x, x, y, y) over which both beams were traced, mm.
    iris : blades of the iris; they do not rotate with the direction of the source. The beams must
        then hold their crossings of the stop.
    """
    weave = _interpolation_of_nodes(low.x_mm.shape[-1], POINTS)
    radius = np.hypot(source.x, source.y)
    along, across = (source.x / radius, source.y / radius) if radius > 0 else (1.0, 0.0)
    part = (radius - tangents[0]) / (tangents[1] - tangents[0])

    def woven(first: np.ndarray, last: np.ndarray) -> np.ndarray:
        mixed = first * (1 - part) + last * part
        return (weave @ mixed @ weave.T).reshape(len(mixed), -1)

    def spread(name: str) -> np.ndarray:
        return woven(getattr(low, name), getattr(high, name))

    x, y, weight, margin = (spread(k) for k in ("x_mm", "y_mm", "weight", "margin"))
    if iris is not None:
        for first, last in zip(low.stops, high.stops):
            u, v = (woven(a, b) for a, b in zip(first, last))
            margin = np.minimum(margin, iris.margin(u * along - v * across, u * across + v * along))
    area_m2 = (limits[1] - limits[0]) * (limits[3] - limits[2]) / POINTS**2 * 1e-6
    # the weights of a cell with only valid nodes sum to 1 within 1e-7, the rounding of float32
    through = (spread("valid") > 1 - 1e-6) & (margin > 0)
    flux = np.where(through, np.maximum(weight, 0.0), 0.0) * (source.power[:, None] * area_m2)
    blur = np.hypot(source.half_x, source.half_y) / np.sqrt(2) * _scale_mm(low, high, tangents)
    return x * along - y * across, x * across + y * along, flux, blur


def _scale_mm(low: Beam, high: Beam, tangents: tuple[float, float]) -> float:
    """Return the movement of a ghost on the sensor per tangent of its source, mm; the larger of the
    radial and the azimuthal movement.
    """
    both = (low.margin > 0) & (high.margin > 0)
    if not both.any():
        return 0.0
    near_mm = float(low.x_mm[both].mean())
    far_mm = float(high.x_mm[both].mean())
    return max(abs(far_mm - near_mm) / (tangents[1] - tangents[0]), abs(far_mm) / tangents[1])


def _interpolation_of_nodes(nodes: int, count: int) -> np.ndarray:
    at = (np.arange(count) + 0.5) / count * (nodes - 1)
    low = np.minimum(at.astype(int), nodes - 2)
    out = np.zeros((count, nodes))
    out[np.arange(count), low] = 1 - (at - low)
    out[np.arange(count), low + 1] = at - low
    return out

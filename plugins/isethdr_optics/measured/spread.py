"""Light spread by tabulated point spread functions, which vary over the field.

A sample of a point spread is light at a point. A kernel is the light that arrives on each tile, as
a mean over the source tile. The light of a sample is therefore shared by the four tiles around it,
in proportion to the overlap of two tiles. This conserves the light, and rotations about the axis
are exact.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from isethdr_core.physics.convolution import convolve

from ..field.grid import Place, weight
from .table import MeasuredTable

AROUND = 16  # number of field points on a ring; one is enough if the point spreads are round
# largest share of the light by which a round point spread may change when it is rotated
ROUND = 1e-6
FINER = 4  # least number of samples per tile; coarser samples are divided
AT_ONCE = 100_000  # number of parts of samples that are shared among tiles in one sum


class Share(NamedTuple):
    """The share of the light that one field point gets."""

    ring: int
    azimuth_rad: float  # counter-clockwise from +x, y up
    window: tuple[slice, slice]  # (y, x) tiles that have a share
    weights: np.ndarray  # (y, x) shares of the tiles in the window, 0 to 1


def shares(table: MeasuredTable, radii: np.ndarray, x: np.ndarray, y: np.ndarray) -> list[Share]:
    """Return the field points among which the light of tiles is shared; the weights of a tile sum
    to 1.

    Parameters
    ----------
    table : measured point spread functions over the field.
    radii : (field,) radii on the sensor of the table's field angles, in the unit of x and y.
    x, y : (x,) and (y,) tile centres.
    """
    around = 1 if is_round(table) else AROUND
    shares_of_rings = []
    for ring, radius in enumerate(radii):
        inside = radius - radii[ring - 1] if ring else np.inf
        outside = radii[ring + 1] - radius if ring + 1 < len(radii) else np.inf
        count = around if ring else 1
        for k in range(count):
            azimuth = 2 * np.pi * k / count
            place = Place(ring, float(radius), azimuth, count)
            values = weight(place, (inside, outside), x, y)
            lit = values > 0
            rows, columns = (np.flatnonzero(lit.any(axis)) for axis in (1, 0))
            if len(rows):
                window = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
                shares_of_rings.append(Share(ring, azimuth, window, values[window]))
    return shares_of_rings


@lru_cache(maxsize=8)
def is_round(table: MeasuredTable) -> bool:
    """Return whether no point spread changes when it is rotated by 90 degrees."""
    size = table.psf.shape[-1]
    if table.psf.shape[-2] != size or size % 2 == 0:
        return False
    turned = np.rot90(table.psf, axes=(2, 3))
    return float(np.abs(turned - table.psf).sum((2, 3)).max()) <= ROUND


def around(table: MeasuredTable, wavelength_nm: float) -> list[tuple[int, float]]:
    """Return [(index of a wavelength of the table, share), ...] on either side of a wavelength.

    Beyond the table the nearest wavelength is used.
    """
    at = np.interp(wavelength_nm, table.wavelength_nm, np.arange(len(table.wavelength_nm)))
    low = int(at)
    part = float(at - low)
    return [(k, s) for k, s in ((low, 1 - part), (low + 1, part)) if s > 0]


def kernel(
    psf: np.ndarray, pitch_um: float, tile_um: tuple[float, float], azimuth: float
) -> np.ndarray:
    """Return the kernel (y, x) on tiles of a point spread that is rotated by an azimuth.

    Parameters
    ----------
    psf : point spread (y, x), its axis at index size // 2.
    pitch_um : distance of its samples, um.
    tile_um : (y, x) size of a tile, um.
    azimuth : azimuth, rad, counter-clockwise with y up.
    """
    parts = max(1, int(np.ceil(FINER * pitch_um / min(tile_um))))
    offsets = pitch_um * ((np.arange(parts) + 0.5) / parts - 0.5)
    rows, columns = np.nonzero(psf)
    values = psf[rows, columns] / parts**2
    y0 = pitch_um * (rows - psf.shape[0] // 2)
    x0 = pitch_um * (columns - psf.shape[1] // 2)
    cosine = np.cos(azimuth)
    sine = np.sin(azimuth)
    reach = pitch_um * (max(psf.shape) / 2 + 1) * np.sqrt(2)
    half = [int(np.ceil(reach / tile)) + 1 for tile in tile_um]
    shape = (2 * half[0] + 1, 2 * half[1] + 1)
    out = np.zeros(shape[0] * shape[1])
    # many offsets are summed at once, because every sum passes over all tiles of the kernel
    pieces = -(-parts * len(values) // AT_ONCE)
    for dy in offsets:
        for dx in np.array_split(offsets[:, None], min(parts, max(1, pieces))):
            # y points down: a rotation from +x upwards lowers y
            x = cosine * (x0 + dx) + sine * (y0 + dy)
            y = -sine * (x0 + dx) + cosine * (y0 + dy)
            for index, share in _corners(y / tile_um[0] + half[0], x / tile_um[1] + half[1], shape):
                out += np.bincount(index.ravel(), (values * share).ravel(), len(out))
    return out.reshape(shape)


def _corners(
    y: np.ndarray, x: np.ndarray, shape: tuple[int, int]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    row = np.floor(y).astype(np.intp)
    column = np.floor(x).astype(np.intp)
    down = y - row
    across = x - column
    for j, part_y in ((0, 1 - down), (1, down)):
        for k, part_x in ((0, 1 - across), (1, across)):
            yield (row + j) * shape[1] + column + k, part_y * part_x


def on_samples(psf: np.ndarray, pitch_um: float, sample_um: float, size: int) -> np.ndarray:
    """Return the share of a point's light on each sample (y, x) of a square grid.

    The light of a sample of the point spread is taken as uniform over the sample's square.

    Parameters
    ----------
    psf : point spread (y, x), its axis at index size // 2.
    pitch_um : distance of its samples, um.
    sample_um : distance of the samples of the grid, um.
    size : number of samples of the grid along each axis; the axis is at index size // 2.
    """
    borders = sample_um * (np.arange(size + 1) - size // 2 - 0.5)
    down, across = (_overlaps(n, pitch_um, borders) for n in psf.shape)
    return down @ psf @ across.T


def _overlaps(count: int, pitch_um: float, borders_um: np.ndarray) -> np.ndarray:
    """Return the share (interval, sample) of each sample of a point spread in each interval.

    Parameters
    ----------
    count : number of samples, their axis at index count // 2.
    pitch_um : distance of the samples, um.
    borders_um : (interval + 1,) borders of the intervals, um from the axis.
    """
    own_um = pitch_um * (np.arange(count + 1) - count // 2 - 0.5)
    low_um = np.maximum(borders_um[:-1, None], own_um[:-1])
    high_um = np.minimum(borders_um[1:, None], own_um[1:])
    return np.maximum(high_um - low_um, 0.0) / pitch_um


def spread(light: np.ndarray, places: list[tuple[Share, np.ndarray]]) -> np.ndarray:
    """Return one band's light (y, x), float64, spread by the kernels of field points.

    Parameters
    ----------
    light : (y, x) light of one band.
    places : [(share of the light, kernel (y, x)), ...] of the field points.
    """
    out = np.zeros(light.shape)
    for share, of_place in places:
        part = share.weights * light[share.window]
        if not part.any():
            continue
        half = [n // 2 for n in of_place.shape]
        wide = [
            (max(w.start - h, 0), min(w.stop + h, n))
            for w, h, n in zip(share.window, half, light.shape)
        ]
        more = [(w.start - a, b - w.stop) for w, (a, b) in zip(share.window, wide)]
        window = tuple(slice(a, b) for a, b in wide)
        out[window] += convolve(np.pad(part, more), of_place)
    return out

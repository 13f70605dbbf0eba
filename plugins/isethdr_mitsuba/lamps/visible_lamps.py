"""Lamps that the camera sees directly, with exact areas on the tiles, even if a lamp is far smaller
than a tile.

A random path hits a lamp that fills a thousandth of a tile once in a thousand samples, which would
make the light noisy. Here every emitting triangle is cut along the borders of the tiles, with exact
areas. Rays to points on each piece determine its visible part.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from ..world.triangle_chords import straightened
from .placed_lamps import SPECTRUM_NM, emission_table

if TYPE_CHECKING:
    from isethdr_core.data.fog import Fog

    from ..world.geometry import World
    from ..world.view import View
    from .placed_lamps import PlacedLamp

POINTS = 64  # number of rays to each piece of a lamp on a tile
NEAR_M = 1e-3  # depth in front of the pinhole below which lamps are not seen
CHUNK = 20_000  # approximate number of pieces handled at a time; limits memory
# Largest deviation of a curved side from its chord on a grid of angles, as a share of the size of
# the lamp or of the tile, whichever is smaller
OFF = 5e-4


class Bands(NamedTuple):
    """The bands of a picture."""

    centres_nm: np.ndarray  # (band,)
    step_nm: float  # width of a band


def visible_lamps(
    world: World,
    view: View,
    lamps: Sequence[Any],
    groups: Sequence[str],
    bands: Bands,
    fog: Fog | None = None,
) -> tuple[np.ndarray, float]:
    """Return the direct light of lamps on the tiles, and its largest error.

    Parameters
    ----------
    world : scene with the objects that hide lamps.
    view : tiles of the frame.
    lamps : placed lamps.
    groups : names of the light groups, in the order of the result.
    bands : centres and widths of the bands, nm.
    fog : fog between lamps and camera; None in clear air.

    Returns
    -------
    layer : (group, wavelength, row, column) float64, W m-2 sr-1 nm-1, to be added to the radiance
        found by paths.
    error : the largest error of a piece, relative to its light: 1 / POINTS if a piece is partly
        hidden; if not, 4 x OFF on a grid of angles, where sides are arcs, and 0 on a grid of
        tangents. It is 0 if no lamp faces the camera.
    """
    spectra = list(dict.fromkeys(p.lamp.spectrum for p in lamps))
    bands_nm = bands.centres_nm
    emitted = band_means(emission_table(spectra), bands_nm, bands.step_nm)
    tiles = view.shape[0] * view.shape[1]
    level = {}  # (group, spectrum) -> luminance (tile, 1), or (tile, band) in fog
    one = np.ones((1, 1))
    of_arcs = 0.0 if view.projection == "tangent" else 4 * OFF
    error = 0.0
    for lot in _lots(lamps, groups, view):
        error = max(error, of_arcs)
        for key, tile, value, away_m, visible_share in _luminances(world, view, lamps, lot):
            where = groups.index(key.group), spectra.index(key.spectrum)
            each = value / (view.pitch_x * view.pitch_y)
            left = one if fog is None else fog.transmission(away_m[:, None], bands_nm)
            total = level.setdefault(where, np.zeros((tiles, left.shape[-1])))
            np.add.at(total, tile, each[:, None] * left)
            if np.any((visible_share > 0) & (visible_share < 1)):
                error = max(error, 1 / POINTS)
    layer = np.zeros((len(groups), len(bands_nm), tiles))
    for (g, s), luminance in level.items():
        used = np.flatnonzero(luminance.any(1))
        layer[g][:, used] += emitted[s][:, None] * luminance[used].T
    return layer.reshape(len(groups), len(bands_nm), *view.shape), error


def _lots(lamps: Sequence[Any], groups: Sequence[str], view: View) -> Iterator[Any]:
    """Yield lists of (number of a lamp, tiles, pieces on the grid, normals, corners). Each list has
    about `CHUNK` pieces in total, so that one launch of rays serves many lamps.
    """
    lot = []
    count = 0
    for index, placed in enumerate(lamps):
        if placed.lamp.group not in groups or placed.peak_cd_m2 == 0:
            continue
        pieces, tile, normal, corner = _pieces(placed, view)
        for start in range(0, len(tile), CHUNK):
            part = slice(start, start + CHUNK)
            lot.append((index, tile[part], pieces[part], normal[part], corner[part]))
            count += len(tile[part])
            if count >= CHUNK:
                yield lot
                lot = []
                count = 0
    if lot:
        yield lot


def band_means(table: np.ndarray, bands_nm: np.ndarray, step_nm: float) -> np.ndarray:
    """Return (spectrum, band) means of tabulated spectra over bands of width `step_nm`, by the
    trapezoidal rule, which is exact for linear spectra.

    Parameters
    ----------
    table : (spectrum, SPECTRUM_NM) values.
    bands_nm : (band,) centres, nm.
    step_nm : width of the bands, nm.
    """
    inside = np.linspace(-0.5, 0.5, 401) * step_nm
    nm = np.clip(np.asarray(bands_nm)[:, None] + inside, SPECTRUM_NM[0], SPECTRUM_NM[-1])
    weight = np.r_[0.5, np.ones(399), 0.5] / 400
    return np.array([np.interp(nm, SPECTRUM_NM, row) @ weight for row in table]).reshape(
        len(table), len(bands_nm)
    )


def _pieces(
    placed: PlacedLamp, view: View
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the triangles that emit towards the camera, cut along tile borders: polygons (n, m, 2)
    on the grid, the tile of each, and its normal and one corner of its triangle in camera axes.
    """
    tri = view.to_camera(placed.triangles.reshape(-1, 3)).reshape(-1, 3, 3)
    normal = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    lit = np.einsum("nk,nk->n", normal, tri[:, 0]) < 0  # faces the pinhole, which is at the origin
    tri = tri[lit]
    normal = normal[lit]
    length = np.linalg.norm(normal, axis=1)
    normal = normal / np.maximum(length, 1e-300)[:, None]
    rows, columns = view.shape
    x_edge = np.append(view.x, view.x[-1] + view.pitch_x) - view.pitch_x / 2
    y_edge = np.append(view.y, view.y[-1] + view.pitch_y) - view.pitch_y / 2
    if view.projection == "tangent":
        polygon = cut(tri, np.broadcast_to([0.0, 0, 1], (len(tri), 3)), NEAR_M)
        which = np.arange(len(tri))
    else:
        corners = view.coordinates(tri).reshape(-1, 2)
        size = np.linalg.norm(np.ptp(corners, axis=0)) if len(corners) else 0.0
        polygon, which = straightened(tri, view, OFF * min(size, view.pitch_x, view.pitch_y))
    alive = np.isfinite(polygon[:, 0, 0])
    flat = view.coordinates(polygon[alive])
    which = which[alive]
    polygon = np.concatenate([flat, np.ones((*flat.shape[:2], 1))], -1)  # on the grid from here on
    for axis, (low, high) in enumerate(((x_edge[0], x_edge[-1]), (y_edge[0], y_edge[-1]))):
        polygon = cut(
            cut(polygon, _plane(axis, low, 1, len(polygon))), _plane(axis, high, -1, len(polygon))
        )
    alive = np.isfinite(polygon[:, 0, 0])
    polygon = polygon[alive]
    normal = normal[which][alive]
    corner = tri[which, 0][alive]
    flat = polygon[..., :2]
    # the tiles that the box around each polygon covers
    low = np.floor(
        (flat.min(1) - [x_edge[0], y_edge[0]]) / [view.pitch_x, view.pitch_y] - 1e-9
    ).astype(int)
    high = np.floor(
        (flat.max(1) - [x_edge[0], y_edge[0]]) / [view.pitch_x, view.pitch_y] + 1e-9
    ).astype(int)
    low = np.maximum(low, 0)
    high = np.minimum(high, [columns - 1, rows - 1])
    wide, tall = (high - low + 1).T
    which = np.repeat(np.arange(len(polygon)), wide * tall)
    place = np.arange(len(which)) - np.repeat(np.cumsum(wide * tall) - wide * tall, wide * tall)
    column = low[which, 0] + place % wide[which]
    row = low[which, 1] + place // wide[which]
    piece = polygon[which]
    for axis, edge, at in ((0, x_edge, column), (1, y_edge, row)):
        piece = cut(
            cut(piece, _plane(axis, edge[at], 1, len(at))), _plane(axis, edge[at + 1], -1, len(at))
        )
    alive = np.isfinite(piece[:, 0, 0])
    return (
        piece[alive, :, :2],
        (row * columns + column)[alive],
        normal[which][alive],
        corner[which][alive],
    )


def _plane(axis: int, edge: float | np.ndarray, sign: int, count: int) -> np.ndarray:
    """Return planes (count, 3). The product of a plane with (x, y, 1) is `sign` times the
    difference between the coordinate `axis` (0: x, 1: y) and `edge`.
    """
    plane = np.zeros((count, 3))
    plane[:, axis], plane[:, 2] = sign, -sign * np.asarray(edge)
    return plane


def cut(polygon: np.ndarray, plane: np.ndarray, least: float = 0.0) -> np.ndarray:
    """Return the parts of convex polygons with plane . point >= least, as (n, m + 1, 3) corners
    (Sutherland, Hodgman 1974).

    A polygon with fewer corners repeats its last corner. The corners of a polygon with nothing left
    are NaN.

    Parameters
    ----------
    polygon : (n, m, 3) corners in order.
    plane : (n, 3) normal of the cutting plane of each polygon.
    least : distance of the cutting plane from the origin along its normal; the part beyond the
        plane is kept.
    """
    count, corners = polygon.shape[:2]
    height = np.einsum("nmk,nk->nm", polygon, plane) - least
    after = np.roll(polygon, -1, 1)
    height_after = np.roll(height, -1, 1)
    inside = height >= 0
    crosses = (height >= 0) != (height_after >= 0)
    share = np.divide(height, height - height_after, out=np.zeros_like(height), where=crosses)
    meeting = polygon + share[..., None] * (after - polygon)
    # in order: each corner if inside, then the meeting point of its edge if it crosses
    both = np.stack([polygon, meeting], 2).reshape(count, 2 * corners, 3)
    used = np.stack([inside, crosses], 2).reshape(count, 2 * corners)
    order = np.argsort(~used, axis=1, kind="stable")[:, : corners + 1]
    corner_count = np.minimum(used.sum(1), corners + 1)
    last = np.maximum(corner_count - 1, 0)[:, None]
    order = np.take_along_axis(order, np.minimum(np.arange(order.shape[1]), last), 1)
    out = np.take_along_axis(both, order[..., None], 1)
    out[corner_count < 3] = np.nan
    return out


def _luminances(
    world: World, view: View, lamps: Sequence[PlacedLamp], lot: Sequence[tuple[int, ...]]
) -> Iterator[Any]:
    """Yield for each entry of a lot the lamp and arrays over its pieces: tile; area on the grid
    times mean luminance, with hidden parts as 0; mean distance, m; and visible share, 0..1.
    """
    rays = [_rays(view, *entry[2:]) for entry in lot]
    counts = [direction.shape[0] for _, direction, _ in rays]
    indices = np.repeat([entry[0] for entry in lot], counts)
    directions = np.concatenate([direction for _, direction, _ in rays])
    distances = np.concatenate([distance.ravel() for *_, distance in rays])
    visible = np.split(_sees(world, view, directions, distances, indices), np.cumsum(counts)[:-1])
    for (index, tile, *_), (area, direction, distance), sees in zip(
        lot, rays, visible, strict=True
    ):
        placed = lamps[index]
        sees = sees.reshape(distance.shape)
        pattern = placed.relative(-direction).reshape(distance.shape)
        value = area * placed.peak_cd_m2 * (pattern * sees).mean(1)
        yield placed.lamp, tile, value, distance.mean(1), sees.mean(1)


def _rays(
    view: View, flat: np.ndarray, normal: np.ndarray, corner: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the area (n,) of each piece on the grid, and world directions (n * POINTS, 3) and
    distances (n, POINTS), m, of rays from the pinhole to points spread evenly over the piece.
    """
    a = flat[:, 1:-1] - flat[:, :1]
    b = flat[:, 2:] - flat[:, :1]
    areas = np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]) / 2  # fan of triangles
    points = _spread(flat, areas)
    # from the grid back to the plane of the triangle, which every ray meets on the emitting side
    ray = view.rays(points[..., 0], points[..., 1])
    distance = np.einsum("nk,nk->n", normal, corner)[:, None] / np.minimum(
        np.einsum("nk,nmk->nm", normal, ray), -1e-12
    )
    return areas.sum(1), view.to_world(ray.reshape(-1, 3)), distance


def _spread(flat: np.ndarray, areas: np.ndarray) -> np.ndarray:
    """Return (n, POINTS, 2) points spread evenly over polygons. `areas` are those of the triangles
    of the fan of each polygon.
    """
    along = (np.arange(POINTS) + 0.5) / POINTS
    # multiples of the golden section, which together with `along` fill a square evenly
    other = (np.arange(POINTS) * 0.6180339887498949) % 1
    share = np.cumsum(areas, 1)
    total = np.maximum(share[:, -1:], 1e-300)
    share = share / total
    fan = np.minimum((along[None, :, None] > share[:, None, :]).sum(-1), areas.shape[1] - 1)
    below = np.take_along_axis(np.concatenate([np.zeros((len(flat), 1)), share], 1), fan, 1)
    width = np.maximum(np.take_along_axis(areas / total, fan, 1), 1e-300)
    u = np.sqrt(np.clip((along - below) / width, 0, 1))[..., None]
    v = other[None, :, None]
    corner = flat[:, :1]
    second = np.take_along_axis(flat, (fan + 1)[..., None], 1)
    third = np.take_along_axis(flat, (fan + 2)[..., None], 1)
    return corner * (1 - u) + second * u * (1 - v) + third * (u * v)


def _sees(
    world: World, view: View, direction: np.ndarray, distance: np.ndarray, indices: np.ndarray
) -> np.ndarray:
    """Return for each ray from the pinhole whether it reaches the lamp with its number in `indices`
    at `distance`, without meeting another object before.
    """
    shapes = {s.lamp: s.shape for s in world.shapes if s.lamp is not None}
    if dr.is_jit_v(mi.Float):
        numbers = np.zeros(max(shapes) + 1, np.uint32)
        for index in np.unique(indices):
            pointer = mi.ShapePtr(shapes[index])
            numbers[index] = int(dr.reinterpret_array(mi.UInt32, pointer)[0])
        ray = mi.Ray3f(
            mi.Point3f(*(mi.Float(float(v)) for v in view.origin_m)),
            mi.Vector3f(*direction.T.astype(np.float32)),
        )
        hit = world.scene.ray_intersect_preliminary(ray, coherent=True)
        own = dr.reinterpret_array(mi.UInt32, hit.shape) == mi.UInt32(numbers[indices])
        # 1e-4 allows for float32 distances; an object as close as this in front of a lamp, such as
        # its lens or cover, does not hide it
        return np.array(
            own | ~hit.is_valid() | (hit.t > mi.Float(distance.astype(np.float32)) * (1 - 1e-4))
        )
    out = np.empty(len(direction), bool)
    for k, (d, t) in enumerate(zip(direction, distance, strict=True)):
        hit = world.scene.ray_intersect_preliminary(mi.Ray3f(view.origin_m, d))
        mine = shapes[indices[k]]
        out[k] = not hit.is_valid() or hit.shape == mine or hit.t > t * (1 - 1e-4)
    return out

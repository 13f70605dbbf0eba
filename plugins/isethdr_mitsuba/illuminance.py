"""Illuminance that each light group gives the visible surface of each object.

It is the vertical illuminance towards the camera: the reading of a luxmeter that is held upright in
front of the visible surface and faces the camera. It depends only on lamps, sky and shadows, not on
the colour or the slope of the surface. Light reflected by other surfaces is not included.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.data.sky import pattern_at
from isethdr_core.physics.photometry import LM_PER_W, v_lambda
from isethdr_core.scene import Fog, SceneDescription, SkyDome

from .lamps.placed_lamps import SPECTRUM_NM, PlacedLamp, placed_lamps
from .lamps.sky_discs import FAR_M, disc_lamps
from .paths.device_memory import aligned
from .world.geometry import World
from .world.view import View

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Spectrum

POINTS = 32  # largest number of tiles tested for each object
LAMP_POINTS = 4  # number of points tested on each lamp
DIRECTIONS = 64  # number of sky directions tested from each point
CLEAR_M = 1e-3  # distance of a point from its surface, towards the camera
# share of the way to a lamp that must be free; allows for float32 and for the lamp's own lens
NEARLY = 1 - 1e-4
GOLDEN = (5**0.5 - 1) / 2
PLASTIC = 0.7548776662466927, 0.5698402909980532  # steps that fill a square evenly (Roberts 2018)
RAYS = 1 << 20  # number of rays traced at once


@dataclass(frozen=True)
class Points:
    """Points in front of the visible surfaces."""

    instance: np.ndarray  # (point,) number of the object
    place_m: np.ndarray  # (point, 3) position in the world
    facing: np.ndarray  # (point, 3) level unit vectors towards the camera

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.instance)


def illuminances(
    world: World, view: View, description: SceneDescription, labels: dict, normalise: str
) -> dict[int, dict[str, float]]:
    """Return {object number: {light group: illuminance at weight 1, lx}} of all visible objects.

    Parameters
    ----------
    world, view, description : the scene, and the tiles that are labelled.
    labels : `instance` and `distance` (row, column) of these tiles.
    normalise : quantity that a narrower beam keeps, as `MitsubaRenderer.normalise`.

    Notes
    -----
    The result is the mean over up to `POINTS` evenly spread tiles that show the object. For each of
    these points, the light of `LAMP_POINTS` points of every lamp is summed,
    E = L cos cos' dA / r^2, and the sky is averaged over `DIRECTIONS` directions, E = pi mean(L) by
    Malley's method. Blocked rays count as 0. The lamps of the object itself do not count. All light
    groups of the scene are included, rendered or not.
    """
    points = visible_points(view, labels["instance"], labels["distance"])
    if not points.count:
        return {}
    groups = description.light_groups()
    total = {group: np.zeros(points.count) for group in groups}
    for lamp in (*placed_lamps(description, normalise), *disc_lamps(description, "sky" in groups)):
        total[lamp.lamp.group] += from_lamp(world, points, lamp, description.fog)
    if description.sky is not None:
        total["sky"] += from_sky(world, points, description.sky)
    numbers, first, count = np.unique(points.instance, return_index=True, return_counts=True)
    means = {group: np.add.reduceat(values, first) / count for group, values in total.items()}
    return {
        int(number): {group: float(means[group][k]) for group in groups}
        for k, number in enumerate(numbers)
    }


def visible_points(view: View, instance: np.ndarray, distance: np.ndarray) -> Points:
    """Return up to `POINTS` points of each object, in the order of their numbers.

    Parameters
    ----------
    view : tiles of the frame.
    instance, distance : labels (row, column) of the tiles.
    """
    shown = np.flatnonzero(instance)
    order = shown[np.argsort(instance.ravel()[shown], kind="stable")]
    numbers, first, count = np.unique(
        instance.ravel()[order], return_index=True, return_counts=True
    )
    chosen = [
        order[start + np.arange(few) * tiles // few]
        for start, tiles, few in zip(first, count, np.minimum(count, POINTS), strict=True)
    ]
    tile = np.concatenate(chosen) if chosen else np.zeros(0, int)
    row, column = np.divmod(tile, instance.shape[1])
    ray = view.to_world(view.rays(view.x[column], view.y[row]))
    reach = distance.ravel()[tile].astype(float)[:, None] - CLEAR_M
    towards = -ray * [1.0, 1.0, 0.0]
    level = np.linalg.norm(towards, axis=1, keepdims=True)
    # a ray straight up or down has no level part; its reversed direction is used instead
    facing = np.where(level > 1e-6, towards / np.maximum(level, 1e-6), -ray)
    return Points(instance.ravel()[tile], view.origin_m + reach * ray, facing)


def from_lamp(world: World, points: Points, lamp: PlacedLamp, fog: Fog | None = None) -> np.ndarray:
    """Return the illuminance (point,) by one lamp, lx; 0 on the object that the lamp belongs to.

    Fog attenuates the light by its transmission at 550 nm.

    Parameters
    ----------
    world : scene with the objects that cast shadows.
    points : points of objects.
    lamp : the lamp.
    fog : fog between lamp and points; None: clear air.
    """
    lit = np.zeros(points.count)
    if not lamp.peak_cd_m2 > 0:
        return lit
    target, normal = lamp_points(lamp)
    way = target - points.place_m[:, None]
    away = np.maximum(np.linalg.norm(way, axis=-1), CLEAR_M)
    way /= away[..., None]
    cosines = np.einsum("pkc,pc->pk", way, points.facing), -np.einsum("pkc,kc->pk", way, normal)
    value = np.maximum(cosines[0], 0) * np.maximum(cosines[1], 0)
    value[points.instance == lamp.instance] = 0
    at = np.nonzero(value)
    value[at] *= lamp.relative(-way[at]) / away[at] ** 2
    if fog is not None:
        value[at] *= fog.transmission(away[at])
    at = np.nonzero(value)
    value[at] *= reaches(world, points.place_m[at[0]], way[at], away[at] * NEARLY)
    lit[:] = value.sum(1) * lamp.peak_cd_m2 * lamp.area_m2 / len(target)
    return lit


def lamp_points(lamp: PlacedLamp) -> tuple[np.ndarray, np.ndarray]:
    """Return `LAMP_POINTS` points (k, 3) evenly over the area of a lamp, and its normals there."""
    edge = lamp.triangles[:, 1:] - lamp.triangles[:, :1]
    across = np.cross(edge[:, 0], edge[:, 1])
    size = np.linalg.norm(across, axis=1)
    step = (np.arange(LAMP_POINTS) + 0.5) / LAMP_POINTS
    ends = np.cumsum(size) / size.sum()
    which = np.minimum(np.searchsorted(ends, step), len(ends) - 1)
    begin = np.where(which > 0, ends[which - 1], 0.0)
    u = np.sqrt(np.clip((step - begin) / np.maximum(ends[which] - begin, 1e-12), 0, 1))
    v = (np.arange(LAMP_POINTS) * GOLDEN + 0.5) % 1
    inside = np.stack([u * (1 - v), u * v], -1)
    target = lamp.triangles[which, 0] + np.einsum("ke,kec->kc", inside, edge[which])
    return target, across[which] / np.maximum(size[which], 1e-300)[:, None]


def from_sky(world: World, points: Points, sky: SkyDome | Spectrum) -> np.ndarray:
    """Return the illuminance (point,) by the sky without sun and moon, lx.

    Parameters
    ----------
    world : scene with the objects that hide the sky.
    points : points of objects.
    sky : spectrum of a uniform sky, or `SkyDome`.
    """
    number = np.arange(points.count * DIRECTIONS).reshape(-1, DIRECTIONS)
    u, v = ((0.5 + number * step) % 1 for step in PLASTIC)
    # cosine-distributed directions (Malley's method): even over the disc below the hemisphere
    aside = np.sqrt(u) * np.cos(2 * np.pi * v)
    up = np.sqrt(u) * np.sin(2 * np.pi * v)
    left = np.cross(np.eye(3)[np.argmin(np.abs(points.facing), axis=1)], points.facing)
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    over = np.cross(points.facing, left)
    way = (
        aside[..., None] * left[:, None]
        + up[..., None] * over[:, None]
        + np.sqrt(np.maximum(1 - u, 0))[..., None] * points.facing[:, None]
    )
    at = np.repeat(np.arange(points.count), way.shape[1])
    flat = way.reshape(-1, 3)
    clear = reaches(world, points.place_m[at], flat, np.full(len(at), FAR_M / 2))
    shine = np.zeros(len(at))
    shine[clear] = sky_luminance(sky, flat[clear])
    return np.pi * shine.reshape(points.count, -1).mean(1)


def sky_luminance(sky: SkyDome | Spectrum, direction: np.ndarray) -> np.ndarray:
    """Return the luminance, cd/m2, of a sky towards unit vectors (n, 3)."""
    luminance = lambda spectrum: LM_PER_W * float(spectrum.at(SPECTRUM_NM) @ v_lambda(SPECTRUM_NM))
    if not isinstance(sky, SkyDome):
        return np.full(len(direction), luminance(sky))
    parts = (luminance(part.spectrum) * pattern_at(part.pattern, direction) for part in sky.parts)
    return sum(parts, np.zeros(len(direction)))


def reaches(world: World, start_m: np.ndarray, way: np.ndarray, most_m: np.ndarray) -> np.ndarray:
    """Return which rays (n,) meet nothing within their length.

    Parameters
    ----------
    world : scene with the objects that block rays.
    start_m, way : (n, 3) starts, m, and unit vectors.
    most_m : (n,) lengths, m.
    """
    if not dr.is_jit_v(mi.Float):
        rays = (mi.Ray3f(p, d, t, 0.0, mi.Spectrum(0)) for p, d, t in zip(start_m, way, most_m))
        return np.array([not world.scene.ray_test(ray) for ray in rays], bool)
    clear = np.ones(len(most_m), bool)
    numbers = lambda values: mi.Float(aligned(values, np.float32))
    for begin in range(0, len(most_m), RAYS):
        some = slice(begin, begin + RAYS)
        ray = mi.Ray3f(
            mi.Point3f(*map(numbers, start_m[some].T)),
            mi.Vector3f(*map(numbers, way[some].T)),
            numbers(most_m[some]),
            0.0,
            mi.Spectrum(0),
        )
        clear[some] = ~np.array(world.scene.ray_test(ray))
    return clear

"""Preview: scene radiance denoised for viewing, light group by light group. Never part of a stage.

A rendering with few samples is averaged over similar tiles, as in non-local means (Buades, Coll,
Morel 2005). Similarity is judged by the stated noise of the tiles (Rousselle, Knaus, Zwicker 2012).
Only tiles of one object with nearly the same normal and distance are averaged. The result is X, Y
and Z of each light group, which weights may still mix. It is no radiance: lenses, sensors and
stores do not accept it. If few paths carry most of the light, most of it is in few tiles, and the
averaging loses part of it (docs/explanation/accuracy.md).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..data.quantities import check_scene_form
from ..errors import UnitError
from ..physics.photometry import xyz

if TYPE_CHECKING:
    import xarray as xr

REACH = 5  # tiles to each side that are searched for similar ones
PATCH = 3  # side of the surroundings that are compared, tiles
# length of the difference of two unit normals at which a weight has fallen to 1 / e: 6 degrees
NORMAL = 0.1
DISTANCE = 0.1  # relative difference of two distances at which a weight has fallen to 1 / e
# difference in units of the noise's variance that excludes a tile; finite, because differences are
# averaged over surroundings
FAR = 1e6


def tristimulus(scene: xr.Dataset) -> np.ndarray:
    """Return X, Y, Z (light_group, 3, y, x) of scene radiance, cd/m2."""
    check_scene_form(scene)
    return np.stack(
        [
            np.moveaxis(xyz(cube, scene.wavelength.values), -1, 0)
            for cube in scene.radiance.values.astype(float)
        ]
    )


def denoised(scene: xr.Dataset) -> np.ndarray:
    """Return X, Y, Z (light_group, 3, y, x) of scene radiance with less noise, cd/m2; each group by
    itself.

    Raises
    ------
    UnitError : the scene has no `xyz_noise`: it was not rendered, or in a single pass.
    """
    if "xyz_noise" not in scene or not np.isfinite(scene.xyz_noise.values).any():
        raise UnitError(
            "scene radiance has no 'xyz_noise', which denoising needs; expected a rendering of two"
            " passes or more; type samples=8, or denoise=0 to see the rendering with its noise"
        )
    similarity = guides(scene)
    return np.stack(
        [
            averaged(xyz, noise, similarity)
            for xyz, noise in zip(tristimulus(scene), scene.xyz_noise.values.astype(float))
        ]
    )


def guides(scene: xr.Dataset) -> Callable[[Any, Any], np.ndarray | float]:
    """Return a function of two windows of the frame (slices): the weight, 0 to 1, with which their
    labels allow tiles to be averaged.
    """
    lookup = {
        name: scene[name].values for name in ("instance", "normal", "distance") if name in scene
    }

    def similarity(p: Any, q: Any) -> np.ndarray | float:
        weight = 1.0
        if "instance" in lookup:
            weight = weight * (lookup["instance"][p] == lookup["instance"][q])
        if "normal" in lookup:
            weight = weight * np.exp(
                -((lookup["normal"][p] - lookup["normal"][q]) ** 2).sum(axis=-1) / NORMAL**2
            )
        if "distance" in lookup:
            near = np.minimum(lookup["distance"][p], lookup["distance"][q])
            second = np.maximum(lookup["distance"][p], lookup["distance"][q])
            with np.errstate(invalid="ignore"):
                # two tiles of sky are both at infinity: their distances are equal
                part = np.where(second == near, 0.0, (second - near) / second)
            weight = weight * np.exp(-((np.nan_to_num(part, nan=1.0) / DISTANCE) ** 2))
        return weight

    return similarity


def averaged(
    xyz: np.ndarray, noise: np.ndarray, similarity: Callable[[Any, Any], np.ndarray | float]
) -> np.ndarray:
    """Return X, Y, Z (3, y, x) of one light group, each tile averaged with similar tiles around it.

    Parameters
    ----------
    xyz, noise : values and standard errors (3, y, x), cd/m2.
    similarity : weights of similar tiles, as `guides` returns them.

    Notes
    -----
    A tile with the error s is averaged with another of error t with the weight exp(-max(0, d)), d =
    ((x - y)^2 - v) / v, v = s^2 + min(s, t)^2, mean over the surroundings and X, Y, Z (the distance
    of Rousselle et al. 2012 with k = 1). A noisy bright tile may use quiet dark ones, but not the
    reverse. The error of a tile with few bright samples is poorly known, so every variance is
    raised to at least the median of the 3 x 3 tiles around it.
    """
    from scipy.ndimage import median_filter, uniform_filter

    shape = xyz.shape[1:]
    variance = np.nan_to_num(noise) ** 2
    variance = np.maximum(variance, median_filter(variance, (1, 3, 3), mode="nearest"))
    total = xyz.copy()
    weights = np.ones(shape)
    for dy in range(min(REACH + 1, shape[0])):
        for dx in range(-REACH if dy else 1, REACH + 1):
            if abs(dx) >= shape[1]:
                continue
            p = (slice(0, shape[0] - dy), _cut(shape[1], dx))
            q = (slice(dy, None), _cut(shape[1], -dx))
            square = (xyz[:, *p] - xyz[:, *q]) ** 2
            least = np.minimum(variance[:, *p], variance[:, *q])
            near = similarity(p, q)
            for target, source in ((p, q), (q, p)):
                variances = variance[:, *target] + least
                excess = (
                    np.divide(
                        square, variances, out=np.where(square > 0, FAR, 0.0), where=variances > 0
                    )
                    - 1
                )
                distance = uniform_filter(
                    np.minimum(excess, FAR).mean(axis=0), PATCH, mode="nearest"
                )
                w = np.exp(-np.maximum(distance, 0.0)) * near
                total[:, *target] += w * xyz[:, *source]
                weights[target] += w
    return total / weights


def _cut(length: int, shift: int) -> slice:
    """Return the part of an axis in which each tile has a neighbour `shift` tiles after it."""
    return slice(max(-shift, 0), length - max(shift, 0))

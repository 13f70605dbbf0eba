"""Scene noise: what of a scene's light is the renderer's own noise, tile by tile, and what of it reaches the pixels of a camera."""

from __future__ import annotations

import numpy as np

from . import geometry
from .physics.area import overlaps
from .physics.overlap import borders
from .physics.photometry import xyz_weights
from .quantities import tile_pitch

NOISE = "xyz_noise"  # variable (light_group, xyz_channel, y, x) of a scene: standard errors of X, Y and Z, cd/m2


def relative_noise(scene, mixed) -> np.ndarray | None:
    """Return the relative standard errors (3, y, x) of X, Y and Z of `mixed`, constant over time, or None where the scene states none.

    One pass of a renderer alone knows no noise: NaN, and None here too. Groups have noise of their own, so that squares add up; all
    bands share their paths, but lamps of other colours have other noise.
    """
    if NOISE not in scene:
        return None
    squares = np.zeros((3, *mixed.shape[1:]))
    for k, group in enumerate(map(str, scene.light_group.values)):
        if weight := mixed.attrs["weights"].get(group, 0.0):
            squares += (weight * scene[NOISE].isel(light_group=k).values.astype(float)) ** 2
    if not np.isfinite(squares).all():
        return None
    level = np.zeros_like(squares)
    for weights, band in zip(xyz_weights(mixed.wavelength.values).T, mixed.values):  # in float64, band by band
        level += weights[:, None, None] * band
    return np.sqrt(squares) / np.where(level > 0, level, 1.0)


def nearest_xyz(sensitivity, wavelength_nm) -> int:
    """Return which of X, Y and Z a channel's `sensitivity` (wavelength,) is most like: the noise of that one is taken for its own."""
    curves = xyz_weights(wavelength_nm)
    alike = curves @ sensitivity / np.sqrt((curves**2).sum(1) * max(float(sensitivity @ sensitivity), np.finfo(float).tiny))
    return int(np.nanargmax(alike))


def pixel_variance(variance, field, picture) -> np.ndarray:
    """Return the variance (..., y, x) of a pixel's mean over tiles whose errors are independent, from theirs (..., y, x).

    Parameters
    ----------
    variance : of each tile of `field`, any unit. `picture` : whose pixels look at the field, as `truth.seen`.

    Notes
    -----
    A mean with weights w has the variance sum of w^2 times the tiles' variances. Where a lens distorts, w are shares of the seen area.
    """
    f_m, side = float(picture.attrs["focal_length_mm"]) * 1e-3, float(picture.attrs["pitch_um"]) * 1e-6
    at = {d: picture[d].values / f_m for d in ("x", "y")}
    lens, side = geometry.map_of(picture), side / f_m
    if isinstance(lens, geometry.Identity):
        across, down = (overlaps(field[d].values, at[d], side, d) / side for d in ("x", "y"))
        across, down = across.multiply(across).tocsr(), down.multiply(down).tocsr()
        flat = np.reshape(variance, (-1, *np.shape(variance)[-2:]))
        return np.stack([(across @ (down @ one).T).T for one in flat]).reshape(*np.shape(variance)[:-2], len(at["y"]), len(at["x"]))
    areas = geometry.field_areas(lens, *(borders(field[d].values, tile_pitch(field, d)) for d in ("x", "y")),
                                 *(borders(at[d], side) for d in ("x", "y")))
    shares = areas.multiply(1 / areas.sum(axis=1)[:, None]).tocsr()
    out = (shares.multiply(shares).tocsr() @ np.reshape(variance, (-1, areas.shape[1])).T).T
    return out.reshape(*np.shape(variance)[:-2], len(at["y"]), len(at["x"]))

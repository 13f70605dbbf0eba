"""Noise-free dead leaves as a sensor's photocurrent and XYZ."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from isethdr_isp.spectra import LIGHTS, light, reflectances

from ...isp.dead_leaves import dead_leaves
from .camera import TrainingCamera

WAVELENGTH_NM = tuple(np.arange(400.0, 701.0, 10.0).tolist())
Y = -2  # index of Y among the planes; X, Y, Z are the last three


class LeavesRecipe(NamedTuple):
    """The settings that determine a bank of dead leaves."""

    pictures: int = 360
    side_px: int = 192
    seed: int = 7
    version: int = 1


def leaves(camera: TrainingCamera, recipe: LeavesRecipe, number: int) -> np.ndarray:
    """Return planes (plane, y, x) float32 in the order of `TrainingCamera.plane_weights`, with a
    mean illuminance of 1 lux.

    Surfaces are smooth reflectances in one of four lights, most of them pale.

    Parameters
    ----------
    camera : camera whose filters the light passes.
    recipe : size and seed of the pictures.
    number : number of the picture, from 0.
    """
    rng = np.random.default_rng([recipe.seed, number])
    source = light(LIGHTS[rng.integers(len(LIGHTS))], WAVELENGTH_NM)
    seen = reflectances(WAVELENGTH_NM) * source @ camera.plane_weights(WAVELENGTH_NM).T
    grey = seen[:1]  # the first reflectance is a grey
    brightness = seen[:, Y:][:, :1] / grey[:, Y:][:, :1]
    pale = rng.uniform(0.0, 1.0, (len(seen), 1)) ** 2  # most things are nearly grey
    surfaces = pale * seen + (1 - pale) * grey * brightness
    planes = dead_leaves(recipe.side_px, recipe.side_px, surfaces, rng)
    return (planes / planes[Y].mean()).astype(np.float32)

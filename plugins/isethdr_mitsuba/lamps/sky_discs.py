"""Sun and moon as flat lamps far away."""

from __future__ import annotations

import numpy as np

from isethdr_core.physics.photometry import LM_PER_W, v_lambda
from isethdr_core.scene import Lamp, SceneDescription, SkyDisc, SkyDome

from .placed_lamps import SPECTRUM_NM, PlacedLamp

FAR_M = 1e6  # distance of sun and moon from the camera
SIDES = 32  # number of sides of the polygon that replaces a disc; it has the same area


def discs_of(description: SceneDescription) -> tuple[SkyDisc, ...]:
    """Return sun and moon of a description."""
    return description.sky.discs if isinstance(description.sky, SkyDome) else ()


def disc_mesh(disc: SkyDisc, camera_m: tuple[float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices, m, and faces of a disc that faces the camera."""
    towards = disc.direction()
    side = np.cross(towards, np.eye(3)[np.argmin(np.abs(towards))])
    side /= np.linalg.norm(side)
    other = np.cross(towards, side)
    # the polygon's area is that of the disc
    equal_area = np.sqrt(2 * np.pi / (SIDES * np.sin(2 * np.pi / SIDES)))
    radius = FAR_M * np.tan(np.radians(disc.diameter_deg / 2)) * equal_area
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    rim = radius * (np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * other)
    vertices = np.asarray(camera_m, float) + FAR_M * towards + np.vstack([np.zeros(3), rim])
    around = np.arange(SIDES)
    faces = np.stack([np.zeros(SIDES, int), 1 + (around + 1) % SIDES, 1 + around], 1)
    return vertices, faces


def disc_lamps(description: SceneDescription, include_sun: bool) -> list[PlacedLamp]:
    """Return sun and moon as lamps of the light group `sky`; their luminance is 0 if `include_sun`
    is false.

    Their object number is 0, that of the sky.
    """
    out = []
    for disc in discs_of(description):
        vertices, faces = disc_mesh(disc, description.camera.position_m)
        luminance = float(disc.radiance.at(SPECTRUM_NM) @ v_lambda(SPECTRUM_NM)) * LM_PER_W
        candela = luminance * disc.solid_angle_sr() * FAR_M**2
        lamp = Lamp(disc.name, "sky", candela, disc.radiance, tuple(-disc.direction()))
        level = luminance * include_sun
        axis = -disc.direction()
        out.append(PlacedLamp(0, "sky", lamp, vertices[faces], axis, level, 0.0, 0.0, 0.0))
    return out

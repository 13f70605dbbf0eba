"""Views from the camera's car: the bare road of each kind, rendered by day."""

from __future__ import annotations

import numpy as np
from PIL import Image

from isethdr_core.demand import Demand
from isethdr_core.physics.colour.colour_spaces import linear_srgb, srgb_encode
from isethdr_core.physics.photometry import xyz
from isethdr_core.plugins.registry import build
from isethdr_core.scene import Camera, Model, Placed, SceneDescription

from ...materials import used
from ...sky.dome import dome_of
from ...sky.state import sky_state
from ..kinds import BaseRoad
from ..surface import surface

# height of the camera, and distance ahead of the point at which it looks
HEIGHT_M = 1.3
AHEAD_M = 30.0
FIELD_DEG = 60.0
ASPECT = 16 / 9
BANDS_NM = {"first_nm": 430.0, "last_nm": 670.0, "step_nm": 60.0}
WHITE = 0.90  # quantile of luminance that is shown at `SHOWN`
SHOWN = 0.75
SKY = {"sun_elevation_deg": 38.0, "sun_azimuth_deg": 60.0}


def scene_of(base: BaseRoad) -> SceneDescription:
    """Return the scene of a bare road under a day sky, seen from the camera's car."""
    parts = surface(base.network)
    models: dict[str, Model] = {}
    objects = []
    categories = {"road": "road", "land": "vegetation", "structures": "building"}
    for assembly in (a for a in parts if a.parts):
        models[assembly.name] = assembly.model()
        category = categories[assembly.name]
        objects.append(Placed(assembly.name, assembly.name, category, np.eye(4)))
    pose = base.pose()
    eye = pose[:3, 3] + HEIGHT_M * pose[:3, 2]
    target = eye + AHEAD_M * pose[:3, 0] - 0.05 * AHEAD_M * pose[:3, 2]
    camera = Camera(tuple(eye.tolist()), tuple(target.tolist()), FIELD_DEG, ASPECT)
    sky = dome_of(sky_state("noon", SKY))
    name = f"{base.name} {base.seed}"
    return SceneDescription(name, models, tuple(objects), used(models), camera, sky)


def driver_view(base: BaseRoad, width: int = 240, samples: int = 16) -> Image.Image:
    """Return a small rendering of a bare road from the camera's car.

    Parameters
    ----------
    base : road and start of the camera's car.
    width : width of the picture, pixels; its height follows from `ASPECT`.
    samples : samples per pixel.
    """
    height = round(width / ASPECT)
    size = {"width": width, "height": height, "margin": 0.0, "samples": samples, "max_depth": 3}
    renderer = build("renderer", "mitsuba", **size, **BANDS_NM)
    scene = scene_of(base)
    light = renderer(scene, Demand().with_groups(scene.light_groups()))
    radiance = light.radiance.values.sum(0)
    bands = light.wavelength.values
    # few bands shift colours: divide by the colour of a flat spectrum
    grey = linear_srgb(xyz(np.ones(len(bands)), bands))
    linear = linear_srgb(xyz(radiance, bands)) / grey
    linear = linear / np.quantile(linear.mean(-1), WHITE) * SHOWN
    code = srgb_encode(np.clip(linear, 0, 1))
    return Image.fromarray(np.round(255 * code).astype(np.uint8))

"""Preview of a scene: a rendering with few paths, without a camera. Each light group is denoised
separately. The result is a picture and is not stored as radiance.
"""

from __future__ import annotations

import time

import numpy as np
import xarray as xr

from isethdr_core import Demand
from isethdr_core.config.composition import compose
from isethdr_core.display.preview import denoised, tristimulus
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain import chain
from isethdr_core.runs.sample_accumulation import rendered_anew

from .dataset.page import shown
from .study_command import RASTERS, check_picture

LABELS = frozenset({"instance", "normal", "distance"})


def preview(
    *overrides: str,
    experiment: str = "night_drive",
    samples: int = 8,
    width: int = 320,
    denoise: int = 1,
    picture: str = "preview.png",
) -> list[dict]:
    """Render a quick, denoised view of an experiment's scene, as a PNG.

    Parameters
    ----------
    overrides : overrides of scene, renderer and lighting, as for `isethdr run`: scene=street_city
        lighting=night_city.
    experiment : experiment that gives scene, renderer and lighting.
    samples, width : samples per tile, and tiles across; the height is 9/16 of the width.
    denoise : 1 denoises by averaging similar tiles, 0 shows the rendering as it is.
    picture : file to write (png or jpg); empty writes none.

    Returns
    -------
    one row per light group: weight, noise of the rendering, moved (change of luminance by
    denoising: median, relative), light_kept (its light after denoising over that before), CPU
    seconds.

    Raises
    ------
    ConfigError : `denoise` is neither 0 nor 1, `picture` cannot be written, or the renderer
        refuses its settings.
    UnitError : there are too few samples to estimate their noise.
    """
    from PIL import Image

    if denoise not in (0, 1):
        raise ConfigError(
            f"study preview: denoise is {denoise}; expected 1, or 0 to see the noise; type"
            " denoise=1"
        )
    for name, value in (("samples", samples), ("width", width)):
        if value < 1:
            raise ConfigError(
                f"study preview: {name} is {value}; expected 1 or more; type {name}=32"
            )
    check_picture(picture, RASTERS)
    height = round(width * 9 / 16)
    chosen = [f"experiment={experiment}", *overrides]
    settings = {"samples": samples, "width": width, "height": height}
    renderer = compose(chosen).get("renderer")
    lacking = [name for name in settings if renderer is not None and name not in renderer]
    if lacking:
        raise ConfigError(
            f"study preview sets samples, width and height of the renderer, and renderer"
            f" {renderer.name!r} has no field {' and '.join(map(repr, lacking))}; expected a"
            " renderer with these fields; type renderer=mitsuba"
        )
    if renderer is not None:
        chosen += [f"renderer.{name}={value}" for name, value in settings.items()]
    built = chain(compose(chosen))
    description = built.scene()
    if isinstance(description, xr.Dataset) or built.renderer is None:
        raise ConfigError(
            "study preview shows rendered light, and this scene states its own radiance or there is"
            " no renderer; expected a scene with geometry and a renderer; type for example"
            " scene=night_drive"
        )
    scene = rendered_anew(built.renderer, description, Demand(labels=LABELS))
    weights = {str(g): float(w) for g, w in built.lighting(scene).attrs["weights"].items()}
    start = time.process_time()
    looks = denoised(scene) if denoise else tristimulus(scene)
    cpu_s = time.process_time() - start
    whole = np.moveaxis(np.tensordot(list(weights.values()), looks, 1), 0, -1)
    if picture:
        Image.fromarray(shown(without_overscan(whole, height, width))).save(picture)
    rows = []
    for (group, weight), look, plain in zip(weights.items(), looks, tristimulus(scene)):
        light_kept = float(look[1].sum() / plain[1].sum()) if plain[1].any() else 1.0
        rows.append(
            {
                "light_group": group,
                "weight": weight,
                "noise": scene.attrs["noise"].get(group, float("nan")),
                "moved": moved(look[1], plain[1]),
                "light_kept": light_kept,
                "cpu_s": cpu_s / len(weights),
            }
        )
    return rows


def without_overscan(xyz: np.ndarray, height: int, width: int) -> np.ndarray:
    """Return the middle of a picture, or all of it along an axis that is shorter.

    Parameters
    ----------
    xyz : (y, x, 3) XYZ, cd/m2.
    height, width : rows and columns of the middle.
    """
    top = max(0, (xyz.shape[0] - height) // 2)
    left = max(0, (xyz.shape[1] - width) // 2)
    return xyz[top : top + height, left : left + width]


def moved(denoised_y: np.ndarray, plain_y: np.ndarray) -> float:
    """Return the relative change of luminance by denoising: the median over tiles above 1 % of the
    mean; 0 if there is no light.

    Parameters
    ----------
    denoised_y, plain_y : (y, x) luminance with and without denoising, same unit.
    """
    lit = plain_y > 0.01 * plain_y.mean()
    return float(np.median(np.abs(denoised_y[lit] / plain_y[lit] - 1))) if lit.any() else 0.0

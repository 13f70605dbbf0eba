"""Day and night: one rendering, two weighted sums of its light groups, and the light on the sensor
along a line through a headlight.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from isethdr_core.config.composition import compose
from isethdr_core.display.display_view import false_colour
from isethdr_core.pipeline.chain import chain

from .rendered_scene import lux_of, rendered, through, write_sheet


def paper_fig3(picture: str = "", scene: str = "night_drive") -> list[dict]:
    """Repeat figure 3 of the ISETHDR paper: illuminance on the sensor by day and by night.

    Parameters
    ----------
    picture : file for both views and the profile (png or jpg); empty writes none.
    scene : experiment that gives the rendering; its stored radiance is reused.

    Returns
    -------
    rows with version, lux_headlight (at the brightest tile by night), lux_median, and decades
    between them.
    """
    scene_chain, radiance = rendered(f"experiment={scene}")
    lightings = {
        "night": scene_chain.lighting,
        "day": chain(
            compose([f"experiment={scene}", "lighting=day", "lighting.others=1.0"])
        ).lighting,
    }
    light = {
        name: lux_of(through(scene_chain, radiance, lighting)[1])
        for name, lighting in lightings.items()
    }
    row, column = np.unravel_index(np.argmax(light["night"]), light["night"].shape)
    if picture:
        write(picture, light, row)
    return [
        {
            "version": name,
            "lux_headlight": float(lux[row, column]),
            "lux_median": float(np.median(lux)),
            "decades": float(np.log10(lux[row, column] / np.median(lux))),
        }
        for name, lux in light.items()
    ]


def write(path: str, light: dict, row: int) -> None:
    """Write the views in false colours on one scale, with a dotted line, and the profile along it.

    Parameters
    ----------
    path : file of the figure.
    light : {title: (y, x) illuminance on the sensor, lux}.
    row : row of the profile, tiles.
    """
    low = min(float(np.percentile(v, 1)) for v in light.values())
    high = max(float(v.max()) for v in light.values())
    views = {name: false_colour(lux, low, high)[0] for name, lux in light.items()}
    for view in views.values():
        view[row, ::8] = 255

    def profile(axes: Any) -> None:
        for name, lux in light.items():
            axes.semilogy(np.arange(lux.shape[1]) - lux.shape[1] / 2, lux[row], label=name, lw=1)
        axes.set(
            xlabel="tiles from the axis",
            ylabel="illuminance on the sensor, lux",
            xlim=(-light["night"].shape[1] / 2, light["night"].shape[1] / 2),
        )
        axes.grid(True, color="#eee")
        axes.legend()

    write_sheet(
        path,
        [list(views.values())],
        [[f"{n}: illuminance {low:.1g} to {high:.1g} lux" for n in views]],
        profile,
    )

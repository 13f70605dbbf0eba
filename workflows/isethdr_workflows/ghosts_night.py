"""Ghosts of a night drive: headlights reflected between the surfaces of an uncoated and a coated
lens with a six-bladed iris.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.display.display_view import display
from isethdr_core.plugins.registry import build
from isethdr_core.quantities import tristimulus

from .paper.rendered_scene import rendered, write_sheet

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Lens

# {coating: luminance shown as white in the picture of its ghosts alone, cd/m2}
COATINGS = {
    "none": 1.0,
    "mgf2": 0.05,
    "multilayer": 0.002,
}
LENS = {"f_number": 4.0, "focal_length_mm": 4.0}
PRESCRIPTION = "double_gauss"
WHITE_CD_M2 = 20.0  # luminance shown as white in the pictures with image and ghosts


def ghosts_night(
    picture: str = "", experiment: str = "night_drive", renderer: str = "mitsuba_quick"
) -> list[dict]:
    """Compare the light of ghosts in a night scene between lens coatings.

    Parameters
    ----------
    picture : file for the pictures (png or jpg), which show the image with the ghosts of each
        coating, and the ghosts alone; empty writes none.
    experiment, renderer : experiment and preset of the renderer; stored radiance is reused.

    Returns
    -------
    rows with coating, pairs (number of traced pairs of surfaces), pairs_left_out, strongest_pair
    (largest share of a lamp's light in the ghost of one pair, by first-order matrices, in the band
    where the coating is worst), added (light of all ghosts on the sensor over that of the image),
    opposite (share of ghost light on the other side of the axis than the brightest lamp),
    red_over_blue (ratio of red to blue in the ghosts over that in the image).
    """
    night_chain, radiance = rendered(f"experiment={experiment}", f"renderer={renderer}")
    return study(night_chain.lighting(radiance), picture)


def study(mixed: xr.DataArray, picture: str = "") -> list[dict]:
    """Return the rows of `ghosts_night` for mixed radiance, and write the pictures.

    Parameters
    ----------
    mixed : (wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    picture : file for the pictures; empty writes none.
    """
    lens = build("lens", "diffraction_limited", **LENS)
    clean = lens(mixed)
    rows = []
    sheet = [[], []]
    names = [[], []]
    for coating, white in COATINGS.items():
        flare = build(
            "flare",
            "ghosts",
            prescription=PRESCRIPTION,
            coating=coating,
            blades=6,
            sensor_reflectance_percent=0.0,
        )
        added = flare.irradiance(lens, mixed)
        rows.append(
            {
                "coating": coating,
                **figures(clean, added, *flare.pairs(lens, mixed.wavelength.values, 0.5)),
            }
        )
        word = coating if coating != "none" else "bare glass"
        for row, light, top, name in (
            (
                0,
                clean + added,
                WHITE_CD_M2,
                f"{word}: ghosts add {100 * rows[-1]['added']:.2g} % of the light",
            ),
            (1, added, white, f"ghosts alone, white {white:g} cd/m2"),
        ):
            sheet[row].append(luminance_seen(light, lens, top))
            names[row].append(name)
    if picture:
        write_sheet(picture, sheet, names)
    return rows


def figures(clean: Any, added: Any, traced: Any, left_out: Any) -> dict:
    """Return the figures of one coating.

    Parameters
    ----------
    clean : (wavelength, y, x) irradiance of the image, W m-2 nm-1.
    added : (wavelength, y, x) irradiance of the ghosts, W m-2 nm-1.
    traced : pairs of surfaces that are traced, the strongest first.
    left_out : pairs of surfaces that are left out.
    """
    total = clean.values.sum(axis=0)
    row, column = np.unravel_index(int(total.argmax()), total.shape)
    ghosts = added.values.sum(axis=0, dtype=float)
    across = np.sign(added.x.values)[None, :] * np.sign(clean.x.values[column]) < 0
    third = max(1, len(clean.wavelength) // 3)
    red_blue = [
        light.values[-third:].sum(dtype=float) / light.values[:third].sum(dtype=float)
        for light in (added, clean)
    ]
    return {
        "pairs": len(traced),
        "pairs_left_out": len(left_out),
        "strongest_pair": traced[0].share,
        "added": ghosts.sum() / total.sum(dtype=float),
        "opposite": float((ghosts * across).sum() / ghosts.sum()),
        "red_over_blue": red_blue[0] / red_blue[1],
    }


def luminance_seen(light: xr.DataArray, lens: Lens, white_cd_m2: float) -> np.ndarray:
    """Return sRGB bytes (y, x, 3) of irradiance, shown as the radiance of a scene that would cause
    it.

    Parameters
    ----------
    light : (wavelength, y, x) irradiance on the sensor plane, W m-2 nm-1.
    lens : lens, for its throughput.
    white_cd_m2 : luminance that is shown as white, cd/m2.
    """
    scene = light.copy(data=light.values / lens.throughput_sr())
    return display(tristimulus(scene), white_cd_m2)

"""Three captures of a split pixel: in a tunnel, and close to headlights with flare that saturates
the large photodiode.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.display.display_view import white_cd_m2
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.plugins.registry import build

from .parameters import PAPER, SCRIPTS, chosen
from .rendered_scene import rendered, seen_by, shown, through, write_sheet

if TYPE_CHECKING:
    import xarray as xr

SCENES = {"tunnel": "tunnel_exit", "night": "night_drive"}
# {parameters: {scene: exposure, s}}; None is the exposure of the sensor, because the text states
# none; the scripts use long exposures
EXPOSURES_S: dict[str, dict[str, float | None]] = {
    PAPER: {"tunnel": None, "night": None},
    SCRIPTS: {"tunnel": 0.120, "night": 0.342},
}
SENSORS = {PAPER: "split_pixel", SCRIPTS: "split_pixel_isethdr"}
NAMES = ("large, low gain", "large, high gain", "small")


def paper_fig6_7(picture: str = "", scene: str = "tunnel", parameters: str = PAPER) -> list[dict]:
    """Repeat figures 6 and 7 of the ISETHDR paper: captures of a split pixel, and their merge.

    Parameters
    ----------
    picture : file for captures, combination and line profile (png or jpg); empty writes none.
    scene : tunnel or night.
    parameters : paper (exposure of the sensor), or scripts (pixels of 3 um, 120 ms in the tunnel
        and 342 ms by night).

    Returns
    -------
    rows with capture, saturated_percent, decades (of luminance, from the darkest pixels with a
    signal above their noise to the brightest unsaturated pixel), and log_error (median over pixels
    of |log10 of measured over true luminance|).

    Raises
    ------
    ConfigError : the scene is unknown.
    """
    if scene not in SCENES:
        raise ConfigError(f"study paper_fig6_7 has no scene {scene!r}{did_you_mean(scene, SCENES)}")
    exposure_s = chosen("paper_fig6_7", parameters, EXPOSURES_S)[scene]
    scene_chain, radiance = rendered(f"experiment={SCENES[scene]}", f"sensor={SENSORS[parameters]}")
    mixed, light = through(scene_chain, radiance, scene_chain.lighting)
    (sensor,) = scene_chain.cameras.values()
    if exposure_s is not None:
        sensor = replace(sensor, exposure_s=exposure_s)
    isp = build("isp", "merge", balance="automatic")
    shot, combined, true, _ = seen_by(sensor, isp, mixed, light, radiance)
    pictures = {}
    for k, name in enumerate(NAMES):
        pictures[name] = isp(shot.isel(capture=[k]))
    pictures["combined"] = combined
    saturated = [
        *(100 * shot["saturated"].mean(dim=("y", "x")).values),
        100 * float(np.mean(~combined["valid"].values.astype(bool))),
    ]
    rows = [
        {"capture": name, "saturated_percent": float(s), **shown_luminance(picture_of_name, true)}
        for (name, picture_of_name), s in zip(pictures.items(), saturated)
    ]
    if picture:
        write(
            picture,
            pictures,
            true,
            white_cd_m2(true),
            int(np.argmax(shot["saturated"].values[0].sum(axis=1))),
        )
    return rows


def shown_luminance(picture: xr.Dataset, true: xr.Dataset) -> dict:
    """Return the decades of luminance in a picture, and its error against the reference.

    Parameters
    ----------
    picture : picture of the camera.
    true : reference picture on the same grid.
    """
    y = picture["xyz"].values[..., 1]
    sd = np.sqrt(picture["variance"].values[..., 1])
    want = true["xyz"].values[..., 1]
    valid = np.asarray(picture["valid"].values, bool)
    usable = valid & (y > sd) & (want > 0)
    decades = (
        float(np.log10(y[usable].max() / np.percentile(y[usable], 0.1))) if usable.any() else 0.0
    )
    error = np.where(valid, np.abs(np.log10(np.maximum(y, 1e-6) / np.maximum(want, 1e-6))), np.inf)
    return {"decades": decades, "log_error": float(np.median(error))}


def write(path: str, pictures: dict, true: xr.Dataset, white: float, row: int) -> None:
    """Write the captures and their combination with the same white, and the luminance along a row.

    Parameters
    ----------
    path : file of the figure.
    pictures : {title: picture of a capture, or of all of them}.
    true : reference picture, without flare.
    white : luminance that is shown as white, cd/m2.
    row : row of the profile, in which the large photodiode is saturated in the most pixels.
    """
    views = [shown(p, white) for p in pictures.values()]

    def profile(axes: Any) -> None:
        axes.semilogy(
            true["xyz"].values[row, :, 1], color="#bbb", lw=2.5, label="truth, without flare"
        )
        for name, colour, width in (
            ("large, low gain", "#e59a8f", 2.2),
            ("combined", "#2c6fad", 0.9),
        ):
            y = np.where(
                np.asarray(pictures[name]["valid"].values[row], bool),
                pictures[name]["xyz"].values[row, :, 1],
                np.nan,
            )
            axes.semilogy(
                np.where(y > 0, y, np.nan),
                color=colour,
                lw=width,
                label=name + " (gaps: saturated)" * ("large" in name),
            )
        axes.set(xlabel=f"pixel of row {row}", ylabel="luminance, cd/m2", xlim=(0, true.sizes["x"]))
        axes.grid(True, color="#eee")
        axes.legend(fontsize=8)

    names = list(pictures)
    write_sheet(path, [views[:2], views[2:]], [names[:2], names[2:]], profile)

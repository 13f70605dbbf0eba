"""RGB against RGBW filters from starlight to a lit room: structural similarity and colour error,
with a classical and a learned demosaic.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from isethdr_core.display.display_view import white_cd_m2
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build

from .parameters import PAPER, SCRIPTS, chosen
from .rendered_scene import lux_of, rendered, seen_by, shown, through, write_sheet

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Isp, Metric, Sensor

SENSORS = {"RGB": "bayer", "RGBW": "rgbw"}
DEMOSAICS = ("bilinear", "learned")  # the classical one, and linear filters per local class
SHOWN_LUX = (0.1, 0.25)  # the two levels of which the sheet shows pictures
# range of the signal to noise ratio for which the colour matrix is designed; outside this range
# noise dominates or is negligible
DESIGN_SNR = (
    0.5,
    40.0,
)
LENS = {"f_number": 4.0}
OWN = "own"
# mean illuminances, lx, of the graph in the text and of the published script, both with pixels of
# 3 um and 1/60 s
LEVELS_LUX = {
    OWN: (),
    PAPER: (*np.arange(1, 11) / 10, *range(2, 11)),
    SCRIPTS: tuple(np.logspace(-2, 1, 3)),
}
PIXEL = {"pitch_um": 3.0, "exposure_s": 1 / 60}


def paper_fig8_9_classical(
    picture: str = "",
    scene: str = "night_drive",
    levels: int = 10,
    draws: int = 3,
    parameters: str = OWN,
) -> list[dict]:
    """Repeat figures 8 and 9 of the ISETHDR paper without a network: RGB and RGBW at low light.

    Parameters
    ----------
    picture : file for the pictures at 0.1 and 0.25 lux and the two curves (png or jpg); empty
        writes none.
    scene : experiment that gives the rendering, lit by its sky alone; its stored radiance is
        reused.
    levels : number of mean illuminances from 0.01 to 10 lux, in equal steps of their logarithm.
    draws : number of shots over which each score is averaged.
    parameters : own (`levels`, the bundled sensors), paper (0.1 to 1 and 2 to 10 lux) or scripts
        (0.01, 0.316 and 10 lux), both with pixels of 3 um and 1/60 s.

    Returns
    -------
    rows with filters, demosaic, mean_lux, ssim and ciede2000, each with its standard error over
    shots.

    Raises
    ------
    ConfigError : there is no illuminance or no shot, or the parameters are unknown.
    """
    if levels < 1 or draws < 1:
        raise ConfigError(
            f"levels is {levels} and draws is {draws}; expected 1 or more of both; type for example"
            " levels=10 draws=3"
        )
    levels_lux = chosen("paper_fig8_9_classical", parameters, LEVELS_LUX)
    pixel = PIXEL if levels_lux else {}
    street = driving(scene)
    chart = colour_chart()
    rows = []
    views = []
    names = []
    for filters, name in SENSORS.items():
        sensor = build("sensor", name, **pixel)
        for demosaic in DEMOSAICS:
            isp = build("isp", "linear", demosaic=demosaic)
            for lux in levels_lux or np.geomspace(0.01, 10, levels):
                suited = at_noise(isp, sensor, chart, lux)
                ssim = scored(build("metric", "ssim"), sensor, suited, street, lux, draws)
                colour = scored(build("metric", "ciede2000"), sensor, suited, chart, lux, draws)
                rows.append(
                    {
                        "filters": filters,
                        "demosaic": demosaic,
                        "mean_lux": float(lux),
                        "ssim": ssim[0],
                        "ssim_se": ssim[1],
                        "ciede2000": colour[0],
                        "ciede2000_se": colour[1],
                    }
                )
            if picture:
                pictures = [
                    displayed(sensor, at_noise(isp, sensor, chart, lux), street, lux)
                    for lux in SHOWN_LUX
                ]
                views.append(pictures)
                names.append([f"{filters}, {demosaic}, {lux:g} lux" for lux in SHOWN_LUX])
    if picture:
        write_sheet(
            picture,
            [sum(views[:2], []), sum(views[2:], [])],
            [sum(names[:2], []), sum(names[2:], [])],
            lambda axes: curves(axes, rows),
        )
    return rows


class LitScene(NamedTuple):
    """A scene and its light on the sensor plane."""

    mixed: xr.DataArray  # mixed radiance
    light: xr.DataArray  # irradiance
    radiance: xr.Dataset  # scene radiance, with its labels

    def at_level(self, lux: float) -> LitScene:
        """Return the scene with its light scaled to a mean of `lux` on the sensor."""
        scale = np.float32(lux / lux_of(self.light).mean())
        return self._replace(
            mixed=self.mixed.copy(data=self.mixed.values * scale),
            light=self.light.copy(data=self.light.values * scale),
        )


def driving(scene: str) -> LitScene:
    """Return a rendered scene by daylight."""
    scene_chain, radiance = rendered(f"experiment={scene}", "lighting=day")
    mixed, light = through(replace(scene_chain, flares={}), radiance, scene_chain.lighting, **LENS)
    return LitScene(mixed, light, radiance)


def colour_chart() -> LitScene:
    """Return a colour chart with 24 patches."""
    scene = build("scene", "macbeth", width=240, height=160)()
    mixed = build("lighting", "weights", weights={"sky": 1.0})(scene)
    light = build(
        "lens",
        "diffraction_limited",
        focal_length_mm=3.75e-3 * 240 / mixed.attrs["field_width"],
        falloff="none",
        **LENS,
    )(mixed)
    return LitScene(mixed, light, scene)


def at_noise(isp: Isp, sensor: Sensor, scene: LitScene, lux: float) -> Any:
    """Return the isp with a colour matrix designed for the noise at one illuminance. Clear pixels
    only help if the design weighs noise against colour errors.

    The noise is that of a bilinear picture, because a learned demosaic does not state its noise.

    Parameters
    ----------
    isp : isp of the figure.
    sensor : sensor of the camera.
    scene : scene and its light on the sensor plane.
    lux : illuminance of the scene, lux.
    """
    bilinear = replace(isp, demosaic=DEMOSAICS[0])
    _, picture, _, _ = seen_by(sensor, bilinear, *scene.at_level(lux))
    y = picture["xyz"].values[..., 1]
    variance = picture["variance"].values[..., 1]
    snr = np.median(y / np.sqrt(variance))
    return replace(isp, design_snr=float(np.clip(snr, *DESIGN_SNR)))


def scored(
    metric: Metric, sensor: Sensor, isp: Isp, scene: LitScene, lux: float, draws: int
) -> tuple[float, float]:
    """Return the mean of a score over shots and its standard error.

    Parameters
    ----------
    metric : metric component.
    sensor : sensor of the camera.
    isp : isp of the figure.
    scene : scene and its light on the sensor plane.
    lux : illuminance of the scene, lux.
    draws : number of shots with different noise.
    """
    values = []
    for seed in range(draws):
        _, picture, true, labels = seen_by(sensor, isp, *scene.at_level(lux), seed)
        values.append(metric(picture, true, labels)[0].value)
    return float(np.mean(values)), float(
        np.std(values, ddof=1) / np.sqrt(draws)
    ) if draws > 1 else np.nan


def displayed(sensor: Sensor, isp: Isp, scene: LitScene, lux: float) -> Any:
    """Return the displayed picture of one shot, with the white of the reference picture.

    Parameters
    ----------
    sensor : sensor of the camera.
    isp : isp of the figure.
    scene : scene and its light on the sensor plane.
    lux : illuminance of the scene, lux.
    """
    _, picture, true, _ = seen_by(sensor, isp, *scene.at_level(lux))
    return shown(picture, white_cd_m2(true))


def curves(axes: Any, rows: list[dict]) -> None:
    """Draw both scores against mean illuminance."""
    right = axes.twinx()
    for filters, colour in (("RGB", "#c0392b"), ("RGBW", "#2c6fad")):
        for demosaic, style in zip(DEMOSAICS, ("--", "-")):
            of = [r for r in rows if r["filters"] == filters and r["demosaic"] == demosaic]
            lux = [r["mean_lux"] for r in of]
            axes.semilogx(
                lux,
                [r["ssim"] for r in of],
                style,
                color=colour,
                marker="o",
                ms=3,
                label=f"SSIM {filters}, {demosaic}",
            )
            right.semilogx(
                lux, [r["ciede2000"] for r in of], style, color=colour, alpha=0.35, marker="s", ms=3
            )
    axes.set(xlabel="mean illuminance on the sensor, lux", ylabel="SSIM, driving scene (strong)")
    right.set(ylabel="CIEDE2000, colour chart (faint)")
    axes.grid(True, color="#eee")
    axes.legend(fontsize=8, loc="center right")

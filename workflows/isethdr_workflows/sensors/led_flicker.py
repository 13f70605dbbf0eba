"""LED lamps at night: short exposures miss the lit phase of a lamp, and a small photodiode sees all
lamps.

Five lamps of 90 Hz, lit for a tenth of the time with different phases, are captured in two ways.
With staggered exposures, the first one saturates and the short ones cover only an instant. In a
split pixel, the small photodiode is exposed as long as the large one.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from isethdr_core.data.temporal_modulation import time_mean
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.temporal_modulation import Modulation, relative_light
from isethdr_core.plugins.registry import build
from isethdr_core.seeds import generator

if TYPE_CHECKING:
    from isethdr_sensors.sensor_model import SensorModel

LAMPS = 5
LAMP_CD_M2 = 2e4
GROUND_CD_M2 = 2.0
FREQUENCY_HZ = 90.0
DUTY = 0.1
PHASES = tuple(0.1 + k / LAMPS for k in range(LAMPS))
EXPOSURE_S = 0.016
LINE_TIME_S = 22.2e-6
MISSED = 0.1  # luminance over the lamp's mean over time, below which a lamp counts as missed


def led_flicker(folder: str = "", phases: int = 400) -> list[dict]:
    """Count the flickering LED lamps that each capture of a sensor shows, and their brightness.

    Parameters
    ----------
    folder : folder for led_flicker.png and rolling_bands.png; empty writes none.
    phases : number of equally spaced phases of a lamp for `never_lit_percent`.

    Returns
    -------
    rows with sensor, capture, exposure_ms, starts_ms, never_lit_percent (percent of the phases at
    which a lamp gives this capture no light), lamps_seen (of five; saturated lamps count as seen),
    darkest and brightest (luminance of the darkest and the brightest unsaturated lamp over its mean
    over time; NaN if all are saturated).

    Raises
    ------
    ConfigError : there is no such folder, or there is no phase.
    """
    if folder and not os.path.isdir(folder):
        raise ConfigError(f"folder is {folder}; expected a folder that exists; make it first")
    if phases < 1:
        raise ConfigError(f"phases is {phases}; expected 1 or more; type for example phases=400")
    shots = {name: shot(name) for name in ("staggered", "split_pixel")}
    rows = []
    for name, (sensor, captures, steady, picture, truth) in shots.items():
        model = sensor.model()
        for k, reading in enumerate(model.readings):
            diode = model.diode_of(reading)
            level = lamp_levels(electrons(captures, k), electrons(steady, k), captures)
            level[lamp_levels(captures.saturated.values[k] * 1.0, None, captures) > 0.5] = np.nan
            rows.append(
                {
                    "sensor": name,
                    "capture": reading.capture,
                    "exposure_ms": 1e3 * model.exposure_of(diode),
                    "starts_ms": 1e3 * model.exposure_s * diode.start_share,
                    "never_lit_percent": never_lit_percent(model, diode, phases),
                    **_judged(level),
                }
            )
        merged, true = (p.xyz.sel(xyz_channel="Y").values for p in (picture, truth))
        rows.append(
            {
                "sensor": name,
                "capture": "merged picture",
                "exposure_ms": float("nan"),
                "starts_ms": float("nan"),
                "never_lit_percent": float("nan"),
                **_judged(lamp_levels(merged, true, picture)),
            }
        )
    if folder:
        from .led_flicker_figures import draw_bands, draw_lamps

        draw_lamps(shots, os.path.join(folder, "led_flicker.png"))
        draw_bands(os.path.join(folder, "rolling_bands.png"))
    return rows


def shot(name: str) -> tuple[Any, Any, Any, Any, xr.Dataset]:
    """Return (sensor, captures, expected electrons under constant light, picture, reference
    picture) of a named sensor.
    """
    from isethdr_core.truth import truth

    mixed = lamps()
    light = build("lens", "ideal", f_number=4.0, focal_length_mm=4.0)(mixed)
    sensor = build("sensor", name, exposure_s=EXPOSURE_S, line_time_s=LINE_TIME_S)
    captures = sensor(light, generator(seed=1, scene="led"))
    picture = build("isp", "merge")(captures)
    return sensor, captures, sensor.expected(time_mean(light)), picture, truth(mixed, picture)


def lamps() -> Any:
    """Return mixed radiance of five LED lamps in a row on a dark background. Each lamp is a light
    group of its own.
    """
    chart = build(
        "scene",
        "point_lights",
        width=320,
        height=64,
        horizontal_field_deg=16.0,
        luminance_cd_m2=LAMP_CD_M2,
        step=1.0,
        background_cd_m2=GROUND_CD_M2,
        disc_diameter_deg=1.2,
    )()
    lit = chart.radiance.sel(light_group="headlights")
    lamp_of_column = np.floor((np.arange(320) + 0.5) / 320 * LAMPS).astype(int)
    groups = {"sky": chart.radiance.sel(light_group="sky")} | {
        f"lamp {k}": lit * xr.DataArray(lamp_of_column == k, dims="x") for k in range(LAMPS)
    }
    cube = xr.concat(
        [g.drop_vars("light_group") for g in groups.values()], "light_group"
    ).transpose(*chart.radiance.dims)
    scene = chart.drop_vars(["radiance", "light_group"]).assign_coords(
        light_group=np.array(list(groups), object)
    )
    scene["radiance"] = cube.astype("float32").assign_attrs(chart.radiance.attrs)
    scene.attrs = chart.attrs
    flashing = {
        f"lamp {k}": {"frequency_hz": FREQUENCY_HZ, "duty": DUTY, "phase": phase}
        for k, phase in enumerate(PHASES)
    }
    return build("lighting", "weights", others=1.0, modulation=flashing)(scene)


def electrons(data: Any, k: int) -> np.ndarray:
    """Return electrons (y, x) of one capture, including dark charge.

    Parameters
    ----------
    data : captures, or expected electrons.
    k : number of the capture.
    """
    if not isinstance(data, xr.Dataset):
        return data.values[k]
    return (data.raw.values[k].astype(float) - float(data.black_dn[k])) / float(
        data.gain_dn_per_e[k]
    )


def lamp_levels(light: np.ndarray, steady: Any, grid: np.ndarray) -> np.ndarray:
    """Return the mean of `light` over the middle of each lamp, divided by the mean of `steady`.

    Parameters
    ----------
    light : (y, x) values of the picture or capture.
    steady : (y, x) values under constant light; None: 1.
    grid : Dataset or DataArray with the same sizes `y` and `x`.
    """
    height = grid.sizes["y"]
    width = grid.sizes["x"]
    half = max(2, width // 60)
    means = np.array(
        [
            [
                values[height // 2 - half : height // 2 + half, x - half : x + half].mean()
                if values is not None
                else 1.0
                for x in (int((k + 0.5) * width / LAMPS) for k in range(LAMPS))
            ]
            for values in (light, steady)
        ]
    )
    return means[0] / means[1]


def never_lit_percent(model: SensorModel, diode: Any, phases: int) -> float:
    """Return the share of a lamp's phases at which an exposure of `diode` gets no light at all,
    percent.

    Parameters
    ----------
    model : model of the sensor, with its exposure.
    diode : photodiode of the sensor.
    phases : number of phases, evenly spread over a period.
    """
    turns = (np.arange(phases) + 0.5) / phases
    lit = [
        relative_light(Modulation(FREQUENCY_HZ, DUTY, 0.0, turn), 0.0, model.exposure_of(diode)) > 0
        for turn in turns
    ]
    return 100 * (1 - float(np.mean(lit)))


def _judged(level: np.ndarray) -> dict:
    measured = level[np.isfinite(level)]
    return {
        "lamps_seen": int(np.sum(~(level < MISSED))),
        "darkest": float(min(measured, default=np.nan)),
        "brightest": float(max(measured, default=np.nan)),
    }

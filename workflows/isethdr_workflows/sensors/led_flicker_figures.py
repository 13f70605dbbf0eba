"""Figures of the study `led_flicker`: lamps in every capture, and the bands of a rolling
shutter.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.extras import needed
from isethdr_core.plugins.registry import build

from .led_flicker import DUTY, FREQUENCY_HZ, LAMP_CD_M2, PHASES, electrons

if TYPE_CHECKING:
    from isethdr_sensors.sensor_model import SensorModel
    from matplotlib.axes import Axes

ON = "#e0a100"
COLOURS = ("#c0392b", "#2c6fad", "#3a8f4d", "#7d5aa6")
BANDS_HZ = 1000.0
BANDS_DUTY = 0.3


def draw_lamps(shots: dict, path: str) -> None:
    """Draw the lit times of the lamps, the exposures of the captures, the captures, and the merged
    picture.

    Parameters
    ----------
    shots : {name of the sensor: its shot, as `led_flicker.shot` returns it}.
    path : file to write.
    """
    plt = _pyplot()
    longest = max(len(sensor.model().readings) for sensor, *_ in shots.values())
    fig = plt.figure(figsize=(10.5, 2.2 + 1.05 * (longest + 1)), layout="constrained")
    grid = fig.add_gridspec(longest + 2, len(shots), height_ratios=[1.9] + [1] * (longest + 1))
    for column, (name, (sensor, captures, _, picture, _)) in enumerate(shots.items()):
        model = sensor.model()
        _timeline(fig.add_subplot(grid[0, column]), name, model)
        for k, reading in enumerate(model.readings):
            top_e = (float(captures.top_dn[k]) - float(captures.black_dn[k])) / float(
                captures.gain_dn_per_e[k]
            )
            ms = 1e3 * model.exposure_of(model.diode_of(reading))
            _show(
                fig.add_subplot(grid[1 + k, column]),
                electrons(captures, k),
                2.0,
                top_e,
                f"{reading.capture}, {ms:.3g} ms",
            )
        _show(
            fig.add_subplot(grid[1 + longest, column]),
            picture.xyz.sel(xyz_channel="Y").values,
            1.0,
            LAMP_CD_M2,
            "merged picture",
        )
    fig.suptitle(
        f"Five LED lamps of {FREQUENCY_HZ:g} Hz, on for {100 * DUTY:g} % of the time, each with its"
        " own phase",
        fontsize=11,
    )
    fig.savefig(path, dpi=90)
    plt.close(fig)


def _timeline(ax: Axes, name: str, model: SensorModel) -> None:
    for row, phase in enumerate(PHASES):
        starts = (np.arange(-1, 4) - phase) / FREQUENCY_HZ * 1e3
        ax.broken_barh([(s, 1e3 * DUTY / FREQUENCY_HZ) for s in starts], (-row - 1, 0.7), color=ON)
    for row, diode in enumerate(model.photodiodes):
        start = 1e3 * model.exposure_s * diode.start_share
        length = 1e3 * model.exposure_of(diode)
        ax.broken_barh([(start, max(length, 0.06))], (row + 0.15, 0.7), color=COLOURS[row])
        ax.text(
            start - 0.2 if start > 8 else start + 0.3,
            row + 0.5,
            diode.name,
            fontsize=7.5,
            va="center",
            ha="right" if start > 8 else "left",
            color="white" if start < 8 else "black",
        )
    ax.set(xlim=(0, 18), yticks=[], xlabel="ms (first row)", title=name.replace("_", " "))
    ax.set_ylabel("lamps    exposures", fontsize=7)
    ax.tick_params(labelsize=7)


def _show(ax: Axes, values: np.ndarray, low: float, high: float, label: str) -> None:
    scaled = np.log(np.maximum(values, low) / low) / np.log(high / low)
    ax.imshow(scaled, cmap="inferno", vmin=0, vmax=1, interpolation="nearest", aspect="equal")
    ax.text(0.01, 0.94, label, transform=ax.transAxes, color="white", fontsize=8, va="top")
    ax.set_xticks([])
    ax.set_yticks([])


def bands(line_time_s: float, exposure_s: float, phase: float = 0.0) -> np.ndarray:
    """Return electrons (y, x) of a monochrome sensor without noise, for a colour chart under a lamp
    of 1000 Hz that is on for 30 % of the time.

    Parameters
    ----------
    line_time_s : time from row to row, s; 0 for a global shutter.
    exposure_s : exposure time, s.
    phase : phase of the lamp at time 0, periods.
    """
    scene = build(
        "scene", "macbeth", width=240, height=160, horizontal_field_deg=16.0, luminance_cd_m2=100.0
    )()
    flashing = {"sky": {"frequency_hz": BANDS_HZ, "duty": BANDS_DUTY, "phase": phase}}
    light = build("lens", "ideal")(
        build("lighting", "weights", others=1.0, modulation=flashing)(scene)
    )
    sensor = build(
        "sensor", "single", exposure_s=exposure_s, line_time_s=line_time_s, noise=False, bits=0
    )
    return sensor.expected(light).values[0]


def draw_bands(path: str) -> None:
    """Draw a chart under a pulsed lamp with global and rolling shutters, and the light of each row
    divided by that under steady light.
    """
    plt = _pyplot()
    cases = [
        ("global, 0.25 ms, lamp on", 0.0, 2.5e-4, 0.0),
        ("global, 0.25 ms, lamp off", 0.0, 2.5e-4, 0.5),
        ("rolling, 0.25 ms", 22.2e-6, 2.5e-4, 0.0),
        ("rolling, 0.75 ms", 22.2e-6, 7.5e-4, 0.0),
        ("rolling, 1 ms: one period", 22.2e-6, 1e-3, 0.0),
    ]
    fig, axes = plt.subplots(
        2, len(cases), figsize=(12, 4.2), layout="constrained", height_ratios=[1.35, 1]
    )
    for (title, line_time_s, exposure_s, phase), (above, below) in zip(cases, axes.T):
        pulsed = bands(line_time_s, exposure_s, phase)
        steady = bands(0.0, 1e-3) * (exposure_s / 1e-3)
        above.imshow(np.sqrt(pulsed / steady.max() * BANDS_DUTY), cmap="gray", vmin=0, vmax=1)
        above.set_title(title, fontsize=9)
        above.set_xticks([])
        above.set_yticks([])
        below.plot(pulsed.mean(axis=1) / steady.mean(axis=1), lw=1, color="#2c6fad")
        below.set(ylim=(-0.1, 1.1 / BANDS_DUTY), xlabel="row")
        below.axhline(1.0, lw=0.6, color="#999")
        below.tick_params(labelsize=7)
    axes[1, 0].set_ylabel("light of a row over\nthe mean over time", fontsize=8)
    fig.suptitle(
        f"A chart under an LED of {BANDS_HZ:g} Hz, on for {100 * BANDS_DUTY:g} % of the time; 22.2"
        " us from row to row",
        fontsize=11,
    )
    fig.savefig(path, dpi=90)
    plt.close(fig)


def _pyplot() -> ModuleType:
    with needed("a drawing", extra="report"):
        import matplotlib

        matplotlib.use("Agg")
        from matplotlib import pyplot

    return pyplot

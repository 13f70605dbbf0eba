"""EMVA 1288 on simulated cameras: a measurement by the standard must find the parameters of the
simulated camera.

Every linear capture and every channel is measured from its pictures alone: photon transfer, dark
series, stacks for non-uniformity, linearity. Companded codes and soft knees are measured by the
general model (`general`). The results are compared with the sensor's own fields, in units of the
standard error of the estimate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from math import sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_sensors import isethdr_components
from isethdr_sensors.charge.soft_knee import HasSoftKnee
from isethdr_sensors.imaging_sensor import ImagingSensor

from isethdr_core.config.composition import compose
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build
from isethdr_core.seeds import generator

from . import estimates as find
from .camera import Bench, pair, stack
from .dark import DarkSeries, dark_series, pictures_needed
from .general import general_figures

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Sensor
    from isethdr_core.runs.seeds import Generator

LEAST_SIZE = 16  # least side of the pictures, pixels: a few pixels of each filter and the border
# number of levels of the photon transfer series, over the whole range; the standard demands 9
LEVELS = 24
NEAR_THE_END = np.linspace(-4, 4, 17)  # further levels: standard deviations from the scale's end


def emva1288(
    sensor: str = "bayer", size: int = 128, pictures: int = 32, seed: int = 1
) -> list[dict]:
    """Measure a sensor by the standard EMVA 1288, and compare the results with its fields.

    Parameters
    ----------
    sensor : name or preset, as in `isethdr run sensor=...`; `all` takes every sensor with noise.
    size : pixels along each side.
    pictures : number of pictures in a stack. The dark stack has as many as the DSNU needs:
        thousands for low gains.
    seed : seed of the noise.

    Raises
    ------
    ConfigError : the pictures are too small or too few, or the sensor has no noise to measure.
    """
    if size < LEAST_SIZE or pictures < 2:
        raise ConfigError(
            f"size is {size} and pictures is {pictures}; expected at least {LEAST_SIZE} pixels and"
            " 2 pictures; type for example size=128 pictures=32"
        )
    if sensor != "all" and not measurable(chosen(sensor)):
        raise ConfigError(
            f"the sensor {sensor!r} has no noise to measure; expected one with photodiodes and"
            " noise; type for example sensor=bayer"
        )
    names = measurable_sensors() if sensor == "all" else [sensor]
    return [
        {"sensor": name, **row}
        for name in names
        for row in measure(chosen(name), size, pictures, seed)
    ]


def chosen(name: str) -> Any:
    """Return the sensor of a name or preset, with a fixed exposure and with separate readings.

    The standard varies the light at one exposure. It measures readings separately, even if a chip
    combines them.
    """
    from omegaconf import OmegaConf

    fields = OmegaConf.to_container(compose([f"sensor={name}"]).sensor, resolve=True)
    sensor = build("sensor", fields.pop("name"), **fields)
    if not isinstance(sensor, ImagingSensor):
        return sensor
    if sensor.combine_bits:
        sensor = replace(sensor, combine_bits=0, companding=())
    return replace(sensor, exposure_rule="fixed")


def measurable_sensors() -> list[str]:
    """Return the bundled sensors, and their presets, that have noise to measure."""
    presets = [
        f.name.removesuffix(".yaml")
        for f in files("isethdr_sensors.conf").joinpath("sensor").iterdir()
        if f.name.endswith(".yaml")
    ]
    sensors: dict[str, object] = {}
    for name in sorted([c.name for c in isethdr_components()] + presets):
        sensor = chosen(name)
        # presets that only differ in how the chip combines readings count once
        if measurable(sensor) and sensor not in sensors.values():
            sensors[name] = sensor
    return list(sensors)


def measurable(sensor: Sensor) -> bool:
    """Return whether a sensor has photodiodes with noise, which the standard measures."""
    return isinstance(sensor, ImagingSensor) and sensor.noise


def nonlinear(sensor: Sensor) -> bool:
    """Return whether the codes of some capture are nonlinear in light: companded, or beyond a soft
    knee.
    """
    return bool(sensor.companding) or isinstance(sensor, HasSoftKnee)


def linear_captures(sensor: Sensor) -> list[int]:
    """Return the numbers of the captures with codes that are linear in charge, up to the end of the
    well or the converter.
    """
    dark = sensor(Bench(sensor, 0, 0, 550.0, 8, 0).light(0.0), _key(0))
    model = sensor.model()
    ends = [
        r.black_dn + r.gain_dn_per_e * min(model.diode_of(r).full_well_e, r.swing_e)
        for r in model.readings
    ]
    return [
        k
        for k, end in enumerate(ends)
        if "companding_dn" not in dark and dark.top_dn.values[k] > 0.9 * end
    ]


def measure(sensor: Sensor, size: int, pictures: int, seed: int) -> list[dict]:
    """Return one row per capture, channel and figure.

    Parameters
    ----------
    sensor : an `ImagingSensor`.
    size : rows and columns of the pictures.
    pictures : least number of pictures that are averaged for the fixed pattern.
    seed : seed of the noise.
    """
    sensor = replace(sensor, rows=0, columns=0)
    probe = sensor(Bench(sensor, 0, 0, 550.0, size, seed).light(0.0), _key(seed))
    linear = linear_captures(sensor)
    rows = []
    benches = [
        Bench(sensor, k, c, {"R": 600.0, "B": 460.0}.get(str(channel).upper(), 540.0), size, seed)
        for k in range(probe.sizes["capture"])
        for c, channel in enumerate(probe.channel.values)
    ]
    dark_counts = [dark_pictures(bench) for bench in benches if bench.capture in linear]
    unlit = dark_series(benches[0], max(pictures, *dark_counts)) if dark_counts else None
    for bench in benches:
        estimates = [
            *(figures(bench, pictures, unlit) if bench.capture in linear else ()),
            *(general_figures(bench) if nonlinear(sensor) else ()),
        ]
        rows += [
            row(
                str(probe.capture.values[bench.capture]),
                str(probe.channel.values[bench.channel]),
                *figure,
            )
            for figure in estimates
        ]
    return rows


def dark_pictures(bench: Bench) -> int:
    """Return the number of dark pictures that are needed to measure the DSNU of the bench's capture
    and channel; 0 if there is no DSNU, or if rounding hides it.
    """
    truth = true_figures(bench)
    digital = bench.sensor.bits > 0
    noise_dn2 = (truth["gain"] * truth["dark_noise_e"]) ** 2 + find.rounding_dn2(digital)
    if digital and noise_dn2 < find.RESOLVED_DN2:
        return 0
    return pictures_needed(
        noise_dn2, (truth["gain"] * truth["dsnu_e"]) ** 2, len(bench.shot(0.0, 0)[0])
    )


def row(
    capture: str, channel: str, name: str, unit: str, estimate: find.Estimate, true: float
) -> dict:
    """Return one line of the table.

    Parameters
    ----------
    capture, channel : names of both.
    name : name of the figure.
    unit : unit of the figure.
    estimate : measured figure with its standard error.
    true : figure of the model, same unit.
    """
    return {
        "capture": capture,
        "channel": channel,
        "figure": name,
        "unit": unit,
        "found": estimate.value,
        "standard_error": estimate.error,
        "true": true,
        "off_in_errors": float(estimate.off(true)),
        "within": verdict(estimate, true),
    }


def verdict(estimate: find.Estimate, true: float) -> str:
    """Return `yes` if the estimate is within 4 standard errors of the true value, `limit` if the
    true value is below an upper limit, else `NO`.

    Parameters
    ----------
    estimate : measured figure with its standard error.
    true : figure of the model, same unit.
    """
    if estimate.bound:
        return "limit" if true <= estimate.value else "NO"
    return "yes" if abs(estimate.off(true)) <= 4 else "NO"


def figures(bench: Bench, pictures: int, series: DarkSeries) -> Iterator[tuple[Any, ...]]:
    """Yield (figure, unit, estimate, truth) of the bench's capture and channel by the linear model,
    with the camera's dark pictures.

    Parameters
    ----------
    bench : camera, capture, channel and light.
    pictures : number of pictures that are averaged for the fixed pattern at half saturation.
    series : the camera's dark pictures.
    """
    sensor = bench.sensor
    truth = true_figures(bench)
    digital = sensor.bits > 0
    top = (truth["full_well_e"] - truth["dark_e"]) / truth["efficiency"]  # photons
    dark = pair(bench, 0.0)
    near = 1 + NEAR_THE_END / sqrt(truth["full_well_e"])
    pairs = [pair(bench, share * top) for share in (*np.linspace(0.02, 0.9, LEVELS), *near)]
    gain, responsivity = find.gain_and_responsivity(pairs, dark, digital)
    noise = find.dark_noise_e(dark, gain, digital)
    unlit = series.stack(bench.capture, bench.channel)
    half = stack(bench, 0.5 * top, pictures)
    yield "system gain", "DN/e", gain, truth["gain"]
    yield (
        "quantum efficiency",
        "e/photon",
        find.quantum_efficiency(gain, responsivity),
        truth["efficiency"],
    )
    yield "dark noise", "e", noise, truth["dark_noise_e"]
    yield (
        "full well",
        "e",
        find.full_well_e(pair(bench, 3 * top), dark, gain, noise),
        truth["full_well_e"],
    )
    prnu = find.prnu_percent(half, unlit)
    yield (
        "saturation exposure",
        "photons",
        find.saturation_photons(pairs, dark, gain, responsivity, prnu.value),
        top,
    )
    if find.resolved(dark, digital):
        yield "DSNU", "e", find.dsnu_e(unlit, gain, truth["few_draws"]), truth["dsnu_e"]
    yield "PRNU", "%", prnu, truth["prnu_percent"]
    yield (
        "linearity error",
        "%",
        find.linearity_error_percent(pairs, dark),
        truth["linearity_percent"],
    )


def true_figures(bench: Bench) -> dict:
    """Return the true values of the bench's capture and channel from the sensor's own fields, in
    the standard's terms.
    """
    model = bench.sensor.model()
    reading = model.readings[bench.capture]
    diode = model.diode_of(reading)
    dark = float(bench.sensor(bench.light(0.0), _key(0)).dark_e[bench.capture])
    patterns = {
        "pixel": reading.dsnu_e**2 + (dark * diode.dark_spread) ** 2,
        "column": reading.column_e**2,
        "row": reading.row_e**2,
    }
    total = sum(patterns.values())
    few = (
        sqrt(2 * (patterns["column"] ** 2 + patterns["row"] ** 2) / (bench.size / 2)) / total
        if total
        else 0.0
    )
    return {
        "gain": reading.gain_dn_per_e,
        "dark_e": dark,
        "efficiency": bench.efficiency(),
        "dark_noise_e": sqrt(reading.read_noise_e**2 + reading.row_noise_e**2 + dark),
        "full_well_e": min(diode.full_well_e, reading.swing_e),
        "dsnu_e": sqrt(total),
        "few_draws": few,
        "prnu_percent": 100 * diode.prnu,
        "linearity_percent": 0.0,
    }


def _key(seed: int) -> Generator:
    return generator(seed, "bench", "")

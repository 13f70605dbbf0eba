"""EMVA 1288 on simulated cameras: the standard's procedure must find what the camera was made of.

Every linear capture and every channel is measured from its pictures alone: photon transfer, dark series, stacks for non-uniformity,
linearity. What it finds is held against the sensor's own fields, in units of the estimate's standard error.
"""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np

from . import emva1288_estimates as find
from .emva1288_camera import Bench, pair, stack

LEVELS = 24          # of the photon transfer series; the standard asks for at least 9, here over all of the range
FINE = np.linspace(0.93, 1.03, 11)


def emva1288(sensor: str = "bayer", size: int = 128, pictures: int = 32, seed: int = 1) -> list[dict]:
    """Measure a sensor by the machine vision standard and compare with what it was made of.

    Parameters
    ----------
    sensor : name or preset, as in `isethdr run sensor=...`; `all` takes every one that counts electrons linearly.
    size : pixels a side. pictures : of a stack. seed : of the noise.
    """
    names = linear_sensors() if sensor == "all" else [sensor]
    return [{"sensor": name, **row} for name in names for row in measure(chosen(name), size, pictures, seed)]


def chosen(name: str):
    """Return the sensor of that name or preset."""
    from omegaconf import OmegaConf

    from isethdr_core.composition import compose
    from isethdr_core.registry import build

    fields = OmegaConf.to_container(compose([f"sensor={name}"]).sensor, resolve=True)
    return build("sensor", fields.pop("name"), **fields)


def linear_sensors() -> list[str]:
    """Return the sensors of this house and their presets that have noise and captures linear in charge."""
    from importlib.resources import files

    from isethdr_sensors import isethdr_components

    presets = [f.name.removesuffix(".yaml") for f in files("isethdr_sensors.conf").joinpath("sensor").iterdir() if f.name.endswith(".yaml")]
    return [name for name in sorted([c.name for c in isethdr_components()] + presets) if measurable(chosen(name))]


def measurable(sensor) -> bool:
    """Return whether the standard's linear model applies to a capture: noise, a charge well, numbers linear in charge."""
    from isethdr_sensors.imaging_sensor import ImagingSensor

    return isinstance(sensor, ImagingSensor) and sensor.noise and bool(linear_captures(sensor))


def linear_captures(sensor) -> list[int]:
    """Return the captures whose numbers are linear in charge up to where well or converter end."""
    dark, model = sensor(Bench(sensor, 0, 0, 550.0, 8, 0).light(0.0), _key(0)), sensor.model()
    ends = [r.black_dn + r.gain_dn_per_e * min(model.diode_of(r).full_well_e, r.swing_e) for r in model.readings]
    return [k for k, end in enumerate(ends) if "companding_dn" not in dark and dark.top_dn.values[k] > 0.9 * end]


def measure(sensor, size: int, pictures: int, seed: int) -> list[dict]:
    """Return one row per capture, channel and figure."""
    sensor = replace(sensor, rows=0, columns=0)
    probe = sensor(Bench(sensor, 0, 0, 550.0, size, seed).light(0.0), _key(seed))
    rows = []
    for k in linear_captures(sensor):
        capture = probe.capture.values[k]
        for c, channel in enumerate(probe.channel.values):
            for name, unit, found, true in figures(sensor, k, c, str(channel), size, pictures, seed):
                rows.append({"capture": str(capture), "channel": str(channel), "figure": name, "unit": unit, "found": found.value,
                             "standard_error": found.error, "true": true, "off_in_errors": float(found.off(true)),
                             "within": verdict(found, true)})
    return rows


def verdict(found: find.Estimate, true: float) -> str:
    """Return yes within 4 standard errors, limit where an upper limit holds, else NO."""
    if found.bound:
        return "limit" if true <= found.value else "NO"
    return "yes" if abs(found.off(true)) <= 4 else "NO"


def figures(sensor, capture: int, channel: int, letter: str, size: int, pictures: int, seed: int):
    """Yield (figure, unit, estimate, truth) of one capture and channel."""
    wavelength = {"R": 600.0, "B": 460.0}.get(letter.upper(), 540.0)
    bench = Bench(sensor, capture, channel, wavelength, size, seed)
    truth = made_of(sensor, capture, channel, bench)
    digital = sensor.bits > 0
    top = (truth["full_well_e"] - truth["dark_e"]) / truth["efficiency"]  # photons
    dark = pair(bench, 0.0)
    pairs = [pair(bench, share * top) for share in (*np.linspace(0.02, 0.9, LEVELS), *FINE)]
    gain, responsivity = find.gain_and_responsivity(pairs, dark, digital)
    noise = find.dark_noise_e(dark, gain, digital)
    unlit, half = stack(bench, 0.0, pictures), stack(bench, 0.5 * top, pictures)
    yield "system gain", "DN/e", gain, truth["gain"]
    yield "quantum efficiency", "e/photon", find.quantum_efficiency(gain, responsivity), truth["efficiency"]
    yield "dark noise", "e", noise, truth["dark_noise_e"]
    yield "full well", "e", find.full_well_e(pair(bench, 3 * top), dark, gain, noise), truth["full_well_e"]
    yield "saturation capacity", "e", saturation_capacity(pairs, dark, gain), truth["full_well_e"]
    if find.resolved(dark, digital):
        yield "DSNU", "e", find.dsnu_e(unlit, gain, truth["few_draws"]), truth["dsnu_e"]
    yield "PRNU", "%", find.prnu_percent(half, unlit), truth["prnu_percent"]
    yield "linearity error", "%", find.linearity_error_percent(pairs, dark), truth["linearity_percent"]


def saturation_capacity(pairs, dark, gain):
    """Return the standard's capacity: the charge at the peak of the temporal variance, moved to the end of the scale.

    Clipping takes variance away from about 1.5 shot noises below the end; the peak is known to the distance of two levels, and
    to where variances, which grow with the level, cannot be told apart (2 of their errors).
    """
    peak = find.saturation(pairs)
    value = (peak.mean_dn - dark.mean_dn) / gain.value
    spacing = (FINE[1] - FINE[0]) * value
    variances = 8 / peak.pixels * value**2
    return find.Estimate(value + 1.5 * sqrt(value), sqrt((value * gain.error / gain.value) ** 2 + value / 4 + spacing**2 / 3 + variances))


def made_of(sensor, capture: int, channel: int, bench) -> dict:
    """Return what the sensor's own fields say about one capture and channel, in the standard's terms."""
    model = sensor.model()
    reading = model.readings[capture]
    diode = model.diode_of(reading)
    shot = sensor(bench.light(0.0), _key(0))
    dark = float(shot.dark_e[capture])
    patterns = {"pixel": reading.dsnu_e**2 + (dark * diode.dark_spread) ** 2, "column": reading.column_e**2, "row": reading.row_e**2}
    total = sum(patterns.values())
    few = sqrt(2 * (patterns["column"] ** 2 + patterns["row"] ** 2) / (bench.size / 2)) / total if total else 0.0
    efficiency = float(np.interp(bench.wavelength_nm, shot.wavelength.values, shot.quantum_efficiency.values[capture, channel]))
    return {"gain": reading.gain_dn_per_e, "dark_e": dark, "efficiency": efficiency * diode.fill_factor * diode.exposure_share,
            "dark_noise_e": sqrt(reading.read_noise_e**2 + reading.row_noise_e**2 + dark),
            "full_well_e": min(diode.full_well_e, reading.swing_e),
            "dsnu_e": sqrt(total), "few_draws": few, "prnu_percent": 100 * diode.prnu, "linearity_percent": 0.0}


def _key(seed):
    from isethdr_core.seeds import generator

    return generator(seed, "bench", "")

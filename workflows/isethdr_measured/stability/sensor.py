"""Sensors: extreme exposures, gains and wells, one pixel, one row, a lamp smaller than a pixel,
against closed forms.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_isp.readout.captures_check import check_captures
from isethdr_isp.readout.electrons import readouts
from isethdr_sensors.readout.shot import readings

from isethdr_core import generator
from isethdr_core.errors import ConfigError
from isethdr_core.plugins.registry import build

from .inputs import PITCH_UM, irradiance
from .spectra import PLANCK_LIGHT
from .verdict import Measured, relative

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Sensor

GREEN = np.array([550.0])
# photons per second and pixel for an irradiance of 1 W m-2 at 550 nm
PER_W_M2 = 550e-9 / PLANCK_LIGHT * (PITCH_UM * 1e-6) ** 2
FLOAT32 = 2.0**-23


def cases() -> Iterator[tuple[Any, ...]]:
    """Yield (case, measure), with the error class where it is refused."""
    for seconds in (1e-6, 0.016, 3600.0):
        for level in (1e-12, 1e12):
            yield (
                f"{level:g} W m-2 nm-1 for {seconds:g} s: mean electrons",
                lambda v=level, t=seconds: mean(v, t),
            )
    for seconds in (1e-6, 1.0, 3600.0):
        yield f"1e-3 to 1e15 e/s for {seconds:g} s: mean of the counts", lambda t=seconds: counts(t)
    yield "a lamp of a thousandth of a pixel", speck
    for shape in ((1, 1), (1, 200), (200, 1)):
        yield f"{shape[0]} x {shape[1]} pixels", lambda s=shape: frame(*s)
    for gain in (0.01, 110.0, 1e5):
        yield f"{gain:g} uV/e: read back", partial(gain_read_back, gain)
    for gain in (1e-38, 1e-6, 1e6, 3e38):
        yield f"{gain:g} uV/e", partial(gain_read_back, gain), ConfigError
    yield "full well of 3e38 e: read back", lambda: read_back(full_well_e=3e38)
    for well in (1e-38, 1.0):
        yield f"full well of {well:g} e", partial(read_back, full_well_e=well), ConfigError
    yield "24 bits: read back", lambda: read_back(bits=24)
    yield "1 bit: read back", lambda: read_back(bits=1, black_dn=0.0)
    for name in (
        "bayer",
        "rgbw",
        "split_pixel",
        "staggered",
        "dual_gain",
        "interleaved",
        "lofic",
        "lin_log",
    ):
        yield f"{name}, all dark: mean of the noise", lambda n=name: dark(n)
        yield f"{name}, 1e12 W m-2 nm-1: all saturated", lambda n=name: saturated(n)
    yield "an exposure of two hours", lambda: mean(1.0, 7200.0), ConfigError
    yield "a pixel wider than the field", lambda: frame(1, 1, pitch_um=300.0), ConfigError


def _build(name: str, **fields: Any) -> Sensor:
    return build("sensor", name, **fields)


def mean(level: float, seconds: float) -> Measured:
    """Check that the number of photons is the energy over h c / wavelength.

    Parameters
    ----------
    level : irradiance in a band of 1 nm, W m-2 nm-1.
    seconds : exposure time, s.
    """
    sensor = _build("ideal", cfa="W", curves="unit", exposure_s=seconds)
    expected_e = sensor.expected(irradiance(np.full((1, 3, 3), level), GREEN)).values
    return Measured(
        relative(expected_e, level * PER_W_M2 * seconds),
        1e-12,
        "energy / (h c / wavelength), relative",
    )


def counts(seconds: float) -> Measured:
    """Check noisy shots without a converter at every decade of electron rates. The mean count must
    be right, or the pixels must be marked as saturated.
    """
    sensor = _build(
        "single",
        exposure_s=seconds,
        bits=0,
        swing_v=1e20,
        full_well_e=1e38,
        read_noise_e=0.0,
        column_e=0.0,
        prnu=0.0,
        dark_e_per_s=0.0,
    )
    worst = 0.0
    side = 64
    for k in range(-3, 16):
        mean_e = 10.0**k * seconds
        raw, saturated = readings(sensor.model(), [np.full((side, side), mean_e)], generator(5))
        if not np.all(saturated):  # raw is float32
            worst = max(
                worst,
                abs(float(raw.mean(dtype=float)) - mean_e)
                / (5 * math.sqrt(mean_e) / side + 5 / side**2 + FLOAT32 * mean_e),
            )
        elif mean_e < 1e18:
            worst = math.inf
    return Measured(worst, 1.0, "rate times time, share of 5 standard errors")


def speck() -> Measured:
    """Check two lit tiles, each a thousandth of a pixel wide, on both sides of the border of two
    pixels. Each pixel measures its own tile, and no other pixel gets light.
    """
    cube = np.zeros((1, 1000, 3000))
    cube[0, 500, 999:1001] = 1e6, 3e6
    collected_e = (
        _build("ideal", cfa="W", curves="unit")
        .expected(irradiance(cube, GREEN, PITCH_UM / 1000))
        .values[0, 0]
    )
    truth = np.array([1e6, 3e6, 0.0]) * PER_W_M2 * 1e-6 * 0.016
    return Measured(relative(collected_e, truth), 1e-10, "area of the lamp, relative")


def frame(rows: int, columns: int, pitch_um: float = PITCH_UM) -> Measured:
    """Check that each pixel of a small sensor collects the electrons that the closed form gives.

    Parameters
    ----------
    rows, columns : size of the sensor, pixels.
    pitch_um : side of a pixel, um.
    """
    light = irradiance(np.full((1, 2 * rows, 2 * columns), 1e-3), GREEN, PITCH_UM / 2)
    shot = _build(
        "single",
        noise=False,
        bits=0,
        pitch_um=pitch_um,
        peak_qe=1.0,
        infrared_cut=False,
        dark_e_per_s=0.0,
    )(light, None)
    efficiency = float(shot.quantum_efficiency.values[0, 0, 0])
    dn = shot.raw.values[0]
    return Measured(
        relative(dn, 1e-3 * PER_W_M2 * efficiency * 0.016) + (dn.shape != (rows, columns)),
        FLOAT32,
        "energy / (h c / wavelength), relative",
    )


def gain_read_back(gain: float) -> Measured:
    """Check codes at a conversion gain, uV/e. The full scale of the converter in electrons stays
    the same.
    """
    return read_back(conversion_gain_uv_per_e=gain, swing_v=25455 * gain * 1e-6)


def read_back(**fields: Any) -> Measured:
    """Check that codes give the electrons back to within a step of the converter, or are marked as
    saturated.

    Parameters
    ----------
    fields : fields of the sensor `single`.
    """
    sensor = _build("single", noise=False, dark_spread=0.0, prnu=0.0, column_e=0.0, **fields)
    model = sensor.model()
    swing = min(model.readings[0].swing_e, model.photodiodes[0].full_well_e)
    share = np.linspace(0.05, 1.5, 40)
    per_w = float(
        (
            sensor.expected(irradiance(np.ones((1, 2, 2)), GREEN)).values
            - sensor.expected(irradiance(np.zeros((1, 2, 2)), GREEN)).values
        ).max()
    )
    light = irradiance((share * swing / per_w)[None, None, :] * np.ones((1, 2, 1)), GREEN)
    shot = sensor(light, None)
    check_captures(shot)
    [read] = readouts(shot, np.ones(1))
    truth = sensor.expected(light).values[0]
    step = float(shot.quantisation_e.values[0])
    miss = np.where(read.saturated, 0.0, np.abs(read.charge_e - truth))
    hidden = (
        np.any(~read.saturated & (truth > swing * (1 + 1e-6) + step))
        or not np.isfinite(read.charge_e).all()
    )
    return Measured(
        math.inf if hidden else float(miss.max() / swing),
        step / 2 / swing * (1 + 1e-9) + FLOAT32,
        "mean electrons, share of the swing",
    )


def dark(name: str) -> Measured:
    """Check that without light the mean of every capture is black level and dark charge. The error
    is in standard errors of the noise that the capture states.
    """
    shot = _build(name, rows=64, columns=64)(
        irradiance(np.zeros((3, 130, 130)), np.array([450.0, 550.0, 650.0])), generator(3)
    )
    worst = 0.0
    for read, noise, step in zip(
        readouts(shot, np.ones(3)), shot.read_noise_e.values, shot.quantisation_e.values
    ):
        rms = math.sqrt(noise**2 + step**2 / 12 + read.dark_e)
        # fixed patterns add to the error: offsets that columns and rows share, and the spread of
        # the dark charge; they are at most a tenth of the noise, and a step of the converter
        worst = max(
            worst,
            abs(float(read.charge_e.mean()) - read.dark_e)
            / (5 * rms / 64 + 0.1 * rms + 0.05 * read.dark_e + 0.02 * step),
        )
    return Measured(worst, 1.0, "dark charge, share of 5 standard errors and fixed patterns")


def saturated(name: str) -> Measured:
    """Check that every pixel of every capture is marked as saturated, and that every code is
    finite.
    """
    shot = _build(name, rows=16, columns=16)(
        irradiance(np.full((3, 40, 40), 1e12), np.array([450.0, 550.0, 650.0])), generator(3)
    )
    wrong = float(np.mean(~shot.saturated.values)) + float(
        np.mean(~np.isfinite(shot.raw.values.astype(float)))
    )
    return Measured(wrong, 0.0, "share of pixels that do not say they are saturated")

"""Spectra: one, three and three hundred bands, and spectral lines that fall between bands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from isethdr_scenes.charts.chart import band_means
from isethdr_sensors.readout.shot import PLACE_IN_BAND

from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.physics.photometry import luminance
from isethdr_core.plugins.registry import build
from isethdr_core.truth import truth

from .inputs import irradiance
from .verdict import Measured, relative, with_ledger

PLANCK_LIGHT = 6.62607015e-34 * 299792458.0  # J m, exact by definition of the SI


def cases() -> Iterator[tuple[Any, ...]]:
    """Yield (case, measure), with the error class where it is refused."""
    for count in (1, 3, 31, 301):
        yield (
            f"{count} bands: electrons of a sensor that counts photons",
            lambda n=count: photons(n),
        )
        yield f"{count} bands: luminance of a chart", lambda n=count: chart(n)
    for count in (3, 31, 301):
        yield f"{count} bands of daylight: Y after the camera", lambda n=count: camera(n)
    for where in (550.0, 552.5, 555.0):
        yield (
            f"line of 1 nm at {where:g} nm in bands of 10 nm: energy",
            lambda nm=where: line_energy(nm),
        )
    for where in (452.5, 550.0, 552.5, 555.0, 654.9, 684.9):
        for cfa in ("W", "RGGB"):
            yield (
                f"line of 1 nm at {where:g} nm in bands of 10 nm: electrons under {cfa}",
                lambda nm=where, c=cfa: line_photons(nm, c),
            )
    yield "monochromatic light of 555 nm: luminance", monochromatic
    yield "bands that run backwards", backwards, UnitError
    yield "bands of 200 to 300 nm alone", lambda: _white(200.0, 300.0), ConfigError


def _bands(count: int) -> np.ndarray:
    return np.array([550.0]) if count == 1 else np.linspace(400.0, 700.0, count)


def photons(count: int) -> Measured:
    """Check that the number of photons is the sum over the bands of energy over h c / wavelength. A
    single band is 1 nm wide.
    """
    bands = _bands(count)
    sensor = build("sensor", "ideal", cfa="W", curves="unit")
    light = irradiance(np.full((count, 4, 4), 1e-3), bands)
    expected_e = sensor.expected(light).values
    step = 1.0 if count == 1 else 300.0 / (count - 1)
    truth = (
        math.fsum(1e-3 * step * nm * 1e-9 / PLANCK_LIGHT for nm in bands.tolist()) * 9e-12 * 0.016
    )
    return Measured(relative(expected_e, truth), 1e-12, "sum of wavelength / (h c), relative")


def _white(first: float, last: float) -> Any:
    return build("scene", "uniform", first_nm=first, last_nm=last, width=4, height=4).white()


def chart(count: int) -> Measured:
    """Check that a chart has the luminance that it states, for any number of bands."""
    bands = _bands(count)
    step = 300.0 / max(count - 1, 1)
    scene = build(
        "scene",
        "uniform",
        width=4,
        height=4,
        first_nm=float(bands[0]),
        last_nm=float(bands[-1]),
        step_nm=step,
        spectrum="A",
    )()
    luminance_cd_m2 = luminance(scene.radiance.values[0].astype(float), scene.wavelength.values)
    return Measured(
        max(relative(luminance_cd_m2, 100.0), abs(scene.sizes["wavelength"] - count)),
        2.0**-23,
        "100 cd/m2, relative",
    )


def camera(count: int) -> Measured:
    """Check that Y of grey in daylight has at most the error that the isp states."""
    scene = build(
        "scene",
        "uniform",
        width=12,
        height=12,
        horizontal_field_deg=0.6,
        step_nm=300.0 / (count - 1),
    )()
    mixed = build("lighting", "weights", weights={"sky": 1.0})(scene)
    light = build("lens", "ideal")(mixed)
    captures = build("sensor", "bayer", noise=False, bits=0)(light, None)
    picture, row = with_ledger(lambda: build("isp", "linear")(captures))
    stated_error = max(e.value for e in row.errors if e.unit == "relative")
    return Measured(
        relative(picture.xyz.values[..., 1], truth(mixed, picture).xyz.values[..., 1]),
        stated_error,
        "true Y, relative; bound: grey in the worst light",
    )


def line_energy(nm: float) -> Measured:
    """Check that band means keep the energy of a spectral line. They average 20 steps per band."""
    energy = band_means(lambda w: (np.abs(w - nm) < 0.5).astype(float), _bands(31)).sum() * 10.0
    return Measured(abs(energy - 1.0), 1e-9, "1 nm of energy, relative")


def line_photons(nm: float, cfa: str) -> Measured:
    """Check the bound that the sensor states for spectral lines.

    A line away from the middle of its band has another photon energy and another quantum
    efficiency. The sensor states a bound of the resulting error for any line.

    Parameters
    ----------
    nm : wavelength of the line, nm.
    cfa : colour filter array of the sensor.
    """
    bands = _bands(31)
    k, share = divmod((nm - 400.0) / 10.0, 1.0)
    cube = np.zeros((31, 4, 4))
    cube[int(k) if share <= 0.5 else int(k) + 1] = 1e-4
    if share == 0.5:  # a line on the border of two bands: half of it in either band
        cube[int(k) : int(k) + 2] = 0.5e-4
    sensor = build("sensor", "bayer", noise=False, bits=0, cfa=cfa, pitch_um=3.0, dark_e_per_s=0.0)
    light = irradiance(cube, bands)
    captures, row = with_ledger(lambda: sensor(light, None))
    response = captures.quantum_efficiency.values[0] * bands
    # electrons that 1e-3 W m-2 makes at the filters' peak
    at_peak = 1e-3 * 3e-6**2 * 0.016 * 1e-9 / PLANCK_LIGHT * response.max()
    # the same energy in a band of 1 nm at the line itself
    truth = sensor.expected(irradiance(np.full((1, 4, 4), 1e-3), np.array([nm]))).values
    miss = float(np.abs(sensor.expected(light).values - truth).max()) / at_peak
    stated_bound = next(left.bound for left in row.left_out if left.key == PLACE_IN_BAND)
    return Measured(
        miss,
        stated_bound,
        "the line where it is, share of what the same energy makes at the filters' peak",
    )


def monochromatic() -> Measured:
    """Check that one watt at 555 nm, in a single band of 1 nm, is 683 lm."""
    return Measured(
        abs(float(luminance(np.ones(1), np.array([555.0]))) / 683.0 - 1),
        1e-15,
        "683 lm/W, relative",
    )


def backwards() -> Any:
    """Expose a sensor to bands in descending order, which would have negative widths."""
    light = irradiance(np.ones((3, 4, 4)), np.array([650.0, 550.0, 450.0]))
    return build("sensor", "ideal").expected(light)

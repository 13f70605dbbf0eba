"""Counting: the electrons and noise that captures state, compared with an independent
computation.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isqrt

import numpy as np
import xarray as xr

from ..physics.radiometry import photons_per_energy
from ..plugins.protocols import Sensor
from ..runs.seeds import generator
from .promise import close, holds, keeps

BORDER = 4  # pixels that are left out at each edge, because crosstalk is mirrored there
OF_LIGHT = ("f_number", "focal_length_mm", "throughput_sr", "falloff")
DEVICE = {"device": "K", "scene": "kit"}


def check_electrons(
    subject: str, sensor: Sensor, light: xr.DataArray, captures: xr.Dataset
) -> None:
    """Check that the expected electrons follow from quantum efficiency, photodiode area and
    exposure of the captures.

    The light is uniform over the field and increases towards red, so that every filter collects a
    different signal.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    sensor : sensor under test.
    light : (wavelength, y, x) irradiance on the sensor plane, W m-2 nm-1; its largest value sets
        the level.
    captures : captures of the sensor, with the numbers that they state.
    """
    for name in OF_LIGHT:
        promise = f"captures carry {name!r} of the light unchanged"
        holds(
            subject,
            promise,
            captures.attrs[name] == light.attrs[name],
            f"{captures.attrs[name]!r}, the light has {light.attrs[name]!r}",
        )
    wavelength_nm = light.wavelength.values
    has_bands = "wavelength" in captures.coords
    bands_nm: np.ndarray = captures["wavelength"].values if has_bands else np.zeros(0)
    holds(
        subject,
        "captures state 'quantum_efficiency' at the wavelengths of the light",
        np.array_equal(bands_nm, wavelength_nm),
        f"{len(bands_nm)} wavelengths, the light has {len(wavelength_nm)}",
    )
    spectrum = float(light.values.max()) * (0.2 + 0.8 * np.linspace(0, 1, len(wavelength_nm)))
    even = light.copy(
        data=np.broadcast_to(spectrum[:, None, None], light.shape).astype(light.dtype)
    )
    with keeps(subject, "expected(light) returns electrons"):
        expected = sensor.expected(even)
        electrons_of_captures = (
            expected.values.astype(float)
            - sensor.expected(light.copy(data=np.zeros_like(light.values))).values
        )
    units = expected.attrs.get("units")
    holds(subject, "expected has the units 'e', electrons", units == "e", f"it has {units!r}")
    per_area = captures["quantum_efficiency"].values @ (
        spectrum * photons_per_energy(wavelength_nm)
    )
    scale = captures["exposure_s"].values * captures["area_m2"].values
    inner = tuple(
        slice(min(BORDER, n // 4), n - min(BORDER, n // 4)) for n in electrons_of_captures.shape[1:]
    )
    filters = captures["filter"].values[inner]
    for channel in np.unique(filters):
        name = str(captures["channel"].values[channel])
        per_channel = electrons_of_captures[(slice(None), *inner)][:, filters == channel].mean(
            axis=1
        )
        # 1 %: pixels of one channel with different neighbours get different shares of stray light
        promise = (
            "expected electrons are irradiance x photons per joule x quantum_efficiency x area_m2"
            f" x exposure_s of the captures, filter {name!r}"
        )
        close(subject, promise, per_channel, per_area[:, channel] * scale, 1e-2)


def check_filters(subject: str, captures: xr.Dataset) -> None:
    """Check that `filter` repeats the pattern of the attribute `cfa` from the upper left pixel.
    Without `cfa` nothing is checked.
    """
    pattern = captures.attrs.get("cfa")
    if pattern is None:
        return
    rows = _rows(pattern)
    promise = (
        "'filter' is the pattern of the attribute 'cfa', its letters the names of the channels"
    )
    holds(
        subject,
        promise,
        rows,
        f"cfa is {pattern!r}; expected rows of letters parted by /, or a square as RGGB",
    )
    stated_pattern = np.array([list(row) for row in rows])
    filters = captures["filter"].values
    names = captures["channel"].values.astype(str)[filters]
    y, x = np.indices(filters.shape)
    wrong = names != stated_pattern[y % stated_pattern.shape[0], x % stated_pattern.shape[1]]
    if wrong.any():
        at = tuple(map(int, np.argwhere(wrong)[0]))
        expected_names = stated_pattern[
            at[0] % stated_pattern.shape[0], at[1] % stated_pattern.shape[1]
        ]
        holds(
            subject,
            promise,
            False,
            f"pixel {at} has filter {names[at]!r}, cfa={pattern!r} says {str(expected_names)!r}",
        )


def _rows(pattern: str) -> list[str]:
    """Return the rows of a pattern; none if it is not a rectangle."""
    rows = pattern.split("/")
    if len(rows) == 1:
        side = isqrt(len(pattern))
        rows = (
            [pattern[k * side : (k + 1) * side] for k in range(side)]
            if side**2 == len(pattern)
            else []
        )
    return rows if rows and all(rows) and len({len(row) for row in rows}) == 1 else []


def check_scatter(
    subject: str,
    sensor: Sensor,
    light: xr.DataArray,
    read_back: Callable[[xr.Dataset], np.ndarray],
) -> None:
    """Check that shots with different seeds scatter as the captures state: shot noise, read noise
    and the steps of the converter.

    This is checked in darkness and in dim light. The variance of one shot is taken as half the
    variance of the difference of two shots of one device, so that its fixed pattern cancels.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    sensor : sensor under test.
    light : (wavelength, y, x) irradiance of dim light on the sensor plane, W m-2 nm-1.
    read_back : function(captures) -> (capture, y, x) electrons, dark charge included.
    """
    for name, factor in (("darkness", 0.0), ("dim light", 1.0)):
        lit = light.copy(data=light.values * np.float32(factor))
        first, second = (sensor(lit, generator(seed=seed, **DEVICE)) for seed in (7, 8))
        mean = sensor.expected(lit).values.astype(float)
        free = ~(first["saturated"].values | second["saturated"].values)
        difference = read_back(first) - read_back(second)
        for k, capture in enumerate(first["capture"].values.astype(str)):
            use = free[k]
            if use.sum() < 2:
                continue
            step = float(first["quantisation_e"][k])
            noise_e2 = float(mean[k][use].mean()) + float(first["read_noise_e"][k]) ** 2
            stated_e2 = noise_e2 + step**2 / 12
            found_e2, error = _half_mean_square(difference[k], use)
            # six standard errors; where a step is wider than two standard deviations of the noise,
            # rounding can add up to step^2 / 4
            allowed = 6 * max(np.sqrt(2 / use.sum()) * stated_e2, error) + (
                step**2 / 4 if 4 * noise_e2 < step**2 else 0.0
            )
            promise = (
                "shots with other keys scatter by the shot noise, read_noise_e and quantisation_e"
                " that the captures state"
            )
            holds(
                subject,
                promise,
                abs(found_e2 - stated_e2) <= allowed,
                f"variance in {name} of {capture} {found_e2:.4g} e2, stated {stated_e2:.4g} e2,"
                " allowed"
                f" {allowed:.2g} e2",
            )


def _half_mean_square(difference: np.ndarray, use: np.ndarray) -> tuple[float, float]:
    """Return half the mean square of `difference` (y, x) where `use` is true, and its standard
    error.
    """
    squares = np.where(use, difference, 0.0) ** 2 / 2
    errors = []
    for axis in (0, 1):
        count = use.sum(axis=axis)
        means = squares.sum(axis=axis)[count > 0] / count[count > 0]
        errors.append(means.std(ddof=1) / np.sqrt(len(means)) if len(means) > 1 else 0.0)
    return float(squares.sum() / use.sum()), float(max(errors))

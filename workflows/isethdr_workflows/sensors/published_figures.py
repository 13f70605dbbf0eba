"""Published figures: statements of data sheets and papers about sensors and light, compared with
the model.

Each row is computed by the components themselves (a shot, its captures, the merge), not by the
formula behind the figure, unless `how` says closed form. `limit` is the largest difference at which
a row counts as met. A figure with an empty limit is only reported.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_sensors.readout.shot import readings

from isethdr_core.physics.photometry import luminance
from isethdr_core.physics.radiometry import planck_radiance
from isethdr_core.plugins.registry import build
from isethdr_core.quantities import IRRADIANCE, centres, plane
from isethdr_core.seeds import generator

from .published_lofic import lofic_rows

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.plugins.protocols import Sensor

BANDS_NM = np.arange(380.0, 781.0, 5.0)


def published_figures(seed: int = 1) -> list[dict]:
    """Compare the sensors with figures from data sheets and papers.

    Parameters
    ----------
    seed : seed of the noise.
    """
    rows = [
        *ar0132at(seed),
        *split_pixel(seed),
        lofic(seed),
        *(row(*figure) for figure in lofic_rows(seed)),
        photon_budget(),
    ]
    for line in rows:
        line["met"] = (
            ""
            if line["limit"] == ""
            else "yes"
            if abs(line["ours"] - line["published"]) <= line["limit"]
            else "NO"
        )
    return rows


def row(figure: str, published: Any, ours: Any, unit: str, limit: Any, how: str) -> dict:
    """Return one line of the table.

    Parameters
    ----------
    figure : name of the figure.
    published, ours : the published and the simulated figure, in `unit`.
    unit : unit of both.
    limit : largest accepted difference, in `unit`; "": the figure is only reported.
    how : how both were found, as text for readers.
    """
    return {
        "figure": figure,
        "published": published,
        "ours": float(ours),
        "unit": unit,
        "limit": limit,
        "how": how,
    }


def ar0132at(seed: int) -> Iterator[dict[Any, Any]]:
    """Yield rows of the AR0132AT data sheet: largest SNR, responsivity, dynamic range of several
    exposures.
    """
    # the data sheet's SNR is temporal, so it comes from two shots, in which fixed patterns cancel
    yield row(
        "AR0132AT largest SNR",
        43.9,
        largest_snr_db(build("sensor", "bayer"), seed),
        "dB",
        0.3,
        "best of 40 levels, two shots each",
    )
    lux_s = responsivity(build("sensor", "bayer", infrared_cut=False), 2856.0)
    yield row(
        "AR0132AT responsivity, green, 2856 K, no blocking filter",
        5.48,
        lux_s,
        "V/lux-s",
        0.16,
        "sets peak_qe = 0.65, two digits",
    )
    yield row(
        "  the same behind the blocking filter",
        5.48,
        responsivity(build("sensor", "bayer"), 2856.0),
        "V/lux-s",
        "",
        "light not stated",
    )
    yield row(
        "  the same in 6504 K, no blocking filter",
        5.48,
        responsivity(build("sensor", "bayer", infrared_cut=False), 6504.0),
        "V/lux-s",
        "",
        "light not stated",
    )
    yield row(
        "AR0132AT dynamic range of several exposures, at least",
        115.0,
        dynamic_range_db(build("sensor", "staggered"), seed, 0, 2),
        "dB",
        "",
        "ratios of 16, as a manual of its family lists",
    )


def split_pixel(seed: int) -> Iterator[dict[Any, Any]]:
    """Yield rows of the split-pixel sensor: its dynamic range, and the step of its SNR."""
    model = build("sensor", "split_pixel").model()
    large, small = model.photodiodes
    top = small.full_well_e * large.fill_factor / small.fill_factor
    floor = min(r.read_noise_e for r in model.readings)
    yield row(
        "OVT dynamic range",
        119.6,
        20 * np.log10(top / floor),
        "dB",
        0.05,
        "closed form: 790 000 e over 0.83 e",
    )
    bare = build("sensor", "split_pixel", bits=0, dark_e_per_s=(0.0, 0.0))
    yield row(
        "  measured, converter and dark current off",
        119.6,
        dynamic_range_db(bare, seed, 1, 2),
        "dB",
        0.1,
        "saturation of SPLG over rms of dark LPHG",
    )
    yield row(
        "  measured as it is",
        119.6,
        dynamic_range_db(build("sensor", "split_pixel"), seed, 1, 2),
        "dB",
        "",
        "12-bit rounding and dark charge add to 0.83 e",
    )
    yield row(
        "SNR step where the large photodiode gives way",
        20.0,
        snr_step_db(seed),
        "dB",
        0.5,
        "LPLG just below its top against SPLG",
    )


def lofic(seed: int) -> dict[Any, Any]:
    """Return the row of the SNR of the overflow reading, at light of 18 % of the full scale."""
    sensor = build("sensor", "lofic")
    return row(
        "LOFIC 5.6 um, SNR at 18 % of the full scale, at least",
        32.0,
        snr_db(sensor, 0.18 * sensor.full_well_e, seed),
        "dB",
        "",
        "Akahane et al. 2009 state it of an 18 % grey card, of a pixel of this pitch",
    )


def photon_budget() -> dict[Any, Any]:
    """Return the row of the photons of 1 cd/m2 at 555 nm, f/4, on a 3 um pixel in 16 ms."""
    wavelength = np.array([545.0, 555.0, 565.0])
    throughput = np.pi / (1 + 4 * 4.0**2)
    light = irradiance(
        throughput / 683.0 / 10.0 * np.array([0.0, 1.0, 0.0]), wavelength, 3.0, throughput
    )
    counter = build("sensor", "ideal", cfa="W", curves="unit", pitch_um=3.0, exposure_s=0.016)
    return row(
        "photons of 1 cd/m2, f/4, 3 um, 16 ms, 555 nm",
        28.0,
        float(counter.expected(light).mean()),
        "photons",
        0.5,
        "expected electrons at QE 1",
    )


def responsivity(sensor: Sensor, temperature_k: float) -> float:
    """Return the responsivity of the green pixels in black body light, V/lux-s. It is the number of
    electrons for one lux and one second, times the conversion gain.

    Parameters
    ----------
    sensor : an `ImagingSensor` with green pixels.
    temperature_k : temperature of the black body, K.
    """
    spectrum = planck_radiance(BANDS_NM, temperature_k)
    light = irradiance(spectrum / luminance(spectrum, BANDS_NM), BANDS_NM, sensor.pitch_um, 1.0)
    second = replace(sensor, exposure_s=1.0, dark_e_per_s=0.0)
    shot = replace(second, noise=False)(light, None)
    green = shot["filter"].values == list(shot.channel.values).index("G")
    return (
        float(second.expected(light).values[0][green].mean())
        * second.conversion_gain_uv_per_e
        * 1e-6
    )


def irradiance(
    spectrum: np.ndarray,
    wavelength_nm: float,
    pitch_um: float,
    throughput: float,
    size: Any = (8, 8),
) -> xr.DataArray:
    """Return even irradiance (wavelength, y, x) on tiles of one pixel.

    Parameters
    ----------
    spectrum : irradiance (wavelength,), W m-2 nm-1.
    wavelength_nm : centres of the bands (wavelength,), nm.
    pitch_um : side of a tile, um.
    throughput : irradiance per radiance, sr.
    size : rows and columns.
    """
    pitch = pitch_um * 1e-6
    x = centres(size[1], size[1] * pitch)
    y = centres(size[0], size[0] * pitch)
    values = np.broadcast_to(
        np.asarray(spectrum, float)[:, None, None], (len(wavelength_nm), *size)
    )
    return plane(
        values,
        wavelength_nm,
        x,
        y,
        IRRADIANCE,
        f_number=4.0,
        focal_length_mm=4.0,
        throughput_sr=throughput,
        falloff="none",
        field_width=size[1] * pitch,
        field_height=size[0] * pitch,
    )


def snr_db(
    sensor: Sensor, level_e: float, seed: int, capture: int = 0, size: Any = (128, 128)
) -> Any:
    """Return the SNR of one capture, 20 log10(mean / temporal rms), dB; NaN if more than 0.1 % of
    the pixels are saturated.

    Parameters
    ----------
    sensor : an `ImagingSensor`.
    level_e : mean electrons of the capture's photodiode.
    seed : seed of the first of two shots.
    capture : number of the capture.
    size : rows and columns.
    """
    first, second = (electrons(sensor, level_e, capture, s, size) for s in (seed, seed + 1))
    if first[1] or second[1]:
        return np.nan
    return 20 * np.log10(np.mean(first[0]) / (np.std(first[0] - second[0]) / np.sqrt(2)))


def electrons(
    sensor: Sensor, level_e: float, capture: Any, seed: int, size: Any
) -> tuple[Any, Any]:
    """Return the electrons (y, x) from the codes of one capture, and whether more than 0.1 % of the
    pixels are saturated.

    Parameters
    ----------
    sensor : an `ImagingSensor`.
    level_e : mean electrons of every photodiode.
    capture : number of the capture.
    seed : seed of the noise.
    size : rows and columns.
    """
    model = sensor.model()
    reading = model.readings[capture]
    raw, saturated = readings(
        model, [np.full(size, float(level_e)) for _ in model.photodiodes], generator(seed)
    )
    return (raw[capture].astype(float) - reading.black_dn) / reading.gain_dn_per_e, saturated[
        capture
    ].mean() > 1e-3


def largest_snr_db(sensor: Sensor, seed: int) -> float:
    """Return the largest SNR, dB, over levels up to the full well.

    Parameters
    ----------
    sensor : an `ImagingSensor`.
    seed : seed of the noise.
    """
    well = min(sensor.model().photodiodes[0].full_well_e, sensor.model().readings[0].swing_e)
    return float(
        np.nanmax([snr_db(sensor, level, seed) for level in np.linspace(0.9, 1.0, 40) * well])
    )


def snr_step_db(seed: int) -> float:
    """Return the SNR of LPLG just below its top minus that of SPLG in the same light, dB."""
    sensor = build("sensor", "split_pixel")
    large, small = sensor.model().photodiodes
    level = large.full_well_e - 5 * np.sqrt(large.full_well_e)
    return snr_db(sensor, level, seed) - snr_db(
        sensor, level * small.fill_factor / large.fill_factor, seed, capture=2
    )


def dynamic_range_db(sensor: Sensor, seed: int, dark: int, bright: int) -> float:
    """Return 20 log10(light that saturates capture `bright` / rms of capture `dark` in darkness),
    dB. Both are converted to the same scale of light.

    Parameters
    ----------
    sensor : an `ImagingSensor`.
    seed : seed of the noise.
    dark : number of the capture for the dark end.
    bright : number of the capture that saturates last.
    """
    model = sensor.model()
    diodes = [model.diode_of(model.readings[k]) for k in (dark, bright)]
    per_light = [d.fill_factor * d.exposure_share for d in diodes]
    pair = [electrons(sensor, 0.0, dark, s, (128, 128))[0] for s in (seed, seed + 1)]
    top = diodes[1].full_well_e
    highest = next(
        level
        for level in np.linspace(0.98, 1.02, 81) * top
        if np.median(electrons(sensor, level, bright, seed, (64, 64))[0]) >= 0.9995 * top
    )
    return 20 * np.log10(
        highest / per_light[1] / (np.std(pair[0] - pair[1]) / np.sqrt(2) / per_light[0])
    )

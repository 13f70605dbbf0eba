"""Promises of a sensor: expected electrons linear in light, noise with a key for each pixel, and
captures that describe how to read them.
"""

from __future__ import annotations

from dataclasses import is_dataclass, replace
from functools import partial

import numpy as np
import xarray as xr

from ..data.quantities import tile_pitch
from ..pipeline import window
from ..pipeline.demand import Demand
from ..plugins.protocols import DeclaresNoise, HasPixelCounts, HasPixelPitch, NarrowsDemand, Sensor
from ..runs.seeds import generator
from .counting import check_electrons, check_filters, check_scatter
from .inputs import damaged_planes, in_components, irradiance, pattern
from .lazy import same_from_store
from .promise import close, holds, keeps, refuses, repeatable, safe_in_threads, same, stated

DIMS = {
    "raw": 3,
    "saturated": 3,
    "filter": 2,
    "exposure_s": 1,
    "gain_dn_per_e": 1,
    "black_dn": 1,
    "top_dn": 1,
    "read_noise_e": 1,
    "dark_e": 1,
    "quantisation_e": 1,
    "area_m2": 1,
    "charge": 1,
    "quantum_efficiency": 3,
}
# optional variables: differences between devices
SPREADS = ("prnu", "dark_spread_e", "dsnu_e", "column_e", "row_e", "silicon")
ORDER = ("capture", "y", "x")
KEY = generator(seed=7, device="K", scene="kit")
# mean signal of the test field: well above the read noise, well below any full well
SIGNAL_E = 200.0


def check(subject: str, sensor: Sensor) -> None:
    """Check one sensor on a field of 24 x 32 of its own pixels."""
    light = dim_light(subject, sensor)
    shot = repeatable(subject, lambda e: sensor(e, KEY), lambda: light.copy(deep=True))
    check_captures(subject, shot)
    with keeps(subject, "accepts light with components (isethdr_core.data.temporal_modulation)"):
        constant = sensor(in_components(light, frequency_hz=90.0), KEY)
    same(subject, "a component that is always on is light without components", constant, shot)
    mean = repeatable(subject, sensor.expected, lambda: light.copy(deep=True))
    same_from_store(subject, lambda e: sensor(e, KEY), light, shot)
    same_from_store(subject, sensor.expected, light, mean)
    half = light.copy(data=0.5 * light.values)
    safe_in_threads(subject, sensor, [partial(sensor, one, KEY) for one in (light, half)])
    _check_expected(subject, sensor, light, mean, shot)
    check_electrons(subject, sensor, light, shot)
    _check_narrow(subject, sensor, light, mean)
    _check_noise(subject, sensor, light, shot)
    _check_quiet(subject, sensor, light)
    _check_extremes(subject, sensor, light)
    for fault, damaged in damaged_planes(light):
        refuses(subject, fault, partial(sensor, damaged, KEY))
        refuses(subject, fault, partial(sensor.expected, damaged))


def check_captures(subject: str, shot: xr.Dataset) -> None:
    """Check that captures hold all that is needed to read a DN back into light."""
    for name, count in DIMS.items():
        holds(subject, f"captures hold {name!r}", name in shot.data_vars)
        holds(subject, f"{name!r} has {count} dims", shot[name].ndim == count, str(shot[name].dims))
    for name in ("raw", "saturated"):
        holds(
            subject,
            f"{name!r} has the dims {ORDER}",
            shot[name].dims == ORDER,
            str(shot[name].dims),
        )
    holds(subject, "'saturated' is bool", shot["saturated"].dtype == bool)
    holds(
        subject,
        "'quantum_efficiency' has the dims (capture, channel, wavelength)",
        shot["quantum_efficiency"].dims == ("capture", "channel", "wavelength"),
    )
    holds(
        subject,
        "'filter' points into 'channel'",
        0 <= int(shot["filter"].min()) <= int(shot["filter"].max()) < shot.sizes["channel"],
    )
    check_filters(subject, shot)
    for name in ("pitch_um", "f_number", "focal_length_mm", "throughput_sr", "falloff"):
        holds(subject, f"captures carry the attribute {name!r}", name in shot.attrs)
    qe = shot["quantum_efficiency"].values
    holds(
        subject,
        "quantum efficiency lies within 0..1",
        qe.min() >= 0 and qe.max() <= 1,
        f"{qe.min():.3g} to {qe.max():.3g}",
    )
    for name in ("exposure_s", "gain_dn_per_e", "area_m2"):
        holds(
            subject,
            f"{name!r} is finite and above 0",
            np.isfinite(shot[name]).all() and float(shot[name].min()) > 0,
        )
    for name in ("read_noise_e", "dark_e", "quantisation_e"):
        holds(
            subject,
            f"{name!r} is finite, 0 or more",
            np.isfinite(shot[name]).all() and float(shot[name].min()) >= 0,
        )
    for name in SPREADS:
        if name in shot.data_vars:
            holds(
                subject,
                f"{name!r} is one number per capture",
                shot[name].dims == ("capture",),
                str(shot[name].dims),
            )
            holds(
                subject,
                f"{name!r} is finite, 0 or more",
                np.isfinite(shot[name]).all() and float(shot[name].min()) >= 0,
            )
    holds(subject, "top_dn lies above black_dn", bool((shot["top_dn"] > shot["black_dn"]).all()))
    holds(subject, "raw is finite", np.isfinite(shot["raw"].values).all())


def dim_light(subject: str, sensor: Sensor) -> xr.DataArray:
    """Return patterned light on 24 x 32 pixels, or on all pixels of a sensor with a fixed number of
    them, that makes at most `SIGNAL_E` electrons in a pixel.
    """
    pitch_m = 1e-6 * float(sensor.pitch_um if isinstance(sensor, HasPixelPitch) else 3.0)
    rows, columns = (
        (sensor.rows, sensor.columns) if isinstance(sensor, HasPixelCounts) else (None, None)
    )
    height = int(rows or 24)
    width = int(columns or 32)
    tiles = (12, 16)  # coarser than the pixels: sensors integrate constant tiles exactly
    values = 1e-3 * pattern((31, *tiles))
    light = irradiance(values, *tiles, pitch_m * max(height / tiles[0], width / tiles[1]))
    with keeps(subject, "expected(light) returns electrons"):
        bright = float((sensor.expected(light) - sensor.expected(_zero(light))).max())
    holds(subject, "light makes electrons", bright > 0)
    return light.copy(data=np.float32(light.values * (SIGNAL_E / bright)))


def _check_narrow(subject: str, sensor: Sensor, light: xr.DataArray, mean: xr.DataArray) -> None:
    """Check that the bands and tiles that `narrow` drops do not change the expected electrons."""
    _check_window(subject, sensor, light)
    bands = tuple(light.wavelength.values.tolist())
    kept_nm = (
        sensor.narrow(Demand(wavelength_nm=bands)).wavelength_nm
        if isinstance(sensor, NarrowsDemand)
        else bands
    )
    if kept_nm is None or kept_nm == bands:
        return
    with keeps(subject, "needs no band that its narrow drops"):
        part = sensor.expected(light.sel(wavelength=list(kept_nm)))
        # 1e-4: dropped bands have almost no quantum efficiency
        close(subject, "needs no band that its narrow drops", part.values, mean.values, 1e-4)


def _check_window(subject: str, sensor: Sensor, light: xr.DataArray) -> None:
    window_m = sensor.narrow(Demand()).window_m if isinstance(sensor, NarrowsDemand) else None
    if window_m is None:
        return
    bands = light.sizes["wavelength"]
    rows = 2 * light.sizes["y"]
    columns = 2 * light.sizes["x"]
    wide = irradiance(
        light.values.max() * pattern((bands, rows, columns)), rows, columns, tile_pitch(light, "x")
    )
    with keeps(subject, "sees no light beyond the window that its narrow states"):
        part = sensor.expected(window.cut(wide, window.tiles(wide, window_m)))
        # 1e-6: coordinates and electrons in float32
        close(
            subject,
            "sees no light beyond the window that its narrow states",
            part.values,
            sensor.expected(wide).values,
            1e-6,
        )


def _zero(light: xr.DataArray) -> xr.DataArray:
    return light.copy(data=np.zeros_like(light.values))


def _check_expected(
    subject: str, sensor: Sensor, light: xr.DataArray, mean: xr.DataArray, shot: xr.Dataset
) -> None:
    holds(
        subject,
        "expected has the dims (capture, y, x) of raw",
        mean.dims == ORDER and mean.shape == shot["raw"].shape,
    )
    holds(
        subject,
        "expected electrons are finite, 0 or more",
        np.isfinite(mean.values).all() and float(mean.min()) >= 0,
    )
    dark = sensor.expected(_zero(light)).values.astype(float)
    # 1e-6: float32 electrons
    close(
        subject,
        "in darkness expected is dark_e of the captures",
        dark,
        shot["dark_e"].values[:, None, None],
        1e-6,
    )
    # powers of two lose no digit; 1e-5 for sums in float32
    for factor in (0.5, 2.0**20):
        scaled = sensor.expected(light.copy(data=light.values * np.float32(factor))).values.astype(
            float
        )
        close(
            subject,
            "expected is dark charge plus a linear answer to light, without noise or a full well",
            scaled,
            dark + factor * (mean.values - dark),
            1e-5,
        )
    only = light.copy(
        data=light.values * (light.wavelength.values == 550.0)[:, None, None].astype(np.float32)
    )
    holds(
        subject,
        "a green light alone makes electrons",
        float(sensor.expected(only).max()) > dark.max(),
    )


def _check_noise(subject: str, sensor: Sensor, light: xr.DataArray, shot: xr.Dataset) -> None:
    changed = light.copy(deep=True)
    changed[:, :, light.sizes["x"] // 2 :] *= 1.5
    changed_shot = sensor(changed, KEY)
    quarter = shot.sizes["x"] // 4  # half way to the change: crosstalk reaches a few pixels
    same(
        subject,
        "a pixel's noise does not depend on light elsewhere in the frame",
        shot["raw"][..., :quarter],
        changed_shot["raw"][..., :quarter],
    )
    other_shot = stated(subject, lambda: sensor(light, generator(seed=8, device="K", scene="kit")))
    with keeps(subject, "an ideal sensor may be noise-free, a noisy one must follow its generator"):
        noisy = not np.array_equal(_electrons(shot).round(6), _electrons(other_shot).round(6))
    if not noisy:
        return
    mean = sensor.expected(light).values.astype(float)
    free = ~shot["saturated"].values
    residual = np.where(free, _electrons(shot) - mean, 0.0)
    count = np.maximum(free.sum(axis=(1, 2)), 1)
    variance = (
        np.where(free, mean, 0).sum(axis=(1, 2)) / count
        + shot["read_noise_e"].values ** 2
        + shot["quantisation_e"].values ** 2 / 12
    )
    mean_residual = residual.sum(axis=(1, 2)) / count
    # 6 standard errors never happen by chance; 2 % for fixed patterns, because their mean over so
    # few pixels is not 0
    bound = (
        6 * np.sqrt(variance / count)
        + 0.02 * np.abs(mean).mean(axis=(1, 2))
        + 0.5 * shot["quantisation_e"].values
    )
    holds(
        subject,
        "raw, read back into electrons, agrees with expected on average",
        np.all(np.abs(mean_residual) <= bound),
        f"off by {mean_residual.round(3)} e, allowed {bound.round(3)} e",
    )
    check_scatter(subject, sensor, light, _electrons)


def _check_quiet(subject: str, sensor: Sensor, light: xr.DataArray) -> None:
    """Check that a sensor with `noise=False` returns its own mean, up to the steps of its
    converter.
    """
    if not (isinstance(sensor, DeclaresNoise) and isinstance(sensor.noise, bool)):
        return
    quiet: Sensor = sensor
    if sensor.noise and is_dataclass(sensor) and not isinstance(sensor, type):
        quiet = replace(sensor, noise=False)
    shot = quiet(light, KEY)
    same(
        subject,
        "a sensor whose `noise` is False draws the same shot whatever the key",
        quiet(light, generator(seed=8, device="K", scene="kit")),
        shot,
    )
    mean = sensor.expected(light).values.astype(float)
    free = ~shot["saturated"].values
    step = np.broadcast_to(shot["quantisation_e"].values[:, None, None], mean.shape)
    # half a step of rounding; 1e-4 for float32 electrons and a converter's rounding of exact halves
    close(
        subject,
        "without noise, raw read back into electrons is expected",
        _electrons(shot)[free],
        mean[free],
        1e-4,
        0.501 * step[free].max(initial=0.0) + 1e-4,
    )


def _electrons(shot: xr.Dataset) -> np.ndarray:
    """Return electrons, dark charge included, read back from raw as captures say: (linear DN -
    black) / gain.
    """
    column = (slice(None), None, None)
    raw = shot["raw"].values.astype(float)
    if "companding_dn" in shot:
        tables = zip(
            raw, shot["companding_dn"].values, shot["companding_linear_dn"].values, strict=True
        )
        raw = np.stack(
            [
                np.interp(codes, dn[np.isfinite(dn)], linear[np.isfinite(linear)])
                for codes, dn, linear in tables
            ]
        )
    electrons: np.ndarray = raw - shot["black_dn"].values[column]
    electrons /= shot["gain_dn_per_e"].values[column]
    return electrons


def _check_extremes(subject: str, sensor: Sensor, light: xr.DataArray) -> None:
    with keeps(subject, "gives finite captures in complete darkness"):
        check_captures(subject, sensor(_zero(light), KEY))
    huge = light.copy(data=np.full_like(light.values, 1e6))
    with keeps(subject, "gives finite captures in blinding light"):
        blind = sensor(huge, KEY)
        check_captures(subject, blind)
    holds(
        subject,
        "blinding light saturates every pixel of every capture with a converter",
        blind["saturated"].values.all() or not np.isfinite(blind["top_dn"].values).all(),
        f"{blind['saturated'].values.mean():.3f} of them",
    )
    holds(
        subject,
        "darkness saturates no pixel",
        not sensor(_zero(light), KEY)["saturated"].values.any(),
    )

"""Imaging: mixed radiance to irradiance on the sensor plane.

Radiance -> times throughput -> times falloff of its own field angle -> convolution, band by band -> added light of flares.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy.fft as sf

from isethdr_core import ledger, quantities
from isethdr_core.errors import ConfigError, PluginError
from isethdr_core.physics.convolution import convolve_with_bound
from isethdr_core.physics.radiometry import cos4_falloff

from . import kernels as kernel_module
from . import scatter


def image(lens, mixed, flares=()):
    """Return irradiance of `mixed` (wavelength, y, x) through a lens with flares.

    The whole grid takes part, margin included; nothing wraps. The output covers the same tiles, in metres.

    Raises
    ------
    UnitError : when `mixed` is no mixed radiance, or holds negative or non-finite light.
    """
    quantities.check_mixed(mixed)
    _check_projection(mixed)
    wavelength_nm = mixed.wavelength.values.astype(float)
    f_m = 1e-3 * lens.focal_length_mm
    x, y = (mixed[d].values.astype(float) * f_m for d in ("x", "y"))
    pitch_um = tuple(1e6 * f_m * quantities.tile_pitch(mixed, d) for d in ("y", "x"))
    made = _kernels(lens, flares, wavelength_nm, pitch_um, (len(y) - 1, len(x) - 1))
    loss = made.transmitted if made is not None and getattr(lens, "aperture_loss", False) else np.ones(len(wavelength_nm))
    relative = cos4_falloff(x[None, :], y[:, None], f_m) if lens.falloff == "cos4" else 1.0
    values = np.asarray(mixed.values)
    out = np.empty(values.shape, np.result_type(values.dtype, np.float32))

    def one(band):
        light = values[band] * (lens.throughput_sr() * loss[band] * relative)
        if made is None:
            out[band] = light
            return None
        out[band], bound = convolve_with_bound(light, made.ready(band))
        return bound

    with ThreadPoolExecutor(min(kernel_module.cpus(), 8)) as pool, sf.set_workers(1):
        bounds = list(pool.map(one, range(len(wavelength_nm))))
    throughput = lens.throughput_sr() * float(np.mean(loss))
    width, height = mixed.attrs.get("field_width"), mixed.attrs.get("field_height")
    if width is None or height is None:
        width, height = quantities.full_field(mixed)
    light = quantities.plane(
        out,
        wavelength_nm,
        x,
        y,
        quantities.IRRADIANCE,
        f_number=lens.f_number,
        focal_length_mm=lens.focal_length_mm,
        throughput_sr=throughput,
        falloff=lens.falloff,
        field_width=width * f_m,
        field_height=height * f_m,
    )
    for name, d, p in (("pitch_x", "x", pitch_um[1]), ("pitch_y", "y", pitch_um[0])):
        if light.sizes[d] == 1:
            light.attrs[name] = p * 1e-6
    margin = [(n * p * 1e-6 - w * f_m) / 2 / (p * 1e-6) for n, p, w in zip((len(y), len(x)), pitch_um, (height, width))]
    _state(made, bounds, float(np.finfo(out.dtype).eps) / 2, margin)
    return _add(light, lens, mixed, flares)


def _kernels(lens, flares, wavelength_nm, pitch_um, reach):
    """Return kernels, or None where the lens makes no blur and no flare scatters."""
    if hasattr(lens, "zernike_um"):
        return kernel_module.kernels(lens, flares, wavelength_nm, pitch_um, reach)
    for flare in flares:
        if hasattr(flare, "pupil") or hasattr(flare, "pupil_shapes"):
            raise ConfigError(
                f"lens 'ideal' has no pupil for the flare {type(flare).__name__}; expected a lens with diffraction; "
                "set lens=diffraction_limited, or remove that flare"
            )
    if not scatter.active(flares, wavelength_nm):
        return None
    bands = []
    for wave in wavelength_nm:
        point = np.zeros([2 * r + 1 for r in reach])
        point[reach] = 1.0
        bands.append(scatter.mix(point, flares, wave, pitch_um, lens.focal_length_mm).astype(np.float32))
    outside = np.array([1 - float(b.sum(dtype=float)) for b in bands])
    return kernel_module.Kernels(bands, outside, np.zeros(len(bands)), np.ones(len(bands)))


def _add(light, lens, mixed, flares):
    for flare in flares:
        if not hasattr(flare, "irradiance"):
            continue
        added = flare.irradiance(lens, mixed)
        if tuple(added.dims) != light.dims or added.shape != light.shape or added.attrs.get("units") != quantities.IRRADIANCE:
            raise PluginError(
                f"flare {type(flare).__name__} added light with dims {tuple(added.dims)}, shape {added.shape}, units "
                f"{added.attrs.get('units')!r}; expected {light.dims}, {light.shape}, {quantities.IRRADIANCE!r}"
            )
        light.values += added.values
    quantities.check_irradiance(light)
    return light


def _state(made, bounds, rounding, margin):
    """State errors: of kernels, of each band's convolution as it came out, and the `rounding` of the dtype they are kept in.

    `margin` is the (y, x) number of tiles rendered beyond the field on either side.
    """
    if made is None:
        ledger.error(0.0, "relative", "bound", "irradiance of tiles: no blur, a product")
        return
    ledger.error(max(float(made.outside.max()), 0.0), "fraction of energy", "measured", "light spread beyond the rendered frame")
    if made.speckle.max() > 0:
        ledger.error(made.speckle.max(), "relative per tile", "statistical", "speckle of the kernel far from a lamp")
        ledger.error(made.wrap, "relative", "measured", "light too much near the border of the frame, from lamps at the other border")
    ledger.error(max(b.relative for b in bounds) + rounding, "relative", "bound", "convolution of the given kernel")
    if any(b.pixels for b in bounds):
        worst = max(bounds, key=lambda b: b.absolute)
        tiles = max(b.pixels for b in bounds)
        ledger.error(
            worst.absolute,
            quantities.IRRADIANCE,
            "bound",
            f"convolution of up to {tiles} tiles per band, too dark beside the lamps for the row above and too many to sum",
        )
    far = max(
        float(profile[: max(len(profile) // 2 - int(m), 0)].sum()) for both in made.profiles for profile, m in zip(both, margin)
    )
    ledger.left_out(
        "light from beyond the rendered margin", "not in the scene radiance", far, "fraction of a lamp there, into the field"
    )


def _check_projection(mixed):
    projection = mixed.attrs.get("projection", "tangent")
    if projection != "tangent":
        raise ConfigError(
            f"the scene's projection is {projection!r}; expected 'tangent': this lens images tangents of the field angle"
        )

"""Imaging: mixed radiance to irradiance on the sensor plane.

Radiance -> times throughput -> times falloff of its own field angle -> convolution, band by band ->
added light of flares.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import scipy.fft as sf

from isethdr_core import ledger, quantities
from isethdr_core.errors import ConfigError, PluginError
from isethdr_core.physics.convolution import convolve_into
from isethdr_core.uncertainty.error_terms import Quantity

from ..field import retiling
from ..field.imaging import field_kernels
from ..psf import kernels as kernel_module
from ..psf import scatter, wing_truncation
from ..psf.error_parts import FAR_PERIOD, SPECKLE, SPREAD
from ..pupil import band_phase, sampled_pupil
from . import array_backend
from .photoelectron_map import Counted
from .sensor_plane import SensorPlane, sensor_plane, without_geometry
from .spread_errors import fine_enough
from .threads import threads


@dataclass(frozen=True, eq=False)
class Parts:
    """What a lens with flares makes of one field, ready to be applied to its light."""

    sensor: SensorPlane
    made: kernel_module.Kernels | None  # None: no blur
    field: object  # kernels that vary over the field, or None
    gains: np.ndarray  # irradiance per radiance, sr, per band
    relative: np.ndarray | None  # of the tiles, (y, x)
    wavelength_nm: np.ndarray
    pitch_um: tuple[float, float]
    noise_share: float = 0.0  # of the sensor's noise, what the errors of the kernels take
    counted: Counted | None = (
        None  # what the sensor counts of the field's light, where that had to be known
    )


def image(lens, mixed, flares=(), error_allowed: float = 0.0):
    """Return irradiance of `mixed` (wavelength, y, x) through a lens with flares; convolutions are
    right to `error_allowed`, relative.

    The whole grid takes part, margin included; nothing wraps. The output covers the same tiles, in
    metres, or those that a distortion leaves (`sensor_plane`).

    Raises
    ------
    UnitError : when `mixed` is no mixed radiance, or holds negative or non-finite light.
    """
    quantities.check_mixed(mixed)
    return irradiance(lens, mixed, flares, parts(lens, mixed, flares), error_allowed)


def parts(lens, mixed, flares, response=None) -> Parts:
    """Return what the lens makes of the field of checked `mixed`; with a sensor's `response` no
    more than that sensor can tell.
    """
    sensor = sensor_plane(lens, mixed)
    wavelength_nm = mixed.wavelength.values.astype(float)
    f_m = 1e-3 * lens.focal_length_mm
    pitch_um = tuple(1e6 * f_m * quantities.tile_pitch(mixed, d) for d in ("y", "x"))
    plain, asked = (
        without_geometry(lens),
        None if getattr(lens, "field_varies", False) else response,
    )

    found = []  # of all kernels that are made: the last are those that are used

    def make(reach):
        made, *more = fine_enough(
            lambda one: _kernels(one, flares, wavelength_nm, pitch_um, reach),
            plain,
            mixed,
            sensor.relative,
            asked,
        )
        found.append(more)
        return made

    made = wing_truncation.near_kernels(
        make, plain, flares, mixed, sensor, pitch_um, asked
    ) or make(tuple(mixed.sizes[d] - 1 for d in ("y", "x")))
    field = None
    if hasattr(lens, "zernike_um"):
        band_phase.state((plain,), wavelength_nm)
        field = field_kernels(lens, mixed, flares, made, pitch_um)
    loss = (
        made.transmitted
        if made is not None and getattr(lens, "aperture_loss", False)
        else np.ones(len(wavelength_nm))
    )
    relative = sensor.relative if np.ndim(sensor.relative) else None
    return Parts(
        sensor,
        made,
        field,
        lens.gains_sr(wavelength_nm) * loss,
        relative,
        wavelength_nm,
        pitch_um,
        *found[-1],
    )


def irradiance(lens, mixed, flares, given: Parts, error_allowed: float = 0.0):
    """Return irradiance, band by band; arguments as `image`, and what `parts` returned."""
    made, field, gains = given.made, given.field, given.gains
    values, put = np.asarray(mixed.values), array_backend.place()
    out = np.empty(values.shape, np.result_type(values.dtype, np.float32))
    with (
        threads() as apply,
        ThreadPoolExecutor(2) as two,
        sf.set_workers(1),
    ):  # two bands at a time: little memory, and no thread waits
        if field is None:
            bounds = list(
                two.map(
                    lambda b: _band(
                        out[b],
                        values[b],
                        made and made.ready(b),
                        given.relative,
                        gains[b],
                        apply,
                        error_allowed,
                        put,
                    ),
                    range(len(gains)),
                )
            )
        else:
            bounds = apply(
                lambda b: field.spread(
                    out[b], values[b] * (gains[b] * given.sensor.relative), b, error_allowed
                ),
                range(len(gains)),
            )

    def placed(moved):
        return on_sensor(
            lens, given, quantities.plane, moved, given.wavelength_nm, units=quantities.IRRADIANCE
        )

    moved = given.sensor.move(out)
    retiling.state(given.sensor, out, moved, placed)
    light = placed(moved)
    state_kernels(made, mixed, lens, given)
    if made is not None:
        _state_convolution(bounds, float(np.finfo(out.dtype).eps) / 2)
    for added in added_light(lens, mixed, flares, given):
        light.values += added
    quantities.check_irradiance(light)
    return light


def on_sensor(lens, given: Parts, make, values, first, **attrs):
    """Return make(values, first, x, y, ...), light on the sensor plane with the attributes of the
    lens.
    """
    f_m = 1e-3 * lens.focal_length_mm
    throughput_sr = lens.throughput_sr() * float(
        np.mean(given.gains / lens.gains_sr(given.wavelength_nm))
    )  # what flares leave of it, mean of all bands
    light = make(
        values,
        first,
        given.sensor.x * f_m,
        given.sensor.y * f_m,
        f_number=lens.f_number,
        focal_length_mm=lens.focal_length_mm,
        throughput_sr=throughput_sr,
        field_width=given.sensor.field[0] * f_m,
        field_height=given.sensor.field[1] * f_m,
        **given.sensor.attrs,
        **attrs,
    )
    for name, d, p in (("pitch_x", "x", given.pitch_um[1]), ("pitch_y", "y", given.pitch_um[0])):
        if light.sizes[d] == 1:
            light.attrs[name] = p * 1e-6
    return light


def _band(out, light, kernel, relative, gain, apply, error_allowed, put):
    """Write one band's irradiance into `out`; return the bound of its convolution, None where there
    is none.
    """
    if kernel is None:
        out[...] = light * (gain if relative is None else gain * relative)
        return None
    if put:
        return array_backend.convolve_there(put, out, light, kernel, error_allowed, relative, gain)
    return convolve_into(out, light, kernel, error_allowed, factor=relative, gain=gain, apply=apply)


def _nominal(mixed):
    """Return the (height, width) of the camera's field, in the unit of x and y."""
    full = quantities.full_field(mixed)[::-1]
    return [mixed.attrs.get(k) or n for k, n in zip(("field_height", "field_width"), full)]


def _kernels(lens, flares, wavelength_nm, pitch_um, reach):
    """Return kernels, or None where the lens makes no blur and no flare scatters."""
    if hasattr(lens, "zernike_um"):
        return kernel_module.kernels(lens, flares, wavelength_nm, pitch_um, reach)
    for flare in flares:
        if hasattr(flare, "pupil") or hasattr(flare, "pupil_shapes"):
            raise ConfigError(
                f"lens 'ideal' has no pupil for the flare {type(flare).__name__}; expected a lens"
                " with diffraction; set lens=diffraction_limited, or remove that flare"
            )
    if not scatter.active(flares, wavelength_nm):
        return None
    bands = []
    for wave in wavelength_nm:
        point = np.zeros([2 * r + 1 for r in reach])
        point[reach] = 1.0
        bands.append(
            scatter.mix(point, flares, wave, pitch_um, lens.focal_length_mm).astype(np.float32)
        )
    outside = np.array([1 - float(b.sum(dtype=float)) for b in bands])
    return kernel_module.Kernels(bands, outside, np.zeros(len(bands)), np.ones(len(bands)))


def added_light(lens, mixed, flares, given: Parts):
    """Yield the irradiance (wavelength, y, x) that each flare adds, and first what stands for a
    tail that was left out.
    """
    shape = (len(given.wavelength_nm), len(given.sensor.y), len(given.sensor.x))
    if isinstance(given.made, wing_truncation.NearKernels):
        yield (given.made.added * given.gains)[:, None, None]
    for flare in flares:
        if not hasattr(flare, "irradiance"):
            continue
        added = given.sensor.cut(flare.irradiance(lens, given.sensor.covered(mixed)))
        if (
            tuple(added.dims) != quantities.MIXED_DIMS
            or added.shape != shape
            or added.attrs.get("units") != quantities.IRRADIANCE
        ):
            raise PluginError(
                f"flare {type(flare).__name__} added light with dims {tuple(added.dims)}, shape"
                f" {added.shape}, units {added.attrs.get('units')!r}; expected"
                f" {quantities.MIXED_DIMS}, {shape}, {quantities.IRRADIANCE!r}"
            )
        yield added.values


def state_kernels(made, mixed, lens, given: Parts):
    """State the errors of the kernels."""
    if made is None:
        rounding = float(
            np.finfo(np.float32).eps
        )  # of the product, and once more where tiles are moved
        ledger.error(
            rounding,
            "relative",
            "bound",
            "irradiance of tiles: no blur, a product, rounded to float32",
            key="rounding",
        )
        return
    ledger.rest_part(SPREAD)
    if isinstance(made, wing_truncation.NearKernels):
        wing_truncation.state(made)
    else:
        ledger.error(
            max(float(made.outside.max()), 0.0),
            "fraction of energy",
            "measured",
            "light spread beyond the rendered frame",
            key="beyond the frame",
            acts_on=Quantity.POINT_SPREAD,
        )
    for octave, error in enumerate(made.speckle.max(axis=0) if made.speckle.any() else ()):
        if error > 0:
            label = f"speckle of the kernel {2**octave} to {2 ** (octave + 1)} tiles from a lamp"
            ledger.error(error, "relative", "statistical", label, key=SPECKLE, part=SPREAD)
    if getattr(lens, "zernike_um", None):
        ledger.error(
            sampled_pupil.CELLS,
            "fraction of energy",
            "measured",
            "point spread near the axis, from cells of a pupil with a wavefront",
            key="cells of the pupil",
            acts_on=Quantity.POINT_SPREAD,
        )
    if made.wrap:
        label = "kernel near the border of the frame, from the period of its far field"
        ledger.error(made.wrap, "relative", "measured", label, key=FAR_PERIOD, part=SPREAD)
    if given.sensor.stretched:
        _state_drawn_out(given.sensor.stretched)
    margin = mixed.attrs.get("tiles_beyond") or [
        (n - w / p) / 2
        for n, w, p in zip(
            mixed.shape[1:], _nominal(mixed), (quantities.tile_pitch(mixed, d) for d in ("y", "x"))
        )
    ]
    far = max(
        float(profile[: max(len(profile) // 2 - int(m), 0)].sum())
        for both in made.profiles
        for profile, m in zip(both, margin)
    )
    far += max(float(made.outside.max()), 0.0) * (
        isinstance(made, wing_truncation.NearKernels) or "tiles_beyond" in mixed.attrs
    )
    ledger.left_out(
        "light from beyond the rendered margin",
        "not in the scene radiance",
        far,
        "fraction of a lamp there, into the field",
    )


def _state_drawn_out(stretched: float) -> None:
    """State that point spread functions are made for the axis and the reference wavelength, and
    drawn out with the image.

    A kernel k(r) drawn out by s is k(r / s) / s^2. Its wings fall with the cube of r (Airy), so
    that they are wrong by s - 1: an error of the spread light. Light that comes straight keeps its
    place and its sum.
    """
    label = "size of the point spread, drawn out as the image is"
    ledger.error(stretched, "relative", "measured", label, key="point spread size", part=SPREAD)


def _state_convolution(bounds, rounding):
    """State the error of each band's convolution as it came out, and the `rounding` of the dtype
    they are kept in.
    """
    ledger.error(
        max(b.relative for b in bounds) + rounding,
        "relative",
        "bound",
        "convolution of the given kernel",
        key="convolution",
    )
    if any(b.pixels for b in bounds):
        worst = max(bounds, key=lambda b: b.absolute)
        tiles = max(b.pixels for b in bounds)
        ledger.error(
            worst.absolute,
            quantities.IRRADIANCE,
            "bound",
            f"convolution of up to {tiles} tiles per band, too dark beside the lamps for the row"
            " above and too many to sum",
            key="convolution of dark tiles",
        )

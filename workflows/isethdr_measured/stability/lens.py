"""Lenses: light of any level, fast and slow apertures, much defocus, against closed forms."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from isethdr_optics.psf.kernels import KernelRequest, kernels
from scipy.special import eval_jacobi, j0, j1, jv

from isethdr_core.errors import ConfigError, UnitError
from isethdr_core.physics.optics.zernike import order
from isethdr_core.pipeline.memory import Frame, check_run
from isethdr_core.plugins.registry import build

from .convolve import summed
from .inputs import mixed, patchy
from .verdict import Measured, relative, with_ledger

GREEN = np.array([550.0])
ROUNDING = 2.0**-23  # relative error of irradiance: one step of float32
PUPIL = 1e-4  # L1 error of kernel values, as the plugin's `pupil_grid.CORE_SAMPLES` states
# L1 error of kernel values where the pupil is as coarse as a quarter wave per cell allows; no stage
# states a bound, so this is a requirement
WAVEFRONT = 1e-2
ORDERS = 4e-4  # error, share of a point's light, as the plugin's `fine_cells.CELL_ERROR` states
DEFOCUS = (0.5, 5.5, 50.5)  # waves at the rim of the pupil


def cases() -> Iterator[tuple[Any, ...]]:
    """Yield (case, measure), with the error class where it is refused."""
    for level in (1e-12, 1.0, 1e12):
        yield f"ideal lens, {level:g} W m-2 sr-1 nm-1 everywhere", lambda v=level: level_kept(v)
    yield "ideal lens, 1e-12 beside 1e12", beside
    for f_number in (0.7, 4.0, 64.0):
        yield f"f/{f_number:g}: peak of the point spread", lambda n=f_number: peak(n, 0.0)
        yield f"f/{f_number:g}: light of one tile", lambda n=f_number: energy(n)
    for f_number in (100.0, 200.0):
        yield (
            f"f/{f_number:g}: light of one tile, the pattern wider than the frame",
            lambda n=f_number: energy(n),
        )
    yield (
        "129 x 129 tiles of an eighth of a micrometre: light of one",
        lambda: energy(4.0, 129, 0.125),
    )
    for fields in (
        {"f_number": math.inf},
        {"f_number": 1e30},
        {"f_number": 1e-9},
        {"f_number": 1e5},
        {"focal_length_mm": 1e30},
        {"transmittance": 1e-300},
    ):
        ((name, value),) = fields.items()
        yield (
            f"{name} of {value:g}",
            lambda f=fields: _lens("diffraction_limited", **f),
            ConfigError,
        )
    yield "focal length of 4 m: light of one tile", lambda: energy(4.0, focal_length_mm=4000.0)
    for waves in DEFOCUS:
        yield f"{waves:g} waves of defocus: light on the very axis", lambda w=waves: peak(4.0, w)
        yield f"{waves:g} waves of defocus: the pattern", lambda w=waves: pattern(w)
        yield f"{waves:g} waves of defocus: light of the whole pattern", lambda w=waves: spread(w)
    for index in (84, 100, 600):
        yield (
            f"Zernike index {index}, 0.01 um rms: light on the very axis",
            lambda j=index: high_order(j),
        )
    yield "a frame that fits into no memory", too_large, ConfigError
    for name, terms in (
        ("index 1e6", {10**6: 0.05}),
        ("a value that is not a number", {4: math.nan}),
    ):
        yield (
            f"Zernike terms with {name}",
            lambda t=terms: _lens("wavefront", zernike_um=t),
            ConfigError,
        )
    yield "1 beside 1e12 through diffraction", decades
    yield (
        "all dark",
        lambda: Measured(
            float(
                np.abs(
                    _lens("diffraction_limited")(mixed(np.zeros((1, 12, 16)), GREEN)).values
                ).max()
            ),
            0.0,
            "0",
        ),
    )
    for shape in ((1, 1), (1, 40), (40, 1)):
        yield f"{shape[0]} x {shape[1]} tiles through diffraction", lambda s=shape: row(s)
    yield "f/0.3", lambda: _lens("ideal", f_number=0.3), ConfigError
    for name, level in (("negative", -1.0), ("NaN", math.nan), ("infinite", math.inf)):
        yield (
            f"{name} radiance",
            lambda v=level: _lens("ideal")(mixed(np.full((1, 4, 4), v), GREEN)),
            UnitError,
        )


def _lens(name: str, **fields: Any) -> Any:
    return build("lens", name, **fields)


def level_kept(level: float) -> Measured:
    """Check that a uniform scene gives pi / (1 + 4 N^2) cos^4 times its radiance."""
    light = _lens("ideal")(mixed(np.full((1, 9, 9), level, np.float32), GREEN))
    x, y = np.meshgrid(light.x.values / 4e-3, light.y.values / 4e-3)
    truth = float(np.float32(level)) * math.pi / 65 / (1 + x**2 + y**2) ** 2
    return Measured(relative(light.values[0], truth), ROUNDING, "pi / (1 + 4 N^2) cos^4, relative")


def beside() -> Measured:
    """Check that without blur no tile changes another."""
    cube = np.where(np.indices((8, 8)).sum(0) % 2, 1e-12, 1e12)[None].astype(np.float32)
    light = _lens("ideal", falloff="none")(mixed(cube, GREEN))
    return Measured(
        relative(light.values, cube.astype(float) * math.pi / 65),
        ROUNDING,
        "pi / (1 + 4 N^2), relative",
    )


def peak(f_number: float, waves: float) -> Measured:
    """Check the light on the axis: a round pupil of area A gives A / (wavelength distance)^2, times
    sinc^2 of the waves of defocus at its rim.

    Hopkins 1955, "The frequency response of a defocused optical system": the pupil's phase is
    uniform in the square of the radius.

    Parameters
    ----------
    f_number : f-number of the lens.
    waves : defocus at the rim, waves of 550 nm.
    """
    pitch_um = 0.05 * 0.55 * f_number
    on_axis = float(
        _defocused(f_number, waves).psf(550.0, pitch_um, 16, integrated=False).values[0, 8, 8]
    )
    clean = math.pi / 4 * (pitch_um / (0.55 * f_number)) ** 2
    turn = math.pi * waves
    return Measured(
        abs(on_axis / (clean * ((math.sin(turn) / turn) ** 2 if waves else 1.0)) - 1),
        WAVEFRONT if waves > 1 else PUPIL,
        "closed form on the axis, relative",
    )


def _defocused(f_number: float, waves: float) -> Any:
    """Return a lens with a wavefront that is `waves` of 550 nm larger at the rim than in the
    middle. OSA index 4 is sqrt(3) (2 rho^2 - 1).
    """
    if not waves:
        return _lens("diffraction_limited", f_number=f_number)
    return _lens("wavefront", f_number=f_number, zernike_um={4: waves * 0.55 / (2 * math.sqrt(3))})


def high_order(index: int) -> Measured:
    """Check that the light on the axis is the squared mean of the pupil function. The mean over the
    angle is a Bessel function, and the mean over the radius is computed as a sum.
    """
    rms_um = 0.01
    f_number = 4.0
    pitch_um = 0.11
    n, m = order(index)
    node, weight = np.polynomial.legendre.leggauss(600)
    s = (node + 1) / 2  # square of the pupil's radius
    radial = s ** (abs(m) / 2) * eval_jacobi((n - abs(m)) // 2, 0, abs(m), 2 * s - 1)
    phase = 2 * math.pi * rms_um / 0.55 * math.sqrt(n + 1 if m == 0 else 2 * (n + 1)) * radial
    mean = weight / 2 @ (np.exp(1j * phase) if m == 0 else jv(0, phase))
    on_axis = float(
        _lens("wavefront", zernike_um={index: rms_um})
        .psf(550.0, pitch_um, 16, integrated=False)
        .values[0, 8, 8]
    )
    truth = math.pi / 4 * (pitch_um / (0.55 * f_number)) ** 2 * abs(mean) ** 2
    return Measured(
        abs(on_axis / truth - 1), ORDERS, "squared mean of the pupil function, relative"
    )


def too_large() -> None:
    """Check a frame of a million by a million tiles and 31 bands. Its kernels alone would take 500
    TB, so it is refused before they are made.
    """
    frame = Frame(10**6, 10**6, (1e-6, 1e-6), tuple(np.arange(400.0, 701.0, 10.0)), sensed=False)
    check_run(build("scene", "uniform"), None, _lens("diffraction_limited"), (), (), frame)


def pattern(waves: float) -> Measured:
    """Compare the whole pattern with the integral of a defocused round pupil over its radius (Born
    and Wolf, section 8.8), as an L1 error.
    """
    width = 8 * 4.0 * waves * 0.55 + 40.0
    count = 48
    psf = _defocused(4.0, waves).psf(550.0, width / count, count, integrated=False).values[0]
    at = (np.arange(count) - count // 2) * width / count
    radius, ring = np.unique(np.hypot(at[:, None], at).round(9), return_inverse=True)
    node, weight = np.polynomial.legendre.leggauss(1200)
    s = (node + 1) / 2  # square of the pupil's radius
    field = j0(np.pi * radius[:, None] / 2.2 * np.sqrt(s)) @ (
        weight / 2 * np.exp(2j * np.pi * waves * s)
    )
    truth = (np.abs(field) ** 2)[ring].reshape(psf.shape) * math.pi / 4 * (width / count / 2.2) ** 2
    return Measured(
        float(np.abs(psf - truth).sum() / truth.sum()),
        WAVEFRONT if waves > 1 else PUPIL,
        "integral over the pupil's radius, L1",
    )


def spread(waves: float) -> Measured:
    """Check that all light lies within the geometric blur, 8 N W20 wide, except for the light that
    is diffracted at the rim, which is at most that of a lens in focus.
    """
    width = 8 * 4.0 * waves * 0.55
    share = float(
        _defocused(4.0, waves).psf(550.0, (width + 400.0) / 256, 256, integrated=True).values.sum()
    )
    # light that leaves a frame 200 um beyond the blur was diffracted at the rim; it is less than
    # the light of a point in focus at that distance
    lost = beyond(200.0, 4.0)
    return Measured(
        max(share - 1, 1 - lost - share, 0.0),
        PUPIL,
        "1, less what diffraction throws out of the frame",
    )


def beyond(half_um: float, f_number: float) -> float:
    """Return the share of a point's light outside a square at 550 nm. It is J0^2 + J1^2 outside a
    circle (Rayleigh 1881), averaged over all directions.

    Parameters
    ----------
    half_um : half width of the square, um.
    f_number : f-number of the lens.
    """
    angle = (np.arange(20000) + 0.5) / 20000 * math.pi / 4
    v = math.pi * half_um / np.cos(angle) / (0.55 * f_number)
    return float(np.mean(j0(v) ** 2 + j1(v) ** 2))


def energy(
    f_number: float, count: int = 41, tile_um: float = 4.0, focal_length_mm: float = 4.0
) -> Measured:
    """Check that all light of one tile arrives, except for the light that diffraction spreads
    beyond the frame of `count` x `count` tiles.

    Parameters
    ----------
    f_number : f-number of the lens.
    count : tiles along x and y.
    tile_um : side of a tile on the sensor plane, um.
    focal_length_mm : focal length, mm.
    """
    cube = np.zeros((1, count, count), np.float32)
    cube[0, count // 2, count // 2] = 1.0
    lens = _lens(
        "diffraction_limited", f_number=f_number, focal_length_mm=focal_length_mm, falloff="none"
    )
    light = lens(mixed(cube, GREEN, 1e-3 * tile_um / focal_length_mm))
    missing = 1 - float(light.values.sum(dtype=float)) / lens.throughput_sr()
    half_um = count * tile_um / 2
    # the source is one tile wide, so the mean is over its points
    lost = float(np.mean([beyond(half_um + tile_um * (k / 20 - 0.5), f_number) for k in range(21)]))
    return Measured(
        abs(missing - lost), PUPIL, "1 less J0^2 + J1^2 beyond the frame, share of the light"
    )


def decades() -> Measured:
    """Compare a picture through a lens with the direct sum over the lens's own kernel."""
    image = patchy((24, 32)).astype(np.float32)
    image[6, 7] = 1e12
    lens = _lens("diffraction_limited", falloff="none")
    light, row = with_ledger(lambda: lens(mixed(image[None], GREEN)))
    bound = next(e.value for e in row.errors if e.source.key == "convolution")
    kernel = kernels(KernelRequest(lens, (), GREEN, (4.0, 4.0), (23, 31))).bands[0]
    truth = summed(image.astype(float) * (lens.throughput_sr()), kernel.astype(float))
    return Measured(
        relative(light.values[0], truth), bound, "direct sum of its kernel in long double, relative"
    )


def row(shape: tuple[int, int]) -> Measured:
    """Check that a frame of one tile or one row keeps between a third and all of the light."""
    lens = _lens("diffraction_limited", falloff="none")
    light = lens(mixed(np.ones((1, *shape), np.float32), GREEN))
    # a tile of 4 um keeps more than a third of its own light at f/4
    low = float(light.values.min()) / lens.throughput_sr()
    high = float(light.values.max()) / lens.throughput_sr()
    return Measured(
        max(high - 1, 1 / 3 - low, 0.0),
        ROUNDING,
        "between a third and all of the light of a uniform scene",
    )

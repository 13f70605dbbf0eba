"""Scatter: flares spread a part of the light over angles and take it from the sharp image. The
energy is conserved.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.plugins.protocols import ScattersLight

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..flare.aperture import IdealFlare
    from ..flare.haze import HazeFlare


def active(flares: Sequence[Flare], wavelength_nm: float | np.ndarray) -> list:
    """Return the flares that scatter any light at one or more wavelengths, nm."""
    angles = np.geomspace(1e-6, np.pi / 2, 64)
    return [
        f
        for f in flares
        if isinstance(f, ScattersLight)
        and any(np.any(_values(f, w, angles)) for w in np.atleast_1d(wavelength_nm))
    ]


def total(flare: HazeFlare, wavelength_nm: float) -> float:
    """Return the scattered fraction of the light: the integral of 2 pi sin(angle) scatter(angle)
    over the forward hemisphere.
    """
    # logarithmic steps of the angle, because scatter often rises steeply towards the axis
    edges = np.concatenate([[0.0], np.geomspace(1e-6, np.pi / 2, 400)])
    node, weight = np.polynomial.legendre.leggauss(6)
    half = np.diff(edges)[:, None] / 2
    angle = edges[:-1, None] + half * (1 + node)
    return float(
        np.sum(half * weight * 2 * np.pi * np.sin(angle) * _values(flare, wavelength_nm, angle))
    )


def mix(
    kernel: np.ndarray,
    flares: Sequence[Flare],
    wavelength_nm: float,
    pitch_um: tuple[float, float],
    focal_length_mm: float,
) -> np.ndarray:
    """Return a kernel with the scatter of flares.

    Each flare in turn changes the kernel to (1 - scattered fraction) kernel + scatter per sample.

    Parameters
    ----------
    kernel : point spread function (y, x), its axis at index size // 2.
    flares : flares; those that do not scatter change nothing.
    wavelength_nm : wavelength, nm.
    pitch_um : side of a sample along y and x, um.
    focal_length_mm : focal length of the lens, mm.

    Raises
    ------
    ConfigError : a flare scatters all of the light, or a negative or infinite amount.
    """
    for flare in active(flares, wavelength_nm):
        part = total(flare, wavelength_nm)
        if not part < 1:
            raise ConfigError(
                f"flare {type(flare).__name__} scatters {part:.3g} of the light at"
                f" {wavelength_nm:g} nm; expected less than 1"
            )
        spread = _per_sample(flare, wavelength_nm, kernel.shape, pitch_um, focal_length_mm, part)
        kernel = (1 - part) * kernel + spread
    return kernel


def _per_sample(
    flare: HazeFlare,
    wavelength_nm: float,
    shape: tuple[int, int],
    pitch_um: tuple[float, float],
    focal_length_mm: float,
    part: float,
) -> np.ndarray:
    """Return the scatter of a flare integrated over each sample (y, x).

    Near the axis scatter may be steep. Samples there are divided; the axis sample is integrated
    over the radius, so that its share is right for any peak. The sum is limited to `part`.

    Parameters
    ----------
    flare : a flare that scatters light.
    wavelength_nm : wavelength, nm.
    shape : (y, x) number of samples.
    pitch_um : side of a sample along y and x, um.
    focal_length_mm : focal length of the lens, mm.
    part : scattered fraction of the light.
    """
    f = focal_length_mm * 1e3
    x = (np.arange(shape[1]) - shape[1] // 2) * pitch_um[1] / f
    y = (np.arange(shape[0]) - shape[0] // 2) * pitch_um[0] / f
    out = _density(flare, wavelength_nm, x[None, :], y[:, None]) * (
        pitch_um[0] * pitch_um[1] / f**2
    )
    near = 4  # number of samples from the axis within which each sample is divided
    cy = shape[0] // 2
    cx = shape[1] // 2
    rows, cols = (
        np.arange(max(0, c - near), min(n, c + near + 1))
        for c, n in ((cy, shape[0]), (cx, shape[1]))
    )
    fine = 32
    inner = (np.arange(fine) + 0.5) / fine - 0.5
    py = pitch_um[0] / f
    px = pitch_um[1] / f
    ys = (y[rows][:, None] + inner * py).ravel()
    xs = (x[cols][:, None] + inner * px).ravel()
    block = (
        _density(flare, wavelength_nm, xs[None, :], ys[:, None])
        .reshape(len(rows), fine, len(cols), fine)
        .sum((1, 3))
    )
    out[np.ix_(rows, cols)] = block * (px * py / fine**2)
    # The axis sample is its largest inscribed disc, a radial integral, plus its corners, a sum.
    r = min(px, py) / 2
    edges = np.concatenate([[0.0], np.geomspace(1e-9, 1.0, 200)]) * np.arctan(r)
    node, weight = np.polynomial.legendre.leggauss(6)
    half = np.diff(edges)[:, None] / 2
    angle = edges[:-1, None] + half * (1 + node)
    disc = float(
        np.sum(half * weight * 2 * np.pi * np.sin(angle) * _values(flare, wavelength_nm, angle))
    )
    gx = inner * px
    gy = inner[:, None] * py
    corners = _density(flare, wavelength_nm, gx[None, :], gy) * (np.hypot(gx[None, :], gy) > r)
    out[cy, cx] = disc + float(corners.sum()) * px * py / fine**2
    inside = float(out.sum())
    return out if inside <= part else out * (part / inside)


def _density(flare: HazeFlare, wavelength_nm: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return scatter per unit area of the tangent plane, at the tangents `x` and `y` of the angle.
    A unit area there covers the solid angle cos(angle)^3.
    """
    r2 = x**2 + y**2
    return _values(flare, wavelength_nm, np.arctan(np.sqrt(r2))) * (1 + r2) ** -1.5


def _values(flare: HazeFlare | IdealFlare, wavelength_nm: float, angle: np.ndarray) -> np.ndarray:
    values = np.broadcast_to(
        np.asarray(flare.scatter(wavelength_nm, angle), float), np.shape(angle)
    )
    if not np.isfinite(values).all() or values.min() < 0:
        raise ConfigError(
            f"flare {type(flare).__name__} scatters a negative or infinite amount at"
            f" {wavelength_nm:g} nm; expected finite fractions per steradian >= 0"
        )
    return values

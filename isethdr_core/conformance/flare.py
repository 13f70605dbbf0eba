"""Promises of a flare: an aperture removes light, scatter is a probability, added and redirected
light is linear in the scene.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from ..data.quantities import check_irradiance, check_mixed
from ..plugins.protocols import (
    AddsLight,
    Flare,
    Lens,
    RedirectsLight,
    ScattersLight,
    TransmitsPupil,
)
from ..plugins.protocols.by_kind import FLARES
from .inputs import damaged_planes, mixed, some
from .promise import close, holds, keeps, refuses, repeatable, safe_in_threads, same

# a small field of three bands, because kernels of a lens with a new flare take most of the time
field = partial(mixed, height=12, width=16, bands=3)


def _lens() -> Lens:
    """Return a lens with a small pupil: its kernels take a third of the time of those at f/2.8, and
    a flare changes the same share of its light.
    """
    lens: Lens = some("lens", "diffraction_limited", "ideal", f_number=8.0)
    return lens


def check(subject: str, flare: Flare) -> None:
    """Check one flare, alone and in an installed lens."""
    holds(
        subject,
        "has at least one of the methods pupil, scatter, irradiance, redirected",
        isinstance(flare, FLARES),
    )
    if isinstance(flare, TransmitsPupil):
        check_pupil(subject, flare)
    if isinstance(flare, ScattersLight):
        check_scatter(subject, flare)
    if isinstance(flare, AddsLight):
        check_added(subject, flare)
    if isinstance(flare, RedirectsLight):
        check_redirected(subject, flare)
    check_in_lens(subject, flare, isinstance(flare, AddsLight | RedirectsLight))


def check_pupil(subject: str, flare: TransmitsPupil) -> None:
    """Check the complex transmission on a pupil of 1 mm across."""
    axis = np.linspace(-0.5, 0.5, 41)
    x_mm, y_mm = np.meshgrid(axis, axis)
    with keeps(subject, "pupil(x_mm, y_mm, wavelength_nm) returns a complex transmission"):
        transmission = np.asarray(flare.pupil(x_mm, y_mm, 550.0))
        holds(
            subject,
            "pupil has the shape of x_mm",
            transmission.shape == x_mm.shape,
            str(transmission.shape),
        )
        holds(subject, "pupil is finite", np.isfinite(transmission).all())
        # 1e-6: rounding of float32 transmissions
        holds(
            subject,
            "pupil never amplifies",
            np.abs(transmission).max() <= 1 + 1e-6,
            f"{np.abs(transmission).max():.6g}",
        )
        same(
            subject,
            "the same call twice gives the same bits",
            transmission,
            np.asarray(flare.pupil(x_mm, y_mm, 550.0)),
        )


def check_scatter(subject: str, flare: ScattersLight) -> None:
    """Check that scatter, per steradian, integrates to at most all the energy."""
    edges = np.concatenate([[0.0], np.geomspace(1e-7, np.pi / 2, 4001)])
    angle = (edges[1:] + edges[:-1]) / 2
    with keeps(subject, "scatter(wavelength_nm, angle_rad) returns 1/sr"):
        for wavelength_nm in (450.0, 650.0):
            value = np.asarray(flare.scatter(wavelength_nm, angle), float)
            holds(
                subject,
                "scatter has the shape of angle_rad",
                value.shape == angle.shape,
                str(value.shape),
            )
            holds(
                subject,
                "scatter is finite, 0 or more",
                np.isfinite(value).all() and value.min() >= 0,
            )
            total = np.sum(value * 2 * np.pi * (np.cos(edges[:-1]) - np.cos(edges[1:])))
            # 1e-2: midpoint sums over a peak as narrow as 1e-7 rad
            holds(
                subject,
                "scatter integrates to at most 1 over the hemisphere",
                total <= 1.01,
                f"{total:.4g} at {wavelength_nm:g} nm",
            )
            single_angle = np.asarray(flare.scatter(wavelength_nm, angle[100:101]), float)
            close(
                subject,
                "scatter at one angle does not depend on the others",
                single_angle,
                value[100:101],
                1e-12,
            )


def check_added(subject: str, flare: AddsLight) -> None:
    """Check light that a flare adds: irradiance on the lens's grid, linear, never negative."""
    lens = _lens()
    added = repeatable(subject, lambda m: flare.irradiance(lens, m), field)
    with keeps(subject, "irradiance(lens, mixed) returns irradiance"):
        check_irradiance(added)
    double = flare.irradiance(lens, field(2.0 * field().values))
    close(
        subject,
        "added light is linear in radiance",
        double.values,
        2.0 * added.values,
        1e-5,
        1e-5 * float(added.max()),
    )
    for fault, damaged in damaged_planes(field()):
        refuses(subject, fault, partial(flare.irradiance, lens, damaged))


def check_redirected(subject: str, flare: RedirectsLight) -> None:
    """Check the light behind a flare that lies in front of the lens: radiance on the same tiles,
    linear in the scene, and no brighter than a uniform scene.
    """
    lens = _lens()
    left = repeatable(subject, lambda m: flare.redirected(lens, m), field)
    with keeps(subject, "redirected(lens, mixed) returns mixed radiance"):
        check_mixed(left)
    holds(subject, "redirected keeps the tiles", left.shape == field().shape, str(left.shape))
    double = flare.redirected(lens, field(2.0 * field().values))
    close(
        subject,
        "redirected light is linear in radiance",
        double.values,
        2.0 * left.values,
        1e-5,
        1e-5 * float(left.max()),
    )
    even = flare.redirected(lens, field(np.ones(field().shape)))
    # 1e-6: rounding of float32 sums
    holds(
        subject,
        "even light becomes no brighter",
        float(even.max()) <= 1 + 1e-6,
        f"{float(even.max()):.7g}",
    )
    for fault, damaged in damaged_planes(field()):
        refuses(subject, fault, partial(flare.redirected, lens, damaged))


def check_in_lens(subject: str, flare: Flare, adds: bool) -> None:
    """Check a lens with this flare: valid, repeatable, and without more light than the open lens
    unless it adds light.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    flare : flare under test.
    adds : whether the flare adds light or lets it in from beyond the field; the energy is then not
        compared.
    """
    lens = _lens()
    dirty = repeatable(subject, lambda m: lens(m, flares=(flare,)), field)
    with keeps(subject, "a lens with this flare returns irradiance"):
        check_irradiance(dirty)
    lights = (field(), field(0.5 * field().values))
    safe_in_threads(subject, flare, [partial(lens, one, flares=(flare,)) for one in lights])
    if adds:
        return
    clean = lens(field())
    holds(
        subject,
        "throughput is at most that of the open lens",
        dirty.attrs["throughput_sr"] <= clean.attrs["throughput_sr"] * (1 + 1e-6),
    )
    # 1e-4: float32 sums and Fourier transforms
    holds(
        subject,
        "the lens passes no more light than without it",
        float(dirty.sum()) <= float(clean.sum()) * (1 + 1e-4),
        f"{float(dirty.sum()):.6g} > {float(clean.sum()):.6g}",
    )

"""Captures as docs/reference/contracts.md defines them, from known radiance, for tests of isps."""

from __future__ import annotations

import numpy as np
import xarray as xr

from isethdr_core.physics.radiometry import band_widths_nm, cos4_falloff, photon_energy_j
from isethdr_core.quantities import centres, names

WAVELENGTH = np.arange(400.0, 701.0, 10.0)
BAYER = np.array([[0, 1], [1, 2]])
RGBW = np.array([[0, 1], [3, 2]])
QE = np.stack(
    [0.6 * np.exp(-(((WAVELENGTH - c) / s) ** 2) / 2) for c, s in ((605, 32), (540, 36), (460, 28))]
)
QE_W = np.concatenate([QE, 0.75 * np.ones((1, len(WAVELENGTH)))])
# Three captures of a split pixel: the large photodiode at two gains (one charge), and a small
# photodiode with 1/100 of its area. top_e and read in e.
SPLIT = [
    {"name": "LPLG", "charge": 0, "top_e": 22000.0, "read": 3.05},
    {"name": "LPHG", "charge": 0, "top_e": 5390.0, "read": 0.83},
    {"name": "SPLG", "charge": 1, "top_e": 7900.0, "read": 0.83, "area": 0.01},
]
ONE = [{"name": "A", "charge": 0, "top_e": 1e9, "read": 2.0}]


def electrons_per_radiance(
    spec=ONE[0], qe=QE, exposure_s=0.016, pitch_um=3.0, throughput_sr=np.pi / 65
):
    """Return the electrons per unit of band mean radiance (W m-2 sr-1 nm-1) on the axis, as
    (channel, wavelength). The computation is independent of the isp.
    """
    area = (pitch_um * 1e-6) ** 2 * spec.get("area", 1.0)
    return (
        np.asarray(spec.get("qe", qe))
        * band_widths_nm(WAVELENGTH)
        / photon_energy_j(WAVELENGTH)
        * exposure_s
        * area
        * throughput_sr
    )


def make(  # noqa: PLR0913 - a helper of tests
    mean_e,
    specs=ONE,
    pattern=BAYER,
    qe=QE,
    rng=None,
    step_e=0.0,
    black=64.0,
    dark=0.0,
    falloff="none",
    focal=4.0,
):
    """Return captures of given mean charges, with noise if `rng` is given.

    Parameters
    ----------
    mean_e : mean photoelectrons (y, x) of a photodiode of full area, e, without dark charge.
    specs : one dictionary per capture, as in `SPLIT`.
    pattern : cell of the filter array, numbers of channels.
    qe : quantum efficiency (channel, wavelength) at `WAVELENGTH`.
    rng : generator of shot noise and read noise; None adds no noise.
    step_e : step of the converter, e; 0 leaves the values unrounded, at 0.5 DN per e.
    black : black level, DN.
    dark : mean dark charge of each capture, e.
    falloff : falloff that the captures state; it is not applied to `mean_e`.
    focal : focal length that the captures state, mm.
    """
    ny, nx = np.shape(mean_e)
    filters = np.tile(pattern, (ny // pattern.shape[0] + 1, nx // pattern.shape[1] + 1))[:ny, :nx]
    charges = {}
    raw = []
    saturated = []
    gains = []
    for s in specs:
        mean = mean_e * s.get("area", 1.0) + dark
        if s["charge"] not in charges:
            full = max(o["top_e"] for o in specs if o["charge"] == s["charge"])
            charges[s["charge"]] = np.minimum(rng.poisson(mean) if rng else mean, full)
        e = charges[s["charge"]] + (s["read"] * rng.standard_normal(mean.shape) if rng else 0.0)
        e = np.minimum(e, s["top_e"])
        gain = 1 / step_e if step_e else 0.5
        dn = black + (np.rint(e * gain) if step_e else e * gain)
        raw.append(dn)
        saturated.append(e >= s["top_e"])
        gains.append(gain)
    n = len(specs)
    column = lambda value: ("capture", np.broadcast_to(np.asarray(value, float), (n,)).copy())
    pitch = 3.0
    area = [(pitch * 1e-6) ** 2 * s.get("area", 1.0) for s in specs]
    return xr.Dataset(
        {
            "raw": (("capture", "y", "x"), np.array(raw)),
            "saturated": (("capture", "y", "x"), np.array(saturated)),
            "filter": (("y", "x"), filters.astype(np.uint8)),
            "exposure_s": column(0.016),
            "gain_dn_per_e": column(gains),
            "black_dn": column(black),
            "top_dn": column([black + s["top_e"] * g for s, g in zip(specs, gains)]),
            "read_noise_e": column([s["read"] for s in specs]),
            "dark_e": column(dark),
            "quantisation_e": column(step_e),
            "area_m2": column(area),
            "charge": ("capture", np.array([s["charge"] for s in specs])),
            "quantum_efficiency": (
                ("capture", "channel", "wavelength"),
                np.array([s.get("qe", qe) for s in specs]),
            ),
        },
        coords={
            "capture": names(s["name"] for s in specs),
            "channel": names("RGBW"[: len(qe)]),
            "wavelength": WAVELENGTH,
            "x": centres(nx, nx * pitch * 1e-6),
            "y": centres(ny, ny * pitch * 1e-6),
        },
        attrs={
            "pitch_um": pitch,
            "cfa": "test",
            "f_number": 4.0,
            "focal_length_mm": focal,
            "throughput_sr": np.pi / 65,
            "falloff": falloff,
        },
    )


def mosaic_of(radiance, shape, pattern=BAYER, qe=QE, falloff=None, focal=4.0):
    """Return the noise-free electrons (y, x) of pixels that all see one spectrum of radiance, in
    W m-2 sr-1 nm-1.
    """
    per_channel = electrons_per_radiance(qe=qe) @ radiance
    tiles = np.tile(pattern, (shape[0] // pattern.shape[0] + 1, shape[1] // pattern.shape[1] + 1))[
        : shape[0], : shape[1]
    ]
    out = per_channel[tiles]
    if falloff == "cos4":
        x, y = (centres(n, n * 3e-6) for n in shape[::-1])
        out = out * cos4_falloff(x[None], y[:, None], focal * 1e-3)
    return out

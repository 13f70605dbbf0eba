"""Readings: whether an isp interprets captures as they state, keeps places and colours, and states
the variance of its pictures.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..physics.photometry import xyz_bar
from ..plugins.protocols import Isp
from .inputs import bands_nm
from .promise import close, holds

SHOTS = 4
INNER = slice(2, -2)  # without 2 pixels at each edge, where demosaicing has fewer neighbours


class MakesCaptures(Protocol):
    """A function that returns captures of light with a spectrum (31,) of any scale, through filters
    with the responses of X, Y and Z.
    """

    def __call__(self, layout: str, *, spectrum: npt.ArrayLike) -> xr.Dataset: ...


def check_readings(subject: str, isp: Isp, grey: xr.Dataset, luminance_cd_m2: np.ndarray) -> None:
    """Check that the same light gives the same luminance if the captures state another gain, black
    level, area, throughput or quantum efficiency.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    isp : isp under test.
    grey : captures whose `raw` is at most half of their top code.
    luminance_cd_m2 : (y, x) luminance that the isp computes from `grey`, cd/m2.
    """
    raw = grey["raw"].values.astype(float)
    black = float(grey["black_dn"][0])

    def other(
        factor: float,
        offset: float = 0.0,
        attributes: Iterable[tuple[str, float]] = (),
        **scaled: float,
    ) -> xr.Dataset:
        codes = np.rint(black + offset + factor * (raw - black)).astype(grey["raw"].dtype)
        changed = {name: grey[name] * value for name, value in scaled.items()}
        levels = {name: grey[name] + offset for name in ("black_dn", "top_dn")}
        changed_captures = grey.assign({"raw": grey["raw"].copy(data=codes), **levels}).assign(
            changed
        )
        return changed_captures.assign_attrs(
            {name: grey.attrs[name] * value for name, value in attributes}
        )

    cases = {
        "gain_dn_per_e": other(0.5, gain_dn_per_e=0.5, quantisation_e=2.0),
        "black_dn": other(1.0, offset=100.0),
        "area_m2": other(0.5, area_m2=0.5),
        "throughput_sr": other(0.5, attributes=[("throughput_sr", 0.5)]),
        "quantum_efficiency": other(0.5, quantum_efficiency=0.5),
    }
    for name, captures in cases.items():
        # 1 %: raw is rounded to whole DN
        promise = (
            f"reads {name!r} from the captures: the same light in other numbers has the same"
            " luminance"
        )
        close(subject, promise, isp(captures)["xyz"].values[..., 1], luminance_cd_m2, 0.01)


def check_place(subject: str, isp: Isp, grey: xr.Dataset) -> None:
    """Check that light in one quarter of the captures is in the same quarter of the picture, not
    mirrored, turned or shifted.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    isp : isp under test.
    grey : captures of a uniform field.
    """
    black = float(grey["black_dn"][0])
    x = grey["x"].values
    y = grey["y"].values
    lit = (x > 0.0) & (y[:, None] < 0.0)  # right, and up: y points down
    codes = np.rint(black + np.where(lit, 1.0, 0.1) * (grey["raw"].values - black)).astype(
        grey["raw"].dtype
    )
    picture = isp(grey.assign(raw=grey["raw"].copy(data=codes)))
    light = picture["xyz"].values[..., 1]
    inside = (picture["x"].values > 0.0) & (picture["y"].values[:, None] < 0.0)
    ratio = float(light[~inside].mean() / light[inside].mean())
    # the exact ratio is 0.1; demosaicing and denoising spread some light over the border
    holds(
        subject,
        "light up and to the right stays there (x right, y down)",
        ratio < 0.3,
        f"the rest of the picture has {ratio:.2g} of its luminance; expected about 0.1",
    )


def check_colour(subject: str, isp: Isp, layout: str, make: MakesCaptures) -> None:
    """Check X and Z of reddish and of bluish light.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    isp : isp under test.
    layout : layout of the captures, `mosaic` or `full`.
    make : function(layout, spectrum=...) that returns captures through filters with the responses
        of X, Y and Z.
    """
    nm = bands_nm(31)
    for name, slope in (("reddish", 0.8), ("bluish", -0.8)):
        spectrum = 1 + slope * np.linspace(-1, 1, len(nm))
        want = xyz_bar(nm) @ spectrum
        picture = isp(make(layout, spectrum=spectrum))["xyz"].values
        mean_xyz = picture.reshape(-1, 3).mean(axis=0)
        # 10 %: a colour matrix may trade accurate colour for less noise
        close(
            subject,
            f"{name} light has its X and Z beside Y (xyz_channel in this order)",
            mean_xyz / mean_xyz[1],
            want / want[1],
            0.1,
        )


def check_variance(subject: str, isp: Isp, grey: xr.Dataset) -> None:
    """Check the stated variance against the variance between pictures of several shots with
    independent noise.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    isp : isp under test.
    grey : noise-free captures of a uniform field.
    """
    random = np.random.default_rng(20261)
    gain = float(grey["gain_dn_per_e"][0])
    black = float(grey["black_dn"][0])
    mean_e = (grey["raw"].values.astype(float) - black) / gain
    pictures = []
    stated_variance = []
    for _ in range(SHOTS):
        electrons = random.poisson(mean_e) + random.normal(
            0.0, float(grey["read_noise_e"][0]), mean_e.shape
        )
        codes = np.rint(black + gain * electrons).astype(grey["raw"].dtype)
        picture = isp(grey.assign(raw=grey["raw"].copy(data=codes)))
        pictures.append(picture["xyz"].values[INNER, INNER])
        stated_variance.append(picture["variance"].values[INNER, INNER].mean(axis=(0, 1)))
    # a method that depends on the noise may state an unknown variance
    if np.isnan(stated_variance).all():
        return
    sample_variance = np.var(pictures, axis=0, ddof=1).mean(axis=(0, 1))
    ratio = np.mean(stated_variance, axis=0) / np.maximum(sample_variance, np.finfo(float).tiny)
    # a factor of 3: denoising, and demosaicing that follows edges, cannot state their own variance
    # more accurately
    promise = (
        "the variance it states is that of its pictures of the same scene, within a factor of 3"
    )
    holds(
        subject,
        promise,
        np.all((ratio > 1 / 3) & (ratio < 3)),
        f"stated over found of X, Y, Z: {ratio.round(2)}",
    )

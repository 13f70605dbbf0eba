"""Promises of an isp: absolute luminance from captures alone, estimates without clipping, and
correct validity.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
import numpy.typing as npt
import xarray as xr

from ..data.quantities import centres, names
from ..data.reference_picture import FIXED_PATTERN, check_developed, total_variance, variance_known
from ..errors import IsetHdrError
from ..physics.photometry import luminance, xyz_bar
from ..physics.radiometry import band_widths_nm, photon_energy_j
from ..plugins.protocols import Isp
from .inputs import F_NUMBER, FOCAL_LENGTH_MM, THROUGHPUT_SR, bands_nm, pattern
from .isp_readings import check_colour, check_place, check_readings, check_variance
from .lazy import same_from_store, sealed
from .promise import close, holds, keeps, refuses, repeatable, safe_in_threads, stated

GAIN_DN_PER_E = 0.5
BLACK_DN = 64.0
TOP_DN = 4000.0
PITCH_UM = 3.0
GREY_CD_M2 = 100.0


def check(subject: str, isp: Isp) -> None:
    """Check one isp on captures of a grey field, in the layout it reads: a colour filter array, or
    every channel at every pixel.
    """
    layout = _layout(subject, isp)
    grey = captures(layout)
    picture = repeatable(subject, isp, lambda: captures(layout))
    _check_picture(subject, picture, grey)
    same_from_store(subject, isp, grey, picture)
    y = picture["xyz"].values[..., 1]
    holds(subject, "unsaturated pixels are valid", picture["valid"].values.all())
    # 5 %: a colour matrix may trade accurate colour for less noise, and may assume another white
    # than this equal-energy light
    close(subject, "a grey field of 100 cd/m2 comes back as 100 cd/m2", y, GREY_CD_M2, 0.05)
    half = captures(layout, exposure_s=0.005)
    safe_in_threads(subject, isp, [partial(isp, grey), partial(isp, half)])
    if variance_known(picture):
        holds(subject, "noise gives variance above 0", float(picture["variance"].min()) > 0)
    shorter = stated(subject, lambda: isp(half))
    # 1 %: raw is rounded to whole DN, and the half exposure has half of them
    close(
        subject,
        "half the exposure gives the same luminance",
        shorter["xyz"].values[..., 1],
        y,
        0.01,
    )
    check_readings(subject, isp, grey, y)
    check_place(subject, isp, grey)
    check_colour(subject, isp, layout, captures)
    check_variance(subject, isp, grey)
    _check_dark(subject, isp, layout)
    _check_saturated(subject, isp, layout)
    for fault, damaged in damaged_captures(grey):
        refuses(subject, fault, partial(isp, damaged))


def captures(
    layout: str = "mosaic",
    level: float = GREY_CD_M2,
    exposure_s: float = 0.01,
    spectrum: npt.ArrayLike | None = None,
) -> xr.Dataset:
    """Return noise-free captures of a uniform field.

    The filters respond in proportion to the colour matching functions, so that colour can be read
    back exactly.

    Parameters
    ----------
    layout : `mosaic`: one capture under a 2 x 2 array of three filters. `full`: three captures,
        each of one filter at every pixel.
    level : luminance of the field, cd/m2.
    exposure_s : exposure time, s.
    spectrum : (31,) spectrum of the light, any scale; None: equal energy.
    """
    nm = bands_nm(31)
    height = 16
    width = 24
    per_photon = xyz_bar(nm) / nm
    qe = 0.6 * per_photon / per_photon.max(axis=1, keepdims=True)
    area = (PITCH_UM * 1e-6) ** 2
    shape = np.ones(31) if spectrum is None else np.asarray(spectrum, float)
    radiance = shape * (level / luminance(shape, nm))
    photons = (
        radiance * band_widths_nm(nm) / photon_energy_j(nm) * THROUGHPUT_SR * area * exposure_s
    )
    electrons = qe @ photons
    if layout == "mosaic":
        filters = np.tile([[0, 1], [1, 2]], (height // 2, width // 2)).astype(np.uint8)
        mean = electrons[filters][None]
        channels = ["X", "Y", "Z"]
        capture = ["single"]
        efficiency = qe[None]
    else:
        filters = np.zeros((height, width), np.uint8)
        mean = np.broadcast_to(electrons[:, None, None], (3, height, width))
        channels = ["all"]
        capture = ["X", "Y", "Z"]
        efficiency = qe[:, None, :]
    raw = np.rint(np.clip(BLACK_DN + GAIN_DN_PER_E * mean, 0, TOP_DN + 1)).astype(np.uint16)
    levels = {
        "exposure_s": exposure_s,
        "gain_dn_per_e": GAIN_DN_PER_E,
        "black_dn": BLACK_DN,
        "top_dn": TOP_DN,
        "read_noise_e": 3.0,
        "dark_e": 0.0,
        "quantisation_e": 1 / GAIN_DN_PER_E,
        "area_m2": area,
    }
    count = len(capture)
    return xr.Dataset(
        {
            "raw": (("capture", "y", "x"), raw, {"units": "DN"}),
            "saturated": (("capture", "y", "x"), raw > TOP_DN),
            "filter": (("y", "x"), filters),
            "charge": ("capture", np.arange(count)),
            "quantum_efficiency": (("capture", "channel", "wavelength"), efficiency),
            **{name: ("capture", np.full(count, value)) for name, value in levels.items()},
        },
        coords={
            "capture": names(capture),
            "channel": names(channels),
            "wavelength": nm,
            "y": centres(height, height * PITCH_UM * 1e-6),
            "x": centres(width, width * PITCH_UM * 1e-6),
        },
        attrs={
            "pitch_um": PITCH_UM,
            "cfa": "XY/YZ" if layout == "mosaic" else "W",
            "f_number": F_NUMBER,
            "focal_length_mm": FOCAL_LENGTH_MM,
            "throughput_sr": THROUGHPUT_SR,
            "falloff": "none",
        },
    )


def damaged_captures(valid: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield (mistake, captures) for the possible mistakes in captures. Values are sealed if the
    form of the data already shows the mistake.
    """
    yield "raw that holds NaN", valid.assign(raw=valid["raw"].astype(float).where(valid["x"] > 0))
    valid = sealed(valid, "raw", "saturated")
    yield "an empty Dataset", xr.Dataset()
    for name in ("raw", "saturated", "filter", "gain_dn_per_e", "black_dn", "quantum_efficiency"):
        yield f"captures without {name!r}", valid.drop_vars(name)
    yield "raw with other dims", valid.assign(raw=valid["raw"].transpose("y", "x", "capture"))
    yield "captures without pixels", valid.isel(x=[])
    yield "captures without a focal length", _without(valid, "focal_length_mm")


def _without(captures: xr.Dataset, attribute: str) -> xr.Dataset:
    copied = captures.copy()
    copied.attrs = {k: v for k, v in captures.attrs.items() if k != attribute}
    return copied


def _layout(subject: str, isp: Isp) -> str:
    refused = []
    for layout in ("mosaic", "full"):
        try:
            isp(captures(layout))
            return layout
        except IsetHdrError as err:
            refused.append(f"{layout}: {err}")
    holds(
        subject,
        "reads a colour filter array, or captures of one channel each",
        False,
        "; ".join(refused),
    )
    return ""


def _check_picture(subject: str, picture: xr.Dataset, grey: xr.Dataset) -> None:
    with keeps(subject, "returns a picture"):
        check_developed(picture, "the picture")
    for name in ("focal_length_mm", "pitch_um"):
        holds(subject, f"the picture carries the attribute {name!r}", name in picture.attrs)
    holds(subject, "valid is bool", picture["valid"].dtype == bool)
    holds(subject, "xyz is finite", np.isfinite(picture["xyz"].values).all())
    holds(
        subject,
        "pixels lie within those of the captures",
        all(
            grey[d][0] - 1e-9 <= picture[d][0] and picture[d][-1] <= grey[d][-1] + 1e-9
            for d in ("x", "y")
        ),
    )
    if not variance_known(picture):
        holds(
            subject,
            "a variance that is not known is NaN",
            np.isnan(picture["variance"].values).all(),
        )
        return
    for name in ("variance", FIXED_PATTERN):
        if name in picture:
            holds(subject, f"{name} is finite", np.isfinite(picture[name].values).all())
    holds(
        subject,
        "the variance of an unknown device is 0 or more",
        float(total_variance(picture).min()) >= 0,
    )


def _check_dark(subject: str, isp: Isp, layout: str) -> None:
    dark = captures(layout, level=0.0)
    shape = dark["raw"].shape
    # deviations from the black level in DN, with the mean 0
    swing = np.where(pattern(shape) > np.median(pattern(shape)), 8, -8)
    picture = isp(
        dark.assign(
            raw=(dark["raw"].dims, (dark["raw"].values.astype(int) + swing).astype(np.uint16))
        )
    )
    y = picture["xyz"].values[..., 1]
    holds(subject, "the picture of darkness is finite", np.isfinite(picture["xyz"].values).all())
    if variance_known(picture):
        variance = picture["variance"].values
        holds(
            subject,
            "variance is finite and 0 or more, even in darkness",
            np.isfinite(variance).all() and variance.min() >= 0,
        )
    holds(
        subject,
        "estimates below 0 are not clipped",
        y.min() < 0,
        f"the smallest of {y.size} estimates in the dark is {y.min():.3g} cd/m2",
    )
    # a quarter of the spread: clipping at 0 would shift the mean by 0.4 to 0.5 of it
    holds(
        subject,
        "darkness has the mean 0",
        abs(y.mean()) <= 0.25 * y.std(),
        f"{y.mean():.3g} cd/m2, spread {y.std():.3g}",
    )


def _check_saturated(subject: str, isp: Isp, layout: str) -> None:
    white = isp(captures(layout, level=1e6))
    holds(subject, "saturated pixels are not valid", not white["valid"].values.any())
    holds(
        subject, "the picture of a saturated shot is finite", np.isfinite(white["xyz"].values).all()
    )

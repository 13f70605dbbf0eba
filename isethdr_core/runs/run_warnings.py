"""Run warnings: exposures at which the scores of a camera are of little use, found by numerical
limits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

SATURATED_FRAME = "saturated_frame"  # share of the frame outside lamps that no capture measured
LOW_OBJECT_SNR = "low_object_snr"  # median over the objects of their SNR per pixel
SATURATED_SHARE_LIMIT = 0.05
OBJECT_SNR_LIMIT_DB = 0.0


@dataclass(frozen=True)
class RunWarning:
    """One warning about one camera: the measured value and the limit that it exceeds."""

    key: str
    camera: str
    value: float
    limit: float
    unit: str


def warnings_of(
    camera: str, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset
) -> list[RunWarning]:
    """Return the warnings about the picture of one camera.

    Parameters
    ----------
    camera : name of the camera.
    picture, truth : picture and reference picture on one grid.
    labels : labels on that grid; without `instance` there are no objects.
    """
    warnings = []
    share = saturated_share_outside_lamps(picture, truth, labels)
    if share > SATURATED_SHARE_LIMIT:
        warnings.append(RunWarning(SATURATED_FRAME, camera, share, SATURATED_SHARE_LIMIT, ""))
    snr_db = median_object_snr_db(picture, labels)
    if snr_db < OBJECT_SNR_LIMIT_DB:
        warnings.append(RunWarning(LOW_OBJECT_SNR, camera, snr_db, OBJECT_SNR_LIMIT_DB, "dB"))
    return warnings


def sentence(warning: dict) -> str:
    """Return a recorded warning as a sentence for people; an unknown key gives its numbers."""
    value = warning["value"]
    limit = warning["limit"]
    unit = warning["unit"]
    if warning["key"] == SATURATED_FRAME:
        return (
            f"{warning['camera']}: {value:.1%} of the frame outside lamps is saturated in every "
            f"capture (limit {limit:.0%}); use a shorter exposure or a larger f-number"
        )
    if warning["key"] == LOW_OBJECT_SNR:
        return (
            f"{warning['camera']}: the median SNR of the objects is {value:.1f} {unit} "
            f"(limit {limit:g} {unit}); use a longer exposure, a smaller f-number or more light; "
            "lighting=ideal keeps the light of the scene as it is"
        )
    return f"{warning['camera']}: {warning['key']} is {value:.3g} {unit} (limit {limit:g} {unit})"


def saturated_share_outside_lamps(
    picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset
) -> float:
    """Return the share of pixels outside lamps that are saturated in every capture; 0 if all are
    lamps.

    Parameters
    ----------
    picture : picture of the camera, (y, x, xyz_channel).
    truth : reference picture on the same grid.
    labels : labels on the same grid.
    """
    from ..data.saturation import saturated

    outside_lamps = ~lamp_pixels(truth, labels)
    return float(saturated(picture)[outside_lamps].mean()) if outside_lamps.any() else 0.0


def lamp_pixels(truth: xr.Dataset, labels: xr.Dataset) -> np.ndarray:
    """Return which pixels (y, x) show a lamp.

    These are the pixels of `display_view.lamp_mask`, and those pixels of objects with a lamp that
    are brighter than the white of the scene. The body of a car is no lamp, its headlights are.
    """
    from ..display.display_view import lamp_mask, luminance, white_cd_m2

    y = luminance(truth)
    lamps = lamp_mask(y)
    # a chart's table has the instance under `object`; a renderer's table has both keys, and
    # `object` is a name
    table = labels.attrs.get("lamps", [])
    carriers = [lamp.get("instance", lamp.get("object")) for lamp in table]
    carriers = [number for number in carriers if isinstance(number, int)]
    if carriers and "instance" in labels:
        lamps |= np.isin(labels["instance"].values, carriers) & (y > white_cd_m2(y, lamps))
    return lamps


def median_object_snr_db(picture: xr.Dataset, labels: xr.Dataset) -> float:
    """Return the median, over the objects, of mean luminance divided by the noise of a pixel, in
    dB.

    Returns
    -------
    Infinite without noise; minus infinite if the median object is dark. NaN if the picture states
    no variance, or no object has a valid pixel.
    """
    from ..data.reference_picture import before_denoising, total_variance, variance_known

    picture = before_denoising(picture)
    if "instance" not in labels or not variance_known(picture):
        return math.nan
    measured = picture["valid"].values & (labels["instance"].values > 0)
    if not measured.any():
        return math.nan
    objects, at = np.unique(labels["instance"].values[measured], return_inverse=True)
    pixels = np.bincount(at, minlength=len(objects))
    total = np.bincount(at, picture["xyz"].values[..., 1][measured])
    variance = np.bincount(at, total_variance(picture).values[..., 1][measured])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.median((total / pixels) / np.sqrt(variance / pixels))
    if math.isnan(ratio):  # no light and no noise
        return math.nan
    return 20 * math.log10(ratio) if ratio > 0 else -math.inf

"""The viewer of the report: pictures to zoom into and compare, with the values of each pixel.

The page holds the values of every pixel for display under the pointer: luminance, signal-to-noise
ratio, raw values, filter and label. Each plane is compressed separately, and the browser
decompresses it when the page opens (`templates/viewer.js`). No network is needed.
"""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core.display import display_view
from isethdr_core.truth import before_denoising, total_variance, variance_known

from . import pictures

if TYPE_CHECKING:
    import xarray as xr

    from isethdr_core.runs.run import Result

REFERENCE = "reference"
# signal-to-noise ratio as one byte: half decibels above the lowest; 0 is unknown
LOWEST_DB = -40.0
STEP_DB = 0.5
# largest number of pixels of all pictures for which a page holds values: some 25 MB
MOST_PIXELS = 6_000_000
COLOURS = 256  # steps of the false colours
LEVEL = 1  # level of gzip; level 6 saves a tenth of the bytes and takes three times as long


@dataclass(frozen=True)
class Look:
    """The picture of one camera with its reference picture; both are (y, x)."""

    name: str
    picture: xr.Dataset
    truth: xr.Dataset
    captures: xr.Dataset


def looks(result: Result) -> list[Look]:
    """Return the pictures of each camera of a run, read from its store."""
    return [
        Look(
            name,
            result.open(f"picture/{name}").load(),
            result.open(f"truth/{name}").load(),
            result.open(f"captures/{name}").load(),
        )
        for name in result.cameras
    ]


def viewer(
    all_looks: list[Look], figures: list[pictures.Figure], scale: tuple[float, float] | None
) -> dict[str, Any]:
    """Return the content of the viewer: one entry for the reference and one for each camera.

    Parameters
    ----------
    all_looks : pictures of each camera. The reference is the truth of the camera with most pixels.
    figures : views in the order of the entries: reference, then cameras.
    scale : (low, high) of the false colours, cd/m2; None: no false colours.

    Returns
    -------
    A dictionary of plain values that JSON can hold. Planes are gzip in base64, row by row,
    little-endian.
    """
    finest = finest_look(all_looks)
    pixels = sum(look.picture.valid.size for look in all_looks) + finest.truth.valid.size
    with_values = pixels <= MOST_PIXELS
    entries = [_entry(REFERENCE, finest.truth, with_values) | _labels(finest.truth, with_values)]
    for look in all_looks:
        entry = _entry(look.name, look.picture, with_values)
        if with_values:
            snr = {"snr": _snr(look.picture), "snr_name": _snr_name(look.picture)}
            entry |= _labels(look.truth, with_values) | snr | _raw(look.captures)
        entries.append(entry)
    for i, entry in enumerate(entries):
        entry["image"] = f"view-{i}"
        entry["title"] = figures[i].title
    return {
        "entries": entries,
        "lowest_db": LOWEST_DB,
        "step_db": STEP_DB,
        "false_colours": _false_colours(*scale) if scale and with_values else None,
        "told": with_values,
    }


def finest_look(all_looks: list[Look]) -> Look:
    """Return the look with most pixels."""
    return max(all_looks, key=lambda look: look.picture.valid.size)


def _entry(name: str, picture: xr.Dataset, with_values: bool) -> dict[str, Any]:
    """Return a picture's size, its rectangle in the image plane, m, and its luminance."""
    height, width = picture.valid.shape
    entry = {
        "name": name,
        "width": width,
        "height": height,
        "x_m": _edges(picture.x.values),
        "y_m": _edges(picture.y.values),
    }
    if with_values:
        entry["luminance"] = packed(_upper_half(display_view.luminance(picture)))
    return entry


def _edges(centres: np.ndarray) -> list[float]:
    """Return the outer edges of the first and the last pixel, from the centres of all pixels."""
    centres = np.asarray(centres, float)
    step = (centres[-1] - centres[0]) / (len(centres) - 1) if len(centres) > 1 else 1.0
    return [float(centres[0] - step / 2), float(centres[-1] + step / 2)]


def _upper_half(values: np.ndarray) -> np.ndarray:
    """Return the upper 16 bits of float32, rounded to nearest: sign, exponent, 8 significant bits.

    The relative error is at most 2^-8, 0.4 %: far below the noise of a pixel at night.
    """
    bits = np.ascontiguousarray(values, "<f4").view("<u4").astype(np.uint64)
    return ((bits + 0x8000) >> 16).clip(0, 0xFFFF).astype("<u2")


def packed(plane: np.ndarray) -> str:
    """Return a plane of whole numbers as base64 of gzip, ordered by byte: all lowest bytes first.

    High bytes of neighbouring pixels are similar, and compress well only next to each other.
    """
    plane = np.ascontiguousarray(plane)
    rows = plane.view(np.uint8).reshape(-1, plane.itemsize).T
    return base64.b64encode(gzip.compress(rows.tobytes(), LEVEL, mtime=0)).decode()


def _snr(picture: xr.Dataset) -> str:
    """Return the signal-to-noise ratio of each pixel's luminance in steps of half a decibel.

    For a denoised picture it is the ratio before denoising, for which the variance is known. 0
    stands for unknown: the pixel is not valid, its estimate is 0 or less, or no variance is stated.
    """
    picture = before_denoising(picture)
    y = display_view.luminance(picture)
    variance = total_variance(picture).values[..., 1].astype(float)
    known = picture.valid.values & (y > 0) & (variance > 0)
    if not variance_known(picture):
        known[:] = False
    ratio = np.where(known, y, 1.0) / np.sqrt(np.where(known, variance, 1.0))
    steps = np.rint((20 * np.log10(ratio) - LOWEST_DB) / STEP_DB)
    return packed(np.where(known, np.clip(steps, 1, 255), 0).astype(np.uint8))


def _snr_name(picture: xr.Dataset) -> str:
    """Return the name of the signal-to-noise ratio of a picture in the readout."""
    return "SNR" if before_denoising(picture) is picture else "SNR before denoising"


def _raw(captures: xr.Dataset) -> dict[str, Any]:
    """Return the raw values of every capture in DN, the saturated pixels, and the filters.

    Without a converter, raw values have fractions and may be negative. They are packed as the bits
    of float32.
    """
    raw = captures["raw"].values
    is_float = bool(np.issubdtype(raw.dtype, np.floating))
    whole = raw.astype("<f4").view("<u4") if is_float else raw.astype("<u4")
    return {
        "captures": [str(name) for name in captures["capture"].values],
        "raw": [packed(plane) for plane in whole],
        "raw_is_float": is_float,
        "saturated": [packed(plane.astype(np.uint8)) for plane in captures["saturated"].values],
        "filters": [str(name) for name in captures["channel"].values],
        "filter": packed(captures["filter"].values.astype(np.uint8)),
    }


def _labels(truth: xr.Dataset, with_values: bool) -> dict[str, Any]:
    """Return the instance of each pixel and the names of the instances; nothing without labels."""
    if not with_values or "instance" not in truth:
        return {}
    names = {
        str(entry["instance"]): _described(entry) for entry in truth.attrs.get("objects") or []
    }
    return {"instance": packed(truth["instance"].values.astype("<u4")), "names": names}


def _described(entry: dict[str, Any]) -> str:
    """Return an object's name and distance in words."""
    name = entry.get("name") or entry["category"]
    distance_m = entry.get("distance_m")
    return f"{name}, {distance_m:.0f} m" if distance_m else str(name)


def _false_colours(low: float, high: float) -> dict[str, Any]:
    """Return the colours between `low` and `high` cd/m2, on a logarithmic scale."""
    ramp, _ = display_view.false_colour(np.geomspace(low, high, COLOURS)[None, :], low, high)
    return {"low": low, "high": high, "colours": packed(ramp.astype(np.uint8))}

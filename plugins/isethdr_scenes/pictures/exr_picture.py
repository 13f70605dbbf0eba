"""Pictures in OpenEXR: RGB, luminance, or one channel per band.

Spectral channels are named `S0.<nm>nm` with a decimal comma (Fichet, Pacanowski, Wilkie 2021, J.
Comput. Graph. Tech. 10(3), section 3). The header may state `whiteLuminance` and `chromaticities`
(OpenEXR, standard attributes).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from isethdr_core.errors import UnitError

from .content import LUMINANCE_CHANNELS, RGB_CHANNELS, XYZ_CHANNELS, Content, Wanted, unreadable

_BAND = re.compile(r"S0\.(\d+)(?:[.,](\d+))?nm")


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of an EXR file.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it lacks the channels that are asked for, or the usual ones.
    """
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            # the library empties its own dictionary at the end of the block
            pixels = {name: channel.pixels for name, channel in file.channels().items()}
            header = dict(file.header())
    except (RuntimeError, ValueError, IndexError) as err:
        raise unreadable(path, "EXR", err) from None
    bands = {name: float(f"{m[1]}.{m[2] or 0}") for name in pixels if (m := _BAND.fullmatch(name))}
    if bands and not selection.channels:
        return Content(_stacked(pixels, tuple(bands), path), wavelength_nm=tuple(bands.values()))
    names = selection.channels or _usual(pixels, path)
    missing = [name for name in names if name not in pixels]
    if missing or len(names) not in (1, 3):
        raise _wrong_channels(path, pixels, missing)
    colours = LUMINANCE_CHANNELS if len(names) == 1 else RGB_CHANNELS
    if tuple(names) == XYZ_CHANNELS:
        colours = XYZ_CHANNELS
    white = header.get("whiteLuminance")
    stated = header.get("chromaticities")
    return Content(
        _stacked(pixels, names, path),
        colours,
        white_cd_m2=None if white is None else float(white),
        chromaticities=None if stated is None else _numbers(stated),
    )


def _usual(pixels: Mapping[str, Any], path: Path) -> tuple[str, ...]:
    for names in (RGB_CHANNELS, XYZ_CHANNELS, LUMINANCE_CHANNELS):
        if set(names) <= set(pixels):
            return names
    raise _wrong_channels(path, pixels, list(RGB_CHANNELS))


def _wrong_channels(path: Path, pixels: Mapping[str, Any], missing: list[str]) -> UnitError:
    channels = ", ".join(sorted(pixels)) or "none"
    lacks = f" and lacks {', '.join(missing)}" if missing else ""
    return UnitError(
        f"{path} has the channels {channels}{lacks}; expected R, G, B, or X, Y, Z, or Y, or"
        " S0.<nm>nm; type for example 'scene.channels=[layer.R,layer.G,layer.B]'"
    )


def _stacked(pixels: Mapping[str, Any], names: tuple[str, ...], path: Path) -> np.ndarray:
    planes = [np.asarray(pixels[name]) for name in names]
    if len({plane.shape for plane in planes}) > 1:
        raise UnitError(
            f"{path} holds the channels {', '.join(names)} in different sizes; expected full"
            " resolution for all"
        )
    return np.stack(planes)[None].astype(np.float32)


def _numbers(stated: Any) -> tuple[float, ...]:
    return tuple(float(v) for pair in np.atleast_1d(stated) for v in np.ravel(pair))

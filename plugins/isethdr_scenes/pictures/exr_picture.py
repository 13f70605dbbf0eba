"""Pictures in OpenEXR: RGB, luminance, or one channel per band.

Spectral channels are named `S0.<nm>nm` with a decimal comma (Fichet, Pacanowski, Wilkie 2021, J.
Comput. Graph. Tech. 10(3), section 3). The header may state `whiteLuminance` and `chromaticities`
(OpenEXR, standard attributes).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import OpenEXR

from isethdr_core.errors import UnitError

from .content import LUMINANCE_CHANNELS, RGB_CHANNELS, XYZ_CHANNELS, Content, Wanted, unreadable

_Part: TypeAlias = tuple[dict[str, Any], dict[str, Any]]  # ({channel: pixels}, header)
USUAL = (RGB_CHANNELS, XYZ_CHANNELS, LUMINANCE_CHANNELS)
SQUARE = 1e-3  # largest difference of the aspect ratio of square pixels from 1
_BAND = re.compile(r"S0\.(\d+)(?:[.,](\d+))?nm")


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of an EXR file.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it lacks the channels that are asked for, or the usual ones; several parts have
        them; its pixels are not square, or do not fill its display window.
    """
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            # the library empties its own dictionaries at the end of the block
            parts = [
                (
                    {name: channel.pixels for name, channel in file.channels(number).items()},
                    dict(file.header(number)),
                )
                for number in range(len(file.parts))
            ]
    except (RuntimeError, ValueError, IndexError) as err:
        raise unreadable(path, "EXR", err) from None
    if not parts:
        raise unreadable(path, "EXR", "it has no part whose pixels can be read")
    pixels, header = _part(parts, selection, path)
    _refuse_window(header, path)
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


def _part(parts: list[_Part], selection: Wanted, path: Path) -> _Part:
    """Return the part with the channels that are asked for, or with the usual ones.

    Raises
    ------
    UnitError : several parts have them, or none has the name that is asked for.
    """
    named = {str(header.get("name", "")): (pixels, header) for pixels, header in parts}
    if selection.variable and selection.variable not in named:
        names = [name for name in named if name]
        has = f"the parts {', '.join(names)}" if names else "no parts with names"
        raise UnitError(
            f"{path} has {has}, and scene.variable is {selection.variable}; expected the name of"
            f" a part; type scene.variable={names[0] if names else repr('')}"
        )
    if selection.variable:
        return named[selection.variable]
    able = [part for part in parts if _serves(part[0], selection)]
    if not selection.channels and not any(_BAND.fullmatch(n) for one, _ in able for n in one):
        for usual in USUAL:  # in the order that counts within a part
            best = [part for part in able if set(usual) <= set(part[0])]
            if best:
                able = best
                break
    if len(able) > 1:
        names = ", ".join(str(header.get("name", "")) for _, header in able)
        raise UnitError(
            f"{path} has the channels of a picture in {len(able)} parts, {names}; expected one;"
            f" type for example scene.variable={able[0][1].get('name', '')}"
        )
    if able:
        return able[0]
    if len(parts) > 1:
        wanted = selection.channels or RGB_CHANNELS
        names = "; ".join(
            f"{header.get('name', '')}: {', '.join(sorted(pixels)) or 'none'}"
            for pixels, header in parts
        )
        raise UnitError(
            f"{path} has {len(parts)} parts with the channels {names}; expected one part with"
            f" {', '.join(wanted)}; save these channels in one part"
        )
    return parts[0]


def _serves(pixels: Mapping[str, Any], selection: Wanted) -> bool:
    if selection.channels:
        return set(selection.channels) <= set(pixels)
    usual = any(set(names) <= set(pixels) for names in USUAL)
    return usual or any(map(_BAND.fullmatch, pixels))


def _refuse_window(header: Mapping[str, Any], path: Path) -> None:
    """Refuse pixels that are not square, and files that hold only a part of the picture.

    Raises
    ------
    UnitError : the pixel aspect ratio is not 1, or the data window is not the display window.
    """
    ratio = float(header.get("pixelAspectRatio", 1.0))
    if not abs(ratio - 1) <= SQUARE:
        raise UnitError(
            f"{path} has pixels of the aspect ratio {ratio:g}; expected square pixels; resample it"
        )
    windows = [header[name] for name in ("dataWindow", "displayWindow")]  # required by the format
    (data_from, data_to), (shown_from, shown_to) = np.asarray(windows, int)
    if np.array_equal(data_from, shown_from) and np.array_equal(data_to, shown_to):
        return
    stored, shown = (
        f"columns {first[0]} to {last[0]}, rows {first[1]} to {last[1]}"
        for first, last in ((data_from, data_to), (shown_from, shown_to))
    )
    raise UnitError(
        f"{path} stores the pixels of {stored}, and its display window is {shown}; expected the"
        " same, because the field angle is that of all pixels; crop or pad it to the display"
        " window, and save it again"
    )


def _usual(pixels: Mapping[str, Any], path: Path) -> tuple[str, ...]:
    for names in USUAL:
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

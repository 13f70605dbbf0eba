"""Picture files by format. They are read and decoded, and their values are checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from isethdr_core.errors import CatalogError, ConfigError, UnitError, did_you_mean
from isethdr_core.physics.colour.colour_spaces import srgb_decode

from . import cube_dataset, exr_picture, numpy_picture, photo, radiance_hdr, tiff_picture
from .content import Content, Wanted, refuse_other_bands, sorted_bands

Coding: TypeAlias = Literal["not_stated", "linear", "srgb"]
READERS: dict[str, Callable[[Path, Wanted], Content]] = {
    ".exr": exr_picture.read,
    ".hdr": radiance_hdr.read,
    ".pic": radiance_hdr.read,
    ".npy": numpy_picture.read,
    ".npz": numpy_picture.read,
    ".tif": tiff_picture.read,
    ".tiff": tiff_picture.read,
    ".png": photo.read,
    ".jpg": photo.read,
    ".jpeg": photo.read,
    ".bmp": photo.read,
    ".webp": photo.read,
    ".zarr": cube_dataset.read,
    ".nc": cube_dataset.read,
    ".nc4": cube_dataset.read,
}


def needs_path(path: str) -> Path:
    """Return the path that a scene names.

    Raises
    ------
    ConfigError : no path is named.
    CatalogError : the path does not exist.
    """
    if not path or "\0" in path:
        raise ConfigError(
            f"scene.path is {path!r}; expected a picture or a spectral cube; type for example"
            " scene=file scene.path=street.exr; in Python isethdr_scenes.pictures.array_scene"
            "(values) makes an array the scene"
        )
    file = Path(path).expanduser()
    if not file.exists():
        raise CatalogError(f"{file} does not exist; type scene.path=<file>")
    return file


def checked_content(
    path: str, selection: Wanted, coding: Coding, negative_to_zero: bool
) -> Content:
    """Return the content of a file with linear values that are finite and 0 or more.

    Parameters
    ----------
    path : path of the file; its ending states the format.
    selection : channels, wavelengths and name of the array that are read.
    coding : coding of colours.
    negative_to_zero : whether negative values are set to 0; else they raise an error.

    Raises
    ------
    ConfigError : no file is named, its format is unknown, or it holds integers of unknown coding.
    CatalogError : the file does not exist, or cannot be read.
    UnitError : channels, dims or values are not those of light.
    """
    file = needs_path(path)
    if file.suffix.lower() not in READERS:
        raise ConfigError(
            f"{file} ends in {file.suffix!r}{did_you_mean(file.suffix, READERS)}; expected one"
            " of these formats"
        )
    if file.is_dir() and file.suffix.lower() != ".zarr":
        raise CatalogError(f"{file} is a folder; expected a file, or a folder that ends in .zarr")
    changed = file.stat().st_mtime_ns
    return _checked(file, changed, selection, coding, negative_to_zero)


@lru_cache(maxsize=1)
def _checked(
    path: Path, changed_ns: int, selection: Wanted, coding: Coding, negative_to_zero: bool
) -> Content:
    """Return the content of a file. The last content stays in memory for the checks of a run."""
    try:
        content = READERS[path.suffix.lower()](path, selection)
    except OSError as err:
        raise CatalogError(f"{path} cannot be read: {err.strerror}") from None
    refuse_other_bands(content, selection, path)
    content = _linear(sorted_bands(content, path), coding, path)
    values = content.values
    wrong = ~np.isfinite(values)
    if wrong.any():
        raise UnitError(
            f"{path} holds {int(wrong.sum())} values that are NaN or infinite, the first"
            f" {_place(wrong, content)}; expected finite light; repair the file"
        )
    negative = values < 0
    if not negative.any():
        return content
    count = int(negative.sum())
    most = -float(values.min())
    if not negative_to_zero:
        raise UnitError(
            f"{path} holds {count} negative values, down to {-most:g}, the first"
            f" {_place(negative, content)}; expected light, 0 or more; type"
            " scene.negative_to_zero=true to set them to 0"
        )
    return replace(content, values=np.maximum(values, 0), zeroed=count, most_negative=most)


def _linear(content: Content, coding: Coding, path: Path) -> Content:
    """Return content with linear values. Integers are divided by their largest code, and sRGB is
    decoded.
    """
    values = content.values
    if values.dtype.kind in "iu":
        if content.wavelength_nm is None and coding == "not_stated":
            raise ConfigError(
                f"{path} holds {values.dtype} codes; expected to know how they are coded; type"
                " scene.encoding=srgb for a photo, scene.encoding=linear for linear codes; save"
                " values in cd/m2 as floating-point numbers"
            )
        if content.wavelength_nm is None:
            content = replace(content, codes=str(values.dtype))
            values = values / np.iinfo(values.dtype).max
    if coding == "srgb":
        if content.wavelength_nm is not None or values.max() > 1:
            raise UnitError(
                f"{path} holds values up to {values.max():g}; expected codes from 0 to 1 for"
                " scene.encoding=srgb; type scene.encoding=linear"
            )
        # negative values stay, so that they are refused or counted
        values = np.where(values < 0, values, srgb_decode(values))
    return replace(content, values=np.asarray(values))


def _place(where: np.ndarray, content: Content) -> str:
    group, channel, row, column = map(int, np.argwhere(where)[0])
    if content.wavelength_nm is None:
        name = content.channels[channel]
    else:
        name = f"{content.wavelength_nm[channel]:g} nm"
    return f"in {name} at row {row}, column {column}"

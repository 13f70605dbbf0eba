"""Pictures and cubes in TIFF: (y, x), (y, x, 3), or pages of bands."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from pathlib import Path

import numpy as np
import tifffile

from isethdr_core.errors import CatalogError, IsetHdrError, UnitError

from .content import Content, Wanted, plain_array, unreadable

LIGHT = (tifffile.PHOTOMETRIC.MINISBLACK, tifffile.PHOTOMETRIC.RGB)  # values rise with light
COPY_OR_MASK = 0b101  # bits of the tag NewSubfileType: a smaller copy, or a transparency mask
UPRIGHT = 1  # code of the tag Orientation
# {Orientation: (whether rows are columns of the file, whether to mirror y, whether to mirror x)}
TURNS = {
    2: (False, False, True),
    3: (False, True, True),
    4: (False, True, False),
    5: (True, False, False),
    6: (True, False, True),
    7: (True, True, True),
    8: (True, True, False),
}


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of a TIFF file, turned upright by its tag Orientation.

    An alpha channel is dropped, planes of colours are moved to the last axis, and integers whose
    smallest code is white are inverted.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it holds an array of another form, several pictures of different sizes, colours
        other than grey and RGB, or integers that do not fill their type.
    """
    try:
        with tifffile.TiffFile(path) as file:
            pictures = [
                one for one in file.series if not one.keyframe.subfiletype & COPY_OR_MASK
            ] or list(file.series)
            page = pictures[0].keyframe
            _check(path, page, [tuple(picture.shape) for picture in pictures])
            values = np.asarray(pictures[0].asarray())
            axes = pictures[0].axes
            orientation = page.tags.valueof("Orientation", UPRIGHT)
    except IsetHdrError:
        raise
    except Exception as err:  # noqa: BLE001 - damaged files raise errors of zlib and many others
        raise unreadable(path, "TIFF", err) from None
    if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
        values = np.iinfo(values.dtype).max - values
    if values.ndim == 3 and axes.endswith("S") and not selection.wavelength_nm:
        values = values[..., :3] if values.shape[2] == 4 else values
    if values.ndim == 3 and axes.startswith("S") and not selection.wavelength_nm:
        values = values[:3].transpose(1, 2, 0)
    content = plain_array(values, selection, path)
    return replace(content, values=_upright(content.values, orientation))


def _check(path: Path, page: tifffile.TiffPage, shapes: list[tuple[int, ...]]) -> None:
    """Refuse a TIFF whose values are not light.

    Raises
    ------
    CatalogError : its compression needs a package that is not installed.
    UnitError : several pictures, colours other than grey and RGB, or integers of odd bits.
    """
    if len(shapes) > 1:
        sizes = ", ".join(" x ".join(map(str, shape)) for shape in shapes)
        raise UnitError(
            f"{path} holds {len(shapes)} separate pictures ({sizes}); expected one; save the wanted"
            " one, or all bands as one array, in a file of its own"
        )
    kind = page.photometric
    dtype = page.dtype
    if dtype is None:
        raise UnitError(
            f"{path} has values of {page.bitspersample} bits, which no type of NumPy holds;"
            " expected integers of 8, 16 or 32 bits, or floating-point numbers"
        )
    inverted = kind == tifffile.PHOTOMETRIC.MINISWHITE and dtype.kind == "u"
    # decoders of JPEG return RGB
    becomes_rgb = kind == tifffile.PHOTOMETRIC.YCBCR and page.compression in (
        tifffile.COMPRESSION.JPEG,
        tifffile.COMPRESSION.OJPEG,
    )
    if not (kind in LIGHT or inverted or becomes_rgb):
        raise UnitError(
            f"{path} is a TIFF of the colours {_name(kind)} with {dtype} values; expected grey"
            " (MINISBLACK) or RGB; save it as grey or RGB"
        )
    bits = page.bitspersample
    if dtype.kind in "biu" and bits != 8 * dtype.itemsize:
        raise UnitError(
            f"{path} has integers of {bits} bits; expected 8, 16 or 32; save it with one of these"
        )
    codec = page.compression
    if not (codec in tifffile.TIFF.DECOMPRESSORS and page.predictor in tifffile.TIFF.UNPREDICTORS):
        raise CatalogError(
            f"{path} has the compression {_name(codec)}, which needs the package"
            " imagecodecs; type pip install imagecodecs, or save it without compression"
        )


def _name(code: int) -> str:
    """Return the name of a code of a TIFF; its number if it has no name."""
    return code.name if isinstance(code, Enum) else str(code)


def _upright(values: np.ndarray, orientation: int) -> np.ndarray:
    """Return the picture (..., y, x) as it is seen (TIFF 6.0, section 8, Orientation)."""
    swapped, mirror_y, mirror_x = TURNS.get(orientation, (False, False, False))
    if swapped:
        values = np.swapaxes(values, -1, -2)
    if mirror_y:
        values = values[..., ::-1, :]
    if mirror_x:
        values = values[..., ::-1]
    return values

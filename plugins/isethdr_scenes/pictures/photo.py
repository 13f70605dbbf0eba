"""Photos in PNG, JPEG, BMP and WebP: codes (y, x) or (y, x, 3)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageOps, UnidentifiedImageError

from isethdr_core.errors import UnitError

from .content import Content, Wanted, plain_array, unreadable

SIXTEEN_BITS = 16
PNG_HEADER = 26  # bytes of a PNG file up to its bit depth and its type of colour
GREYS = {"L": np.uint8, "LA": np.uint8, "I;16": np.uint16}  # {mode of Pillow: type of the codes}


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of a photo, turned upright by its Exif data. Transparency is dropped.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it holds colours of 16 bits, of which Pillow keeps 8.
    """
    try:
        with Image.open(path) as file:
            _refuse_lost_bits(path)
            photo = ImageOps.exif_transpose(file)
            if photo.mode in GREYS:
                grey = photo.convert("L") if photo.mode == "LA" else photo
                values = np.asarray(grey, GREYS[photo.mode])
            else:
                values = np.asarray(photo.convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as err:
        raise unreadable(path, "photo", err) from None
    except Image.DecompressionBombError as err:
        raise UnitError(f"{path} is too large ({err}); expected a smaller photo") from None
    return plain_array(values, selection, path)


def _refuse_lost_bits(path: Path) -> None:
    with path.open("rb") as file:
        header = file.read(PNG_HEADER)
    is_png = header.startswith(b"\x89PNG") and len(header) == PNG_HEADER
    if is_png and header[24] == SIXTEEN_BITS and header[25] != 0:  # 0: grey, read with all bits
        raise UnitError(
            f"{path} holds colours of 16 bits; expected 8 bits in a PNG; save it as TIFF, whose 16"
            " bits are read"
        )

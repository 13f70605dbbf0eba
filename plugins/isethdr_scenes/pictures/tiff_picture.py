"""Pictures and cubes in TIFF: (y, x), (y, x, 3), or pages of bands."""

from __future__ import annotations

from pathlib import Path

import tifffile

from .content import Content, Wanted, plain_array, unreadable


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of a TIFF file. An alpha channel is dropped, and planes of colours are
    moved to the last axis.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it holds an array of another form.
    """
    try:
        with tifffile.TiffFile(path) as file:
            values = file.asarray()
            axes = file.series[0].axes
    except (tifffile.TiffFileError, OSError, ValueError, IndexError, KeyError) as err:
        raise unreadable(path, "TIFF", err) from None
    if values.ndim == 3 and axes.endswith("S") and not selection.wavelength_nm:
        values = values[..., :3] if values.shape[2] == 4 else values
    if values.ndim == 3 and axes.startswith("S") and not selection.wavelength_nm:
        values = values[:3].transpose(1, 2, 0)
    return plain_array(values, selection, path)

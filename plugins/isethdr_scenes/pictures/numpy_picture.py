"""Pictures and cubes in NumPy files.

A .npy file holds one array. A .npz file holds one array, or several with one selected by name. For
a cube it also holds `wavelength_nm`. A text `unit` may state the unit.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from isethdr_core.errors import UnitError

from .content import Content, Wanted, plain_array, unreadable

BESIDE = ("wavelength_nm", "unit")


def read(path: Path, selection: Wanted) -> Content:
    """Return the content of a .npy or .npz file.

    Raises
    ------
    CatalogError : the file cannot be read.
    UnitError : it holds several arrays and none is named, or an array of another form, or
        wavelengths that are no numbers.
    """
    try:
        loaded = np.load(path, allow_pickle=False)
        arrays = {"": loaded} if isinstance(loaded, np.ndarray) else dict(loaded)
    except Exception as err:  # noqa: BLE001 - zipfile and zlib raise their own for a cut-off file
        raise unreadable(path, "NumPy", err) from None
    names = [name for name in arrays if name not in BESIDE]
    name = selection.variable or (names[0] if len(names) == 1 else "")
    if name not in arrays:
        raise UnitError(
            f"{path} holds the arrays {', '.join(names) or 'none'}; expected one; type for example"
            f" scene.variable={names[0] if names else 'radiance'}"
        )
    if "wavelength_nm" in arrays:
        if arrays["wavelength_nm"].dtype.kind not in "fiu":
            raise UnitError(
                f"{path} holds wavelength_nm as {arrays['wavelength_nm'].dtype} values; expected"
                " real numbers, nm"
            )
        bands = tuple(arrays["wavelength_nm"].astype(float).ravel().tolist())
        selection = replace(selection, wavelength_nm=bands)
    content = plain_array(arrays[name], selection, path)
    unit = str(arrays["unit"]) if "unit" in arrays else None
    return replace(content, unit=unit)

"""Arrays of Python as scenes. The home folder stores them under the hash of their content."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from isethdr_core.errors import UnitError
from isethdr_core.storage.atomic_write import temporary_path
from isethdr_core.store import home

from .cube_dataset import content_of
from .picture_file import PictureFile

FOLDER = "arrays"  # folder inside the home folder


def array_scene(
    values: npt.ArrayLike | xr.DataArray,
    wavelength_nm: Sequence[float] = (),
    **fields: Any,
) -> list[str]:
    """Return the overrides of `isethdr_core.compose` that make an array the scene of a run.

    The array is written to `ISETHDR_HOME/arrays`, under the hash of its content.

    Parameters
    ----------
    values : (y, x) luminance, (y, x, 3) linear RGB, or (wavelength, y, x) a spectral cube; or a
        DataArray with the dims wavelength, y, x and the attribute `units`.
    wavelength_nm : centres of the bands of a cube without coordinates, nm.
    **fields : fields of the scene `file`, such as `unit`, `white_cd_m2`, `horizontal_field_deg`.

    Raises
    ------
    ConfigError, CatalogError, UnitError : as the scene `file` raises them.
    """
    arrays: dict[str, Any]
    if isinstance(values, xr.DataArray) and "wavelength" in values.dims:
        content = content_of(values, "the array")
        if len(content.groups) > 1:
            raise UnitError(
                f"the array has the light groups {', '.join(content.groups)}; expected one; save it"
                " with .to_zarr, and use scene=file"
            )
        arrays = {"values": content.values[0], "wavelength_nm": content.wavelength_nm}
        if content.unit is not None:
            arrays["unit"] = content.unit
    else:
        arrays = {"values": np.asarray(values)}
        if len(wavelength_nm):
            arrays["wavelength_nm"] = wavelength_nm
    path = _stored_path({name: np.asarray(value) for name, value in arrays.items()})
    fields = {"path": str(path), **fields}
    PictureFile(**fields).check_files()
    return ["scene=array", *(f"scene.{name}={_typed(value)}" for name, value in fields.items())]


def _stored_path(arrays: dict[str, np.ndarray]) -> Path:
    digest = hashlib.sha256()
    for name, array in arrays.items():
        digest.update(f"{name} {array.dtype} {array.shape} ".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    folder = home().resolve() / FOLDER
    path = folder / f"{digest.hexdigest()[:16]}.npz"
    if path.exists():
        return path
    folder.mkdir(parents=True, exist_ok=True)
    temporary = temporary_path(folder, path.name)
    try:
        with temporary.open("wb") as file:
            np.savez(file, **arrays)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    return path


def _typed(value: Any) -> str:
    """Return the value of a field as text that Hydra parses."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, (tuple, list)):
        return "[" + ",".join(map(_typed, value)) + "]"
    if isinstance(value, str):
        return "'" + value.replace("\\", "\\\\").replace("'", "\\'") + "'"
    return repr(float(value))

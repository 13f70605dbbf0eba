"""The files of an ISETHDR scene: spectral radiance and instance maps in EXR, maps in MAT.

Radiance channels are named `S0.<nm>,000nm` (a decimal comma), one per band, in W m-2 sr-1 nm-1.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from isethdr_core.errors import CatalogError, UnitError

_BAND = re.compile(r"S0\.(\d+)[.,](\d+)nm")
FIRST_NM = 400
LAST_NM = 700
STEP_NM = 10


def read_radiance(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return band centres (wavelength,), nm, and radiance (wavelength, y, x) float32, W m-2 sr-1
    nm-1.

    Raises
    ------
    CatalogError : the file is cut off, lacks one of the deposit's channels, or has one twice.
    UnitError : a channel holds negative or infinite light.
    """
    channels = _channels(path)
    bands = _bands(channels, path)
    nm = np.array(sorted(bands))
    cube = np.stack([np.asarray(channels[bands[k]], np.float32) for k in nm])
    for k, plane in zip(nm, cube):
        # NaN makes both NaN, and the comparison below false
        low = plane.min()
        high = plane.max()
        if not (low >= 0 and high < np.inf):
            raise UnitError(
                f"{path} channel {bands[k]!r} holds values from {low:g} to {high:g}; expected"
                " finite light, never negative; fetch the file again"
            )
    return nm, cube


def check_channels(path: Path) -> None:
    """Check the names of the channels of a file of radiance; only its header is read.

    Raises
    ------
    CatalogError : the header cannot be read, or a band is missing or there twice.
    """
    import OpenEXR

    try:
        with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
            names = [channel.name for channel in file.header()["channels"]]
    except (RuntimeError, ValueError) as err:
        raise _unreadable(path, err) from None
    _bands(names, path)


def _bands(names: Iterable[str], path: Path) -> dict[float, str]:
    """Return the channel of each band, {centre in nm: name}."""
    bands: dict[float, str] = {}
    for name in names:
        if match := _BAND.fullmatch(name):
            centre = float(f"{match[1]}.{match[2]}")
            if centre in bands:
                raise CatalogError(
                    f"{path} has two channels for {centre:g} nm, {bands[centre]!r} and {name!r}; "
                    "expected one per band; fetch the file again"
                )
            bands[centre] = name
    missing = [nm for nm in range(FIRST_NM, LAST_NM + 1, STEP_NM) if nm not in bands]
    if missing:
        raise CatalogError(
            f"{path} lacks channel 'S0.{missing[0]},000nm' ({len(missing)} of 31 bands are"
            " missing); expected radiance at 400-700 nm in steps of 10 nm; fetch the file again"
        )
    return bands


def read_instance(path: Path) -> np.ndarray:
    """Return the instance map (y, x) uint32. Tiles without a positive number are 0: no instance.

    Raises
    ------
    LookupError : the file has no channel of instances.
    CatalogError : the file cannot be read.
    """
    channels = _channels(path)
    name = (
        "InstanceId"
        if "InstanceId" in channels
        else next(iter(channels))
        if len(channels) == 1
        else None
    )
    if name is None:
        raise LookupError(f"has no channel 'InstanceId', only {', '.join(sorted(channels))}")
    values = np.asarray(channels[name], np.float64)
    return np.where(np.isfinite(values) & (values > 0), np.rint(values), 0).astype(np.uint32)


def read_distance(path: Path) -> np.ndarray:
    """Return the distance along the ray (y, x), m, from `sceneMeta.depthMap` of a MAT file up to
    version 7.

    Raises
    ------
    LookupError : the file is of version 7.3 (HDF5), or has no depth map.
    CatalogError : the file cannot be read.
    UnitError : the map does not hold distances.
    """
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=True, struct_as_record=False)
    except NotImplementedError:
        raise LookupError(
            "is a version 7.3 MAT file, which is not read; save it in MATLAB with -v7"
        ) from None
    except Exception as err:  # noqa: BLE001 - scipy raises many kinds for a cut-off file
        raise CatalogError(
            f"{path} is not a readable MAT file ({err}); fetch it again, or move it away"
        ) from None
    depth = getattr(content.get("sceneMeta"), "depthMap", None)
    if depth is None or np.ndim(depth) not in (1, 2):
        raise LookupError("has no map sceneMeta.depthMap")
    distance = checked_distance(np.asarray(depth), path)
    if distance.ndim != 2:
        raise LookupError("has no map sceneMeta.depthMap of two dimensions")
    return distance


def checked_distance(depth: np.ndarray, path: Path) -> np.ndarray:
    """Return a map of distances as float32; tiles that see no surface are NaN or infinite.

    Raises
    ------
    UnitError : the map holds no real numbers, a negative distance, or no finite distance.
    """
    label = f"{path}: sceneMeta.depthMap"
    expected = "expected real distances in metres, 0 or more; fetch the file again, or move it away"
    if depth.dtype.kind not in "fiu":
        raise UnitError(f"{label} holds {depth.dtype} values; {expected}")
    finite = depth[np.isfinite(depth)]
    if not finite.size:
        raise UnitError(f"{label} holds no finite value; {expected}")
    if finite.min() < 0:
        raise UnitError(f"{label} holds {finite.min():g}; {expected}")
    return depth.astype(np.float32)


def is_deposit_file(path: Path) -> bool:
    """Return whether a file exists.

    Raises
    ------
    CatalogError : the path is a link without a target, or no file.
    """
    if path.is_file():
        return True
    if path.is_symlink() or path.exists():
        raise CatalogError(
            f"{path} is not a file, or is a link to a missing file; expected a file of the deposit;"
            " fetch it again, or remove it"
        )
    return False


def _channels(path: Path) -> dict[str, np.ndarray]:
    import OpenEXR

    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            # leaving the block empties the library's own dictionary
            return {name: channel.pixels for name, channel in file.channels().items()}
    except (RuntimeError, ValueError) as err:  # a cut-off file opens with no part, or not at all
        raise _unreadable(path, err) from None


def _unreadable(path: Path, err: Exception) -> CatalogError:
    return CatalogError(f"{path} is not a readable EXR file, or is cut off ({err}); fetch it again")

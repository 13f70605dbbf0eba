"""How arrays lie on disk: chunks, shards, codecs and rounding, decided in this one place.

Measured on a night scene of 1080 x 1920 x 31 bands x 4 groups: rounding to 10 mantissa bits makes
the cube 2.9 times smaller than raw float32. Lossless codecs reach 1.3 at any level. Every further
bit takes 6 % more. One shard per light group keeps a scene at a handful of files. Chunks of 8 bands
x 135 x 240 tiles inside a shard serve reads of spectra, bands and tiles alike.

Pictures are float32 with only those mantissa bits that are significant above their own noise
(`picture_rounding`). X, Y and Z lie in separate chunks: a chunk of similar numbers is a tenth
smaller. Other float64 arrays keep all their bits; lz4 packs them in an eighth of the time of zstd.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Hashable, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np

from .picture_rounding import ROUNDING, rounded_picture

if TYPE_CHECKING:
    import xarray as xr

KEEPBITS = 12  # mantissa bits of stored light; also the smallest number for a stated error
MANTISSA_BITS = 23  # mantissa bits of float32
# rounded quantities: absolute light, with noise above half a part per thousand
LIGHT = (
    "radiance",
    "irradiance",
)
BAND = "wavelength"
TILE = {BAND: 8, "y": 135, "x": 240}
# largest chunk without bands: a chunk with few bytes per pixel takes as long as one with many
PLANE = {
    "y": 540,
    "x": 960,
}
# dims with entries that are read one at a time, so that no chunk holds several of them
ONE_SHARD_EACH = ("light_group", "component", "capture")
ONE_CHUNK_EACH = ("xyz_channel",)  # a chunk of similar numbers compresses better
# blosc shuffles the bits of a block only if its number of values is a multiple of this number.
# Other blocks are copied as they are: rounded pictures then take 1.5 times the disk
SHUFFLED_TOGETHER = 8


def keep_mantissa_bits(values: np.ndarray, bits: int = KEEPBITS) -> np.ndarray:
    """Round float32 values to `bits` explicit mantissa bits, to nearest, ties to even (so without
    bias).

    The rounding is numcodecs' BitRound, used as a function: the stored arrays hold ordinary float32
    values and name no such codec, so every reader of zarr can open them.

    Parameters
    ----------
    values : array, float32, any unit.
    bits : 1 to 23; 23 changes nothing.

    Returns
    -------
    array : float32 of the same shape; relative error at most 2^-(bits + 1) for normal numbers.
        NaN and infinity pass unchanged, and so do the few values that would round up to infinity.

    Raises
    ------
    ValueError : `bits` is outside 1 to 23.
    """
    if not 1 <= bits <= MANTISSA_BITS:
        raise ValueError(
            f"keepbits is {bits}; float32 has 1 to {MANTISSA_BITS} mantissa bits; use null to"
            " keep all"
        )
    from numcodecs.bitround import BitRound  # slow to import

    values = np.asarray(values, np.float32)
    if bits == MANTISSA_BITS:
        return values.copy()  # BitRound would return the very same array
    rounded = np.asarray(BitRound(bits).encode(values)).view(np.float32)
    # BitRound carries the largest numbers into infinity and some NaN into numbers
    exceptional = ~np.isfinite(rounded) | np.isnan(values)
    if exceptional.any():
        rounded[exceptional] = values[exceptional]
    return rounded


def rounding(keepbits: int | None) -> float:
    """Return the largest relative error of `keep_mantissa_bits`; 0 if all bits are kept (None)."""
    return 2.0 ** -(keepbits + 1) if keepbits is not None and keepbits < MANTISSA_BITS else 0.0


def bits_for(error_allowed: float) -> int | None:
    """Return the fewest mantissa bits, at least `KEEPBITS`, with a `rounding` of at most
    `error_allowed`; None, for all bits, if fewer do not suffice.

    An `error_allowed` of 0 sets no requirement: the result is `KEEPBITS`.
    """
    if error_allowed <= 0:
        return KEEPBITS
    bits = max(KEEPBITS, int(np.ceil(-np.log2(error_allowed))) - 1)
    return bits if bits < MANTISSA_BITS else None


def portable(ds: xr.Dataset, keepbits: int | None) -> xr.Dataset:
    """Return `ds` in memory, ready to be written.

    Strings are objects, light and pictures are rounded float32, and attributes are JSON types.
    """
    ds = ds.drop_encoding().compute()  # a lazy source must not write parts of a shard
    ds.attrs = jsonable(ds.attrs)
    pictures = {} if keepbits is None else rounded_picture(ds)
    changed = {}
    for name in ds.variables:
        variable = pictures.get(name, ds.variables[name]).copy(deep=False)
        variable.attrs = jsonable(variable.attrs)
        if variable.dtype.kind in "UST":
            variable = variable.astype(object)  # fixed-length strings are not portable zarr v3
        if name in LIGHT:
            light = variable.values
            light = (
                light.astype(np.float32)
                if keepbits is None
                else keep_mantissa_bits(light, keepbits)
            )
            variable = variable.copy(deep=False, data=light)
            variable.attrs["keepbits"] = keepbits
        changed[name] = variable
    return ds.assign(changed)  # in one call: xarray aligns everything at each call


def compression(variable: xr.Variable) -> dict:
    """Return the configuration of the codec blosc for a variable that holds numbers."""
    how = {"cname": "zstd", "clevel": 3, "blocksize": 0}
    if variable.dtype == np.float64:
        how = {"cname": "lz4", "clevel": 5, "blocksize": 0}
    elif ROUNDING in variable.attrs:
        # 2 % smaller for 0.06 CPU s per million pixels; another 2 % by blocks as large as chunks
        how = {"cname": "zstd", "clevel": 5, "blocksize": 2**21}
    return {
        "typesize": variable.dtype.itemsize,
        **how,
        "shuffle": "bitshuffle",
    }


def axis_order(dims: Sequence[Hashable]) -> list[int] | None:
    """Return the order of a chunk's axes when it is compressed; None for the order of `dims`.

    Bands come last. The bands of a tile are alike, so light takes 11 to 13 % less disk than with
    tiles last, and no more time. Level 5 of zstd in blocks as large as chunks would save another
    4 to 5 %, and take twice the time to write.
    """
    if BAND not in dims or dims[-1] == BAND:
        return None
    band = list(dims).index(BAND)
    return [axis for axis in range(len(dims)) if axis != band] + [band]


def tiling(sizes: dict) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the (chunk, shard) shapes of an array with `sizes`; a shard is a whole number of
    chunks.

    Arrays without bands are divided evenly, so that few pixels of a chunk lie outside the array.
    Rows of a chunk are at most 7 pixels longer than needed: blosc shuffles the bits of a chunk only
    if its number of values is a multiple of 8.
    """
    chunks: list[int] = []
    banded = BAND in sizes
    for dim, size in sizes.items():
        most = (TILE if banded else PLANE).get(dim, size)
        if dim in ONE_SHARD_EACH or dim in ONE_CHUNK_EACH:
            chunk = 1
        elif banded:
            chunk = min(size, most)
        else:
            chunk = -(-size // max(1, -(-size // most)))
        chunks.append(chunk)
    if "x" in sizes:
        along_x = list(sizes).index("x")
        others = math.prod(chunks[:along_x] + chunks[along_x + 1 :])
        step = SHUFFLED_TOGETHER // math.gcd(others, SHUFFLED_TOGETHER)
        chunks[along_x] = -(-chunks[along_x] // step) * step
    shards = [
        1 if dim in ONE_SHARD_EACH else -(-size // chunk) * chunk
        for (dim, size), chunk in zip(sizes.items(), chunks, strict=True)
    ]
    return tuple(chunks), tuple(shards)


def jsonable(value: Any) -> Any:
    """Return `value` made of JSON types only; NaN and infinities become the strings of the zarr v3
    standard.
    """
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, float):
        if np.isfinite(value):
            return value
        return "NaN" if np.isnan(value) else "Infinity" if value > 0 else "-Infinity"
    if isinstance(value, dict):
        return {str(k): jsonable(v) for k, v in value.items()}
    if isinstance(value, (set, frozenset)):
        return sorted((jsonable(v) for v in value), key=str)
    if isinstance(value, (list, tuple)):
        return [jsonable(v) for v in value]
    if isinstance(value, np.ndarray):
        return jsonable(value.tolist())
    if isinstance(value, PurePath):
        return str(value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return jsonable({f.name: getattr(value, f.name) for f in dataclasses.fields(value)})
    raise TypeError(
        f"{value!r} ({type(value).__name__}) cannot be written as JSON; expected numbers, text,"
        " lists, dictionaries"
    )


_NOT_FINITE = {"NaN": float("nan"), "Infinity": float("inf"), "-Infinity": float("-inf")}


def restored(value: Any) -> Any:
    """Return the original of a `jsonable` value, as far as JSON can hold it: NaN and infinities
    become numbers again.
    """
    if isinstance(value, dict):
        return {k: restored(v) for k, v in value.items()}
    if isinstance(value, list):
        return [restored(v) for v in value]
    return _NOT_FINITE.get(value, value) if isinstance(value, str) else value

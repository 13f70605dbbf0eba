"""Datasets as files of zarr v3, written without an event loop.

The store of a run has 40 arrays per camera, most of a few numbers. Each folder and each file takes
at least 4 kB of a disk. So the chunks of an array lie beside its metadata. A small array of one
value has no chunk: its metadata hold the value.

The zarr library passes each array through an event loop and threads. For a run of three cameras,
cut to 32 x 32 pixels, this module took 0.18 CPU s, the library 0.93 and xarray's `to_zarr` 1.1
(medians of nine). A store needs little of the format: zarr core 3.0 with the codecs bytes,
vlen-utf8, blosc, crc32c and sharding_indexed 1.0 (zarr-specs.readthedocs.io). All reads use the
zarr library.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import CatalogError
from ..runs.names import check_path
from .encoding import axis_order, compression, jsonable, tiling
from .manifest import FileRecord, file_record

if TYPE_CHECKING:
    import xarray as xr

BYTES = {"name": "bytes", "configuration": {"endian": "little"}}
CHECKSUM = {"name": "crc32c"}
# fill value by kind of number; a missing part of light is NaN, and so is visible
FILL = {
    "b": False,
    "i": 0,
    "u": 0,
    "f": "NaN",
}
METADATA = "zarr.json"
COORDINATES = "coordinates"  # attribute of a group: its coordinates without a dimension


def write_group(root: Path, key: str, attributes: dict) -> dict[str, FileRecord]:
    """Make the group `key` of the store `root` ("" for the root itself) and its parent groups.

    Parameters
    ----------
    root : folder of the store.
    key : path of the group below the root.
    attributes : JSON types.

    Returns
    -------
    dict : every file that was written, by its path below `root`.

    Raises
    ------
    CatalogError : `key` leads out of the store.
    """
    check_path(key)
    folder = root / key
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for around in folder.parents:
        if root in (around, *around.parents) and not (around / METADATA).exists():
            written |= _write_metadata(root, around, "group", attributes={})
    return written | _write_metadata(root, folder, "group", attributes=attributes)


def write_dataset(root: Path, key: str, ds: xr.Dataset) -> dict[str, FileRecord]:
    """Write a Dataset as a group of a store.

    Parameters
    ----------
    root : folder of the store.
    key : path of the group below the store; empty for the root.
    ds : Dataset in memory, with attributes of JSON types.

    Returns
    -------
    dict : every file that was written, by its path below `root`.

    Raises
    ------
    CatalogError : a variable holds neither numbers nor text, or a name leads out of the store.
    """
    for name in ds.variables:
        check_path(str(name), single=True)
    # convention of CF: the coordinates that do not have the name of a dimension
    other_coordinates = sorted(str(name) for name in ds.coords if name not in ds.dims)
    written = write_group(
        root,
        key,
        {**ds.attrs, **({COORDINATES: " ".join(other_coordinates)} if other_coordinates else {})},
    )
    with ThreadPoolExecutor() as pool:
        for name, variable in ds.variables.items():
            written |= _write_array(root, root / key / str(name), variable, pool)
    return written


def consolidate(root: Path) -> dict[str, FileRecord]:
    """Repeat in the root, and in each group of arrays, the metadata of all that is below it.

    Plain xarray looks for these metadata in the group that it opens, and warns if they are missing.
    A group that only holds groups, such as `captures`, is opened through the root.

    Returns
    -------
    dict : every file that was written, by its path below `root`.
    """
    nodes = {
        file.parent.relative_to(root).as_posix(): json.loads(file.read_bytes())
        for file in sorted(root.rglob(METADATA))
    }
    written = {}
    for key, node in nodes.items():
        if node["node_type"] != "group":
            continue
        start = "" if key == "." else f"{key}/"
        below = {
            name[len(start) :]: other
            for name, other in nodes.items()
            if name not in (".", key) and name.startswith(start)
        }
        holds_arrays = any(
            other["node_type"] == "array" for name, other in below.items() if "/" not in name
        )
        if key != "." and not holds_arrays:
            continue
        inline = {"kind": "inline", "must_understand": False, "metadata": below}
        rest = {k: v for k, v in node.items() if k not in ("zarr_format", "node_type")}
        rest["consolidated_metadata"] = inline
        written |= _write_metadata(root, root / key, "group", **rest)
    return written


def _write_array(
    root: Path, folder: Path, variable: xr.Variable, pool: ThreadPoolExecutor
) -> dict[str, FileRecord]:
    values = variable.values
    shard = tuple(max(1, size) for size in values.shape)
    if values.dtype == object and all(isinstance(value, str) for value in values.flat):
        codecs = [{"name": "vlen-utf8"}, CHECKSUM]
        encoded = _text
        fill = ""
    elif values.dtype.kind in FILL and values.itemsize <= 8:
        blosc = compression(variable)
        codecs = [BYTES, {"name": "blosc", "configuration": blosc}, CHECKSUM]
        encoded = _blosc(blosc)
        fill = FILL[values.dtype.kind]
    else:
        raise CatalogError(
            f"the variable {folder.name!r} is of {values.dtype}; a store holds numbers of 8 bytes"
            " at most, and text"
        )
    sharded = {"y", "x"} <= set(variable.dims) and values.size > 0
    if sharded:
        chunk, shard = tiling(dict(variable.sizes))
        order = axis_order(variable.dims)
        if order is not None:
            codecs = [{"name": "transpose", "configuration": {"order": order}}, *codecs]
            encoded = _transposed(order, encoded)
        codecs = [
            {
                "name": "sharding_indexed",
                "configuration": {
                    "chunk_shape": chunk,
                    "codecs": codecs,
                    "index_codecs": [BYTES, CHECKSUM],
                    "index_location": "end",
                },
            }
        ]
        encoded = _sharded(chunk, encoded, pool)
    # light is always written, so that a lost shard is detected
    may_be_left_out = not sharded or values.dtype.kind in "biu"
    alike = may_be_left_out and _all_alike(values)
    folder.mkdir()
    written = _write_metadata(
        root,
        folder,
        "array",
        shape=values.shape,
        data_type="string" if values.dtype == object else values.dtype.name,
        chunk_grid={"name": "regular", "configuration": {"chunk_shape": shard}},
        chunk_key_encoding={"name": "default", "configuration": {"separator": "."}},
        fill_value=jsonable(values.flat[0]) if alike else fill,
        codecs=codecs,
        attributes=variable.attrs,
        dimension_names=variable.dims,
    )
    for position, part in () if alike else _parts(values, shard):
        file = folder / ".".join(["c", *map(str, position)])
        buffers = encoded(part)
        with file.open("wb") as stream:
            stream.writelines(buffers)
        written[file.relative_to(root).as_posix()] = file_record(buffers, sharded)
    return written


def _all_alike(values: np.ndarray) -> bool:
    """Return whether all values are the same, bit by bit (0 is not -0); False if there are none."""
    if values.size == 0:
        return False
    if values.dtype == object:
        return len(set(values.flat)) == 1
    bits = np.ascontiguousarray(values).view(f"u{values.itemsize}")
    return bool((bits == bits.flat[0]).all())


def _parts(
    values: np.ndarray, shape: Sequence[int]
) -> Iterator[tuple[tuple[int, ...], np.ndarray]]:
    """Yield (place, part) of a regular grid of parts of `shape`, in the order of the format. The
    last parts along an axis may be smaller.
    """
    for position in np.ndindex(
        *(-(-size // part) for size, part in zip(values.shape, shape, strict=True))
    ):
        yield (
            position,
            values[
                (
                    *(
                        slice(k * part, (k + 1) * part)
                        for k, part in zip(position, shape, strict=True)
                    ),
                    ...,
                )
            ],
        )


def _text(values: np.ndarray) -> list[bytes]:
    """Return texts in the codec vlen-utf8: their number, then each text after its length."""
    texts = [value.encode() for value in values.flat]
    return _checked(b"".join([_size(len(texts)), *(_size(len(text)) + text for text in texts)]))


def _blosc(configuration: dict[str, int | str]) -> Callable[..., Any]:
    """Return a function(values) -> list of bytes: compressed, and a checksum that turns a flipped
    bit into an error.
    """
    from numcodecs import blosc

    # as zarr sets it; with threads, the bytes would depend on which thread was faster
    blosc.use_threads = False
    codec = blosc.Blosc(
        configuration["cname"],
        configuration["clevel"],
        getattr(blosc, configuration["shuffle"].upper()),
        configuration["blocksize"],
    )
    return lambda values: _checked(
        codec.encode(np.ascontiguousarray(values, values.dtype.newbyteorder("<")))
    )


def _transposed(order: Sequence[int], encoded: Callable[..., Any]) -> Callable[..., Any]:
    """Return `encoded` for values whose axes are put in another order first."""
    return lambda values: encoded(values.transpose(order))


def _sharded(
    chunk: Sequence[int], encoded: Callable[..., Any], pool: ThreadPoolExecutor
) -> Callable[..., Any]:
    """Return a function(values) -> list of bytes of a shard: its chunks, then the start and length
    of each.
    """

    def one(positioned: Sequence[np.ndarray | tuple[int, ...]]) -> list[bytes]:
        _, part = positioned
        short = [(0, whole - size) for whole, size in zip(chunk, part.shape, strict=True)]
        return encoded(np.pad(part, short) if np.any(short) else part)

    def shard(values: np.ndarray) -> list[bytes]:
        chunks = list(pool.map(one, _parts(values, chunk)))
        lengths = np.array([sum(map(len, chunk_bytes)) for chunk_bytes in chunks], "<u8")
        return [buffer for chunk_bytes in chunks for buffer in chunk_bytes] + _checked(
            np.stack([np.cumsum(lengths) - lengths, lengths], 1).tobytes()
        )

    return shard


def _checked(content: bytes) -> list[bytes]:
    import google_crc32c

    return [content, _size(google_crc32c.value(content))]


def _size(number: int) -> bytes:
    return number.to_bytes(4, "little")


def _write_metadata(
    root: Path, folder: Path, node_type: str, **content: Any
) -> dict[str, FileRecord]:
    file = folder / METADATA
    content = {"zarr_format": 3, "node_type": node_type, **content}
    # without spaces, which are a tenth of the metadata
    encoded_json = json.dumps(content, allow_nan=False, separators=(",", ":")).encode()
    file.write_bytes(encoded_json)
    return {file.relative_to(root).as_posix(): file_record([encoded_json])}

"""Exact encoding: results as bytes and back, without any loss.

The decoded value equals the original in every bit: types, order of entries, and memory layout of
arrays, which decides the order in which NumPy adds. A value that cannot be restored exactly is
refused (`NotExact`). Unlike pickle, decoding runs no code from the data.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, field, fields, is_dataclass
from enum import Enum
from typing import Any

import numpy as np
import xarray as xr
from xarray.core.indexes import PandasIndex

ALIGNED = 64  # bytes; each array begins at a multiple of this number
HEAD = 8  # number of bytes that state the length of the JSON text after them
NUMBERS = "biufcSU"  # kinds of arrays whose bytes are the values
MOST_GAPS = 2  # largest memory of an array with gaps, over the memory of its values
TAG = "is"  # key of a JSON object for the type that it encodes


class NotExact(Exception):
    """A value that cannot be restored exactly."""


@dataclass(frozen=True)
class Types:
    """The classes that may be written in addition to those of Python, NumPy and xarray.

    Attributes
    ----------
    known : dataclasses, named tuples and enums, by name. A subclass of one of them is not known.
    """

    known: dict[str, type] = field(default_factory=dict)

    @classmethod
    def of(cls, classes: Iterable[type]) -> Types:
        """Return the table of some classes, whose names differ."""
        return cls({known_class.__name__: known_class for known_class in classes})

    def encoded(self, value: Any) -> list[memoryview | bytes]:
        """Return the bytes of a value, in pieces.

        Raises
        ------
        NotExact : a part of the value cannot be restored exactly.
        """
        writing = _Writing(self)
        content = writing.json(value)
        text = json.dumps({"value": content, "places": writing.places}).encode()
        buffers: list[memoryview | bytes] = [len(text).to_bytes(HEAD, "little"), text]
        buffers.append(bytes(-(HEAD + len(text)) % ALIGNED))
        for array in writing.arrays:
            buffers += [array.data, bytes(-array.nbytes % ALIGNED)]
        return buffers

    def decoded(self, content: np.ndarray) -> Any:
        """Return the value that was encoded.

        Parameters
        ----------
        content : bytes (uint8) of all pieces; arrays of the result are views of it.
        """
        end = HEAD + int.from_bytes(content[:HEAD].tobytes(), "little")
        header = json.loads(content[HEAD:end].tobytes())
        arrays = content[_aligned(end) :]
        buffers = [arrays[first : first + size] for first, size in header["places"]]
        return _Reading(self, buffers).value(header["value"])


def _aligned(size: int) -> int:
    return size + -size % ALIGNED


def _memory(values: np.ndarray) -> np.ndarray:
    """Return the memory of an array from its first to its last value, gaps included (uint8).

    Raises
    ------
    NotExact : a stride is negative or no multiple of the item size, or the array is mostly gaps.
    """
    if not values.size:
        return np.empty(0, np.uint8)
    size = values.itemsize
    steps = [(n - 1) * s for n, s in zip(values.shape, values.strides) if n > 1]
    if any(step < 0 or step % size for step in steps):
        raise NotExact("an array that counts backwards, or a field of records")
    items = sum(steps) // size + 1
    if items > MOST_GAPS * values.size:
        raise NotExact("an array that is mostly gaps")
    flat = np.lib.stride_tricks.as_strided(values, (items,), (size,), writeable=False)
    return flat.view(np.uint8)


class _Writing:
    """Encodes a value as JSON, and collects its arrays."""

    def __init__(self, types: Types) -> None:
        self.types = types
        self.arrays: list[np.ndarray] = []
        self.places: list[tuple[int, int]] = []
        self.end = 0

    def json(self, value: Any) -> Any:
        cls = type(value)
        if value is None or cls in (bool, int, float, str):
            return value
        if cls is list:
            return [self.json(v) for v in value]
        if cls is tuple:
            return {TAG: "tuple", "v": [self.json(v) for v in value]}
        if cls is dict:
            return {TAG: "dict", "v": [[self.json(k), self.json(v)] for k, v in value.items()]}
        if cls is np.ndarray:
            return self.array(value)
        if isinstance(value, np.generic) and value.dtype.kind in NUMBERS and value.nbytes:
            return {TAG: "number", "dtype": value.dtype.str, "v": value.tobytes().hex()}
        if cls is xr.Dataset:
            return self.dataset(value)
        if cls is xr.DataArray:
            return self.data_array(value)
        if self.types.known.get(cls.__name__) is not cls:
            raise NotExact(f"a value of {cls.__module__}.{cls.__qualname__}")
        if issubclass(cls, Enum):
            return {TAG: "enum", "of": cls.__name__, "v": self.json(value.value)}
        if is_dataclass(cls):
            field_pairs = [[f.name, self.json(getattr(value, f.name))] for f in fields(cls)]
            return {TAG: "fields", "of": cls.__name__, "v": field_pairs}
        return {TAG: "named", "of": cls.__name__, "v": [self.json(v) for v in value]}

    def array(self, values: np.ndarray) -> dict[str, Any]:
        if values.dtype == object:
            flat = list(values.flat)
            if not all(type(text) is str for text in flat):
                raise NotExact("an array of objects that are no texts")
            return {TAG: "texts", "shape": values.shape, "v": flat}
        if values.dtype.kind not in NUMBERS or not values.dtype.itemsize:
            raise NotExact(f"an array of {values.dtype}")
        flat = _memory(values)
        self.arrays.append(flat)
        self.places.append((self.end, flat.nbytes))
        self.end += _aligned(flat.nbytes)
        layout = {"dtype": values.dtype.str, "shape": values.shape, "strides": values.strides}
        return {TAG: "array", **layout, "v": len(self.arrays) - 1}

    def variable(self, name: Any, variable: xr.Variable) -> list[Any]:
        dims = [self.json(d) for d in variable.dims]
        return [self.json(name), dims, self.json(variable.values), self.json(dict(variable.attrs))]

    def coordinates(self, data: xr.Dataset | xr.DataArray) -> list[Any]:
        indexed = {name for name, index in data.xindexes.items() if type(index) is PandasIndex}
        if indexed != set(data.xindexes) or indexed != set(data.coords) & set(data.dims):
            raise NotExact("coordinates with an index of their own")
        return [self.variable(name, coord.variable) for name, coord in data.coords.items()]

    def dataset(self, data: xr.Dataset) -> dict[str, Any]:
        return {
            TAG: "dataset",
            "coords": self.coordinates(data),
            "v": [self.variable(name, array.variable) for name, array in data.data_vars.items()],
            "attrs": self.json(dict(data.attrs)),
        }

    def data_array(self, data: xr.DataArray) -> dict[str, Any]:
        return {
            TAG: "data_array",
            "coords": self.coordinates(data),
            "v": self.variable(data.name, data.variable),
        }


class _Reading:
    """Decodes a value from JSON and its arrays."""

    def __init__(self, types: Types, arrays: list[np.ndarray]) -> None:
        self.types = types
        self.arrays = arrays

    def value(self, node: Any) -> Any:
        if isinstance(node, list):
            return [self.value(v) for v in node]
        if not isinstance(node, dict):
            return node
        readers = {
            "tuple": self._tuple,
            "dict": self._dict,
            "number": self._number,
            "texts": self._texts,
            "array": self._array,
            "enum": self._enum,
            "fields": self._fields,
            "named": self._named,
            "dataset": self._dataset,
            "data_array": self._data_array,
        }
        return readers[node[TAG]](node)

    def _tuple(self, node: dict[str, Any]) -> tuple[Any, ...]:
        return tuple(self.value(v) for v in node["v"])

    def _dict(self, node: dict[str, Any]) -> dict[Any, Any]:
        return {self.value(k): self.value(v) for k, v in node["v"]}

    def _number(self, node: dict[str, Any]) -> np.generic:
        return np.frombuffer(bytes.fromhex(node["v"]), node["dtype"])[0]

    def _texts(self, node: dict[str, Any]) -> np.ndarray:
        values = np.empty(len(node["v"]), object)
        values[:] = node["v"]
        return values.reshape(node["shape"])

    def _array(self, node: dict[str, Any]) -> np.ndarray:
        memory = self.arrays[node["v"]]
        dtype = np.dtype(node["dtype"])
        if not memory.size:
            return np.empty(node["shape"], dtype)
        return np.ndarray(node["shape"], dtype, memory.data, strides=node["strides"])

    def _enum(self, node: dict[str, Any]) -> Any:
        return self.types.known[node["of"]](self.value(node["v"]))

    def _fields(self, node: dict[str, Any]) -> Any:
        return self.types.known[node["of"]](**{k: self.value(v) for k, v in node["v"]})

    def _named(self, node: dict[str, Any]) -> Any:
        return self.types.known[node["of"]](*(self.value(v) for v in node["v"]))

    def _variable(self, node: list[Any]) -> tuple[Any, xr.Variable]:
        name, dims, values, attrs = (self.value(part) for part in node)
        return name, xr.Variable(dims, values, attrs)

    def _dataset(self, node: dict[str, Any]) -> xr.Dataset:
        coords = dict(map(self._variable, node["coords"]))
        return xr.Dataset(dict(map(self._variable, node["v"])), coords, self.value(node["attrs"]))

    def _data_array(self, node: dict[str, Any]) -> xr.DataArray:
        name, variable = self._variable(node["v"])
        coords = dict(map(self._variable, node["coords"]))
        return xr.DataArray(
            variable.values, coords, variable.dims, name, attrs=dict(variable.attrs)
        )

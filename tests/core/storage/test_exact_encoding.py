"""The exact encoding restores values, types, order and memory layout."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
import pytest
import xarray as xr

from isethdr_core.storage.exact_encoding import ALIGNED, NotExact, Types


class Colour(StrEnum):
    RED = "red"


class Pair(NamedTuple):
    low: float
    high: float


@dataclass(frozen=True)
class Part:
    name: str
    values: np.ndarray
    colour: Colour | None = None


TYPES = Types.of((Colour, Pair, Part))


def again(value):
    data = np.frombuffer(b"".join(TYPES.encoded(value)), np.uint8).copy()
    return TYPES.decoded(data)


def test_plain_values_keep_their_types():
    value = {
        "tuple": (1, 2.5, "text", None, True),
        "list": [math.inf, -0.0, 1e-310, 2**80],
        3: np.float32(0.1),
        ("a", 1): np.bool_(True),
        "nested": {"named": Pair(1.0, 2.0), "enum": Colour.RED},
        "is": "tuple",  # a word that the encoding itself uses
    }
    found = again(value)
    assert found == value and repr(found) == repr(value)
    assert list(found) == list(value)
    assert type(found[3]) is np.float32 and type(found["nested"]["enum"]) is Colour
    assert type(found["nested"]["named"]) is Pair
    assert math.isnan(again(math.nan))


@pytest.mark.parametrize("dtype", ["bool", "uint8", ">u2", "int64", "float32", "float64", "<U3"])
def test_arrays_keep_type_shape_and_values(dtype):
    values = np.arange(24).reshape(2, 3, 4).astype(dtype)
    found = again(values)
    assert found.dtype == values.dtype and found.shape == values.shape
    np.testing.assert_array_equal(found, values)
    assert found.flags.writeable
    assert again(np.empty((0, 3), dtype)).shape == (0, 3)
    assert again(values[0, 0, 0]) == values[0, 0, 0]


def test_arrays_lie_in_memory_as_before_so_that_sums_agree_to_the_last_bit():
    base = np.random.default_rng(0).lognormal(0, 9, (31, 40, 50))
    views = {
        "transposed": np.moveaxis(base, 0, -1),
        "cropped": base[:, 3:, :-1],
        "every third": base[:, :, ::3][:, :, :9],
        "broadcast": np.broadcast_to(base[:, :1], base.shape),
        "Fortran": np.asfortranarray(base),
    }
    kept = {"transposed", "cropped", "broadcast", "Fortran"}
    for name, view in views.items():
        if name not in kept:
            with pytest.raises(NotExact):
                again(view)
            continue
        found = again(view)
        np.testing.assert_array_equal(found, view)
        assert found.strides == view.strides, name
        assert float(found.sum()) == float(view.sum()), name
    with pytest.raises(NotExact):
        again(base[::-1])


def test_datasets_keep_coordinates_attributes_and_types_of_both():
    data = xr.Dataset(
        {
            "raw": (("y", "x"), np.arange(6, dtype="<u2").reshape(2, 3), {"units": "DN"}),
            "gain": ((), np.float64(2.0)),
        },
        coords={
            "x": np.array([0.5, 1.5, 2.5], np.float32),
            "filter": (("y", "x"), np.zeros((2, 3), np.uint8)),
            "channel": np.array(["R", "G", "red and green"], object),
        },
        attrs={"places": (1.0, np.float64(2.0)), "table": np.eye(2)},
    )
    found = again(data)
    xr.testing.assert_identical(found, data)
    assert {n: v.dtype for n, v in found.variables.items()} == {
        n: v.dtype for n, v in data.variables.items()
    }
    assert type(found.attrs["places"]) is tuple
    assert type(found.attrs["places"][1]) is np.float64
    plane = data["raw"].rename("light")
    xr.testing.assert_identical(again(plane), plane)
    assert again(plane).name == "light"


def test_known_classes_come_back_and_others_are_refused():
    part = again(Part("wing", np.ones(3, np.float32), Colour.RED))
    assert type(part) is Part and part.colour is Colour.RED and part.values.dtype == np.float32

    class Other(Pair):
        pass

    unknown = [{1, 2}, object(), Other(1.0, 2.0), b"bytes", np.array([1, "a"], object), len]
    for value in unknown:
        with pytest.raises(NotExact):
            again({"a": value})
    stacked = xr.DataArray(np.eye(2), {"a": [1, 2], "b": [3, 4]}, ("a", "b")).stack(c=("a", "b"))
    with pytest.raises(NotExact):  # its index would come back as something else
        again(stacked)


def test_every_array_begins_at_a_multiple_of_the_alignment():
    pieces = TYPES.encoded([np.ones(5, np.uint8), np.ones(3), np.ones(1, np.float32)])
    start = 0
    starts = []
    for piece in pieces:
        starts += [start] if isinstance(piece, memoryview) else []
        start += len(piece)
    assert len(starts) == 3 and all(place % ALIGNED == 0 for place in starts)

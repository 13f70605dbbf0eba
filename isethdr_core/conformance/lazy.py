"""Arrays outside memory: sealed arrays, whose values must not be read, and arrays of a store, which
are read piece by piece.
"""

from __future__ import annotations

from collections.abc import Callable
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ..storage.store import open_store, write_store
from .promise import Data, holds, keeps, same

ARRAY = "radiance"  # the name under which a DataArray is stored


class ReadTooEarly(Exception):
    """The values of a sealed array were read."""


class _Sealed(BackendArray):
    def __init__(self, shape: tuple[int, ...], dtype: npt.DTypeLike) -> None:
        self.shape = shape
        self.dtype = dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        raise ReadTooEarly("it read the values before it looked at dims, units and coordinates")


def sealed(data: Data, *names: str) -> Data:
    """Return a DataArray, or a Dataset with its variables `names`, whose values cannot be read;
    dims, coordinates and units stay.

    Input with a mistake in its form must be refused before its values are read: reading and
    computing can take minutes.
    """
    if isinstance(data, xr.DataArray):
        return data.copy(data=indexing.LazilyIndexedArray(_Sealed(data.shape, data.dtype)))
    return data.assign({name: sealed(data[name]) for name in names})


def same_from_store(subject: str, call: Callable[[Data], object], data: Data, want: object) -> None:
    """Raise AssertionError if `call(data)` differs from `want` in a bit when `data` is read lazily
    from a store.

    Parameters
    ----------
    subject : name of the component in messages, for example "lens 'wavefront'".
    call : function of the component under test.
    data : input of `call`, in memory.
    want : result of `call` for the data in memory.
    """
    promise = "data opened from a store gives the same bits as data in memory"
    with TemporaryDirectory() as folder:
        dataset = data.to_dataset(name=ARRAY) if isinstance(data, xr.DataArray) else data
        path = write_store(folder, "kit", {"": dataset.assign_attrs(data.attrs)}, {}, keepbits=None)
        stored = open_store(path).assign_attrs(data.attrs)
        first = next(iter(stored.data_vars))
        holds(subject, promise, not stored[first].variable._in_memory, "nothing lazy was tested")
        with keeps(subject, promise):
            if isinstance(data, xr.DataArray):
                result = call(stored[ARRAY].assign_attrs(data.attrs))
            else:
                result = call(stored)
            same(subject, promise, result, want)

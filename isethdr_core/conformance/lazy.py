"""Arrays that are not in memory: sealed ones, which nobody may read, and those of a store, which
are read piece by piece.
"""

from __future__ import annotations

from tempfile import TemporaryDirectory

import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ..storage.store import open_store, write_store
from .promise import holds, keeps, same

ARRAY = "radiance"  # the name under which a DataArray is stored


class ReadTooEarly(Exception):
    """The values of a sealed array were asked for."""


class _Sealed(BackendArray):
    def __init__(self, shape, dtype):
        self.shape, self.dtype = shape, dtype

    def __getitem__(self, key):
        raise ReadTooEarly("it read the values before it looked at dims, units and coordinates")


def sealed(data, *names: str):
    """Return a DataArray, or a Dataset with its variables `names`, whose values cannot be read;
    dims, coordinates and units stay.

    Bad input of this kind has to be refused by its form alone: before the minutes that reading and
    computing take.
    """
    if isinstance(data, xr.DataArray):
        return data.copy(data=indexing.LazilyIndexedArray(_Sealed(data.shape, data.dtype)))
    return data.assign({name: sealed(data[name]) for name in names})


def same_from_store(who: str, call, data, want) -> None:
    """Raise AssertionError unless `call(data)` gives the bits of `want` where `data` is read lazily
    from a store.
    """
    promise = "data opened from a store gives the same bits as data in memory"
    array = isinstance(data, xr.DataArray)
    with TemporaryDirectory() as folder:
        whole = data.to_dataset(name=ARRAY) if array else data
        kept = write_store(folder, "kit", {"": whole.assign_attrs(data.attrs)}, {}, keepbits=None)
        opened = open_store(kept)
        found = opened[ARRAY].assign_attrs(data.attrs) if array else opened.assign_attrs(data.attrs)
        holds(
            who,
            promise,
            not (found if array else found[next(iter(found.data_vars))]).variable._in_memory,
            "nothing lazy was tested",
        )
        with keeps(who, promise):
            same(who, promise, call(found), want)

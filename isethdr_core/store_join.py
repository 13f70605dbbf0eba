"""Join the stores of one scene along light_group without reading them.

xarray's own concat reads every array unless dask is installed; the small lazy array here reads only the
groups that are asked for.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing


def join_groups(scenes: list[xr.Dataset], bands_nm) -> xr.Dataset:
    """Return the first scene, extended by the groups and labels that the others add.

    Parameters
    ----------
    scenes : scene radiance Datasets of one recipe; the first wins where two hold the same group. One on
        another grid, or without all of the bands, adds nothing.
    bands_nm : the band centres of the result, nm; the first scene has all of them.

    Returns
    -------
    Dataset : lazy where the inputs are; `groups` and `noise` in the attributes cover all groups.
    """
    base = _with_bands(scenes[0], bands_nm)
    held, parts = set(base.light_group.values), [base]
    for other in scenes[1:]:
        if not set(bands_nm) <= set(other.wavelength.values):
            continue
        other = _with_bands(other, bands_nm)
        if not all(np.array_equal(base[d].values, other[d].values) for d in ("y", "x")):
            continue
        new = [i for i, group in enumerate(other.light_group.values) if group not in held]
        held.update(other.light_group.values)
        if new:
            parts.append(other.isel(light_group=new))
        labels = [name for name in other.data_vars if "light_group" not in other[name].dims and name not in base]
        base = base.assign({name: other[name].variable for name in labels})
    if len(parts) == 1:
        return base
    groups = np.concatenate([p.light_group.values for p in parts]).astype(object)
    cube = base.radiance.variable
    lazy = indexing.LazilyIndexedArray(_Joined([p.radiance.variable for p in parts]))
    joined = base.drop_vars("radiance").drop_vars("light_group").assign_coords(light_group=groups)
    joined["radiance"] = xr.Variable(cube.dims, lazy, cube.attrs)
    joined.attrs |= {"groups": list(groups), "noise": {k: v for p in parts[::-1] for k, v in (p.attrs.get("noise") or {}).items()}}
    return joined


def _with_bands(scene: xr.Dataset, bands_nm) -> xr.Dataset:
    return scene if np.array_equal(scene.wavelength.values, bands_nm) else scene.sel(wavelength=list(bands_nm))


class _Joined(BackendArray):
    """Several variables after one another along their first dim, read one part at a time."""

    def __init__(self, parts: list[xr.Variable]):
        self.parts = parts
        self.starts = np.cumsum([0, *(p.shape[0] for p in parts)])
        self.shape = (int(self.starts[-1]), *parts[0].shape[1:])
        self.dtype = parts[0].dtype

    def __getitem__(self, key):
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key):
        first, rest = key[0], key[1:]
        wanted = np.atleast_1d(np.arange(self.shape[0])[first])
        part = np.searchsorted(self.starts, wanted, side="right") - 1
        out = [np.asarray(self.parts[p][(int(i - self.starts[p]), *rest)].values) for p, i in zip(part, wanted)]
        if np.ndim(np.arange(self.shape[0])[first]) == 0:
            return out[0]
        return np.stack(out) if out else np.empty((0, *self.parts[0][(0, *rest)].shape), self.dtype)

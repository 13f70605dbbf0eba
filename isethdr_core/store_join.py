"""Join the stores of one scene along light group and wavelength without reading them.

xarray's own concat reads every array unless dask is installed; the small lazy array here reads only what is asked
for, each part from the first store that has it.
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing


def join_scenes(scenes: list[xr.Dataset], wanted=None) -> xr.Dataset:
    """Return the first scene, extended by the groups, bands and labels that the others add.

    Parameters
    ----------
    scenes : scene radiance Datasets of one recipe; the first wins where two hold the same. One on another grid adds nothing.
    wanted : names of the light groups that decide about the bands; None: those known at all bands of the first scene.

    Returns
    -------
    Dataset : lazy where the inputs are. Its bands, nm, are those that some store has for each of the `wanted` groups; its
        groups are all that have all these bands. `groups` and `noise` in the attributes cover them.
    """
    base, scenes = scenes[0], [s for s in scenes if all(np.array_equal(scenes[0][d].values, s[d].values) for d in ("y", "x"))]
    held = _held(scenes)
    if wanted is None:
        wanted = [g for g in held if set(base.wavelength.values) <= held[g].keys()]
    bands = sorted(set.intersection(*(set(held[g]) for g in wanted if g in held)))
    groups = [g for g in held if set(bands) <= held[g].keys()]
    joined = base.drop_vars("radiance").drop_dims(["light_group", "wavelength"], errors="ignore")
    for other in scenes[1:]:
        labels = [name for name in other.data_vars if "light_group" not in other[name].dims and name not in joined]
        joined = joined.assign({name: other[name].variable for name in labels})
    if len(scenes) == 1 and len(bands) == base.sizes["wavelength"]:
        return base
    places = np.array([[held[g][b] for b in bands] for g in groups])
    cube = base["radiance"].variable
    lazy = indexing.LazilyIndexedArray(_Joined([s["radiance"].variable for s in scenes], places))
    bands_nm = ("wavelength", np.array(bands), base.wavelength.attrs)
    joined = joined.assign_coords(light_group=np.array(groups, object), wavelength=bands_nm)
    joined["radiance"] = xr.Variable(cube.dims, lazy, cube.attrs)
    if all("xyz_noise" in s for s in scenes):
        planes = [scenes[k]["xyz_noise"].variable[i] for k, i, _ in places[:, 0]]
        joined["xyz_noise"] = xr.Variable(("light_group", "xyz_channel", "y", "x"), np.stack([p.values for p in planes]), planes[0].attrs)
    noise = {g: (scenes[places[i, 0, 0]].attrs.get("noise") or {}).get(g) for i, g in enumerate(groups)}
    joined.attrs |= {"groups": groups, "noise": {g: v for g, v in noise.items() if v is not None}}
    return joined


def _held(scenes) -> dict[str, dict[float, tuple[int, int, int]]]:
    """Return {group: {band in nm: (scene, position of the group in it, position of the band)}} of the first scene that has each."""
    held: dict[str, dict] = {}
    for k, scene in enumerate(scenes):
        for i, group in enumerate(scene.light_group.values):
            for j, band in enumerate(scene.wavelength.values):
                held.setdefault(str(group), {}).setdefault(float(band), (k, i, j))
    return held


class _Joined(BackendArray):
    """Radiance (light_group, wavelength, y, x) put together from several variables.

    `places` (light_group, wavelength, 3) says for each plane which variable holds it and where.
    """

    def __init__(self, parts: list[xr.Variable], places: np.ndarray):
        self.parts, self.places = parts, places
        self.shape = (*places.shape[:2], *parts[0].shape[2:])
        self.dtype = parts[0].dtype

    def __getitem__(self, key):
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.OUTER, self._read)

    def _read(self, key):
        wanted = [np.arange(n)[k] for n, k in zip(self.shape, key, strict=True)]
        groups, bands, *inside = (np.atleast_1d(w) for w in wanted)
        out = np.empty((len(groups), len(bands), *map(len, inside)), self.dtype)
        for row, group in zip(out, groups, strict=True):
            part, first, second = self.places[group, bands].T
            for p in np.unique(part):
                here = np.flatnonzero(part == p)
                row[here] = self.parts[p][(int(first[here[0]]), _run(second[here]), *key[2:])].values.reshape(row[here].shape)
        return out.reshape([n for w in wanted for n in w.shape])


def _run(positions: np.ndarray):
    """Return positions that follow each other as a slice, which a store reads as one piece; others as they are."""
    first, last = int(positions[0]), int(positions[-1])
    return slice(first, last + 1) if np.array_equal(positions, np.arange(first, last + 1)) else positions

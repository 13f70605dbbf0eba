"""Join the stores of one scene along light group and wavelength without reading them, and pool
those that hold the same light.

xarray's own concat reads every array unless dask is installed; the small lazy array here reads only
what is asked for, each part from the stores that have it: the first one, or the mean of all that
followed paths of their own (`sample_accumulation`).
"""

from __future__ import annotations

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ..runs.sample_accumulation import pooled, pooled_noise

Plane = tuple[
    int, int, int, float
]  # number of a scene, position of the group in it, position of the band, weight


def join_scenes(scenes: list[xr.Dataset], wanted=None) -> xr.Dataset:
    """Return the first scene, extended by the groups, bands and labels that the others add, and by
    their paths.

    Parameters
    ----------
    scenes : scene radiance Datasets of one recipe. Where two hold the same, they are pooled if both
        state other paths in `path_span`, else the first wins. One on another grid adds nothing.
    wanted : names of the light groups that decide about the bands; None: those known at all bands
        of the first scene.

    Returns
    -------
    Dataset : lazy where the inputs are. Its bands, nm, are those that some store has for each of
        the `wanted` groups; its groups are all that have all these bands. `groups`, `noise` and,
        where paths are stated, `paths` in the attributes cover them.
    """
    base, scenes = (
        scenes[0],
        [
            s
            for s in scenes
            if all(np.array_equal(scenes[0][d].values, s[d].values) for d in ("y", "x"))
        ],
    )
    held = _held(scenes)
    if wanted is None:
        wanted = [g for g in held if set(base.wavelength.values) <= held[g].keys()]
    bands = sorted(set.intersection(*(set(held[g]) for g in wanted if g in held)))
    groups = [g for g in held if set(bands) <= held[g].keys()]
    ways = {g: _ways(held[g], bands, scenes, g) for g in groups}
    paths = {
        g: min(sum(_paths(scenes[k], g) for k, _, _ in way) for way in ways[g]) for g in groups
    }
    noise = {g: v for g in groups if (v := _noise(scenes, ways[g], g)) is not None}
    stated = {"groups": groups, "noise": noise} | ({"paths": paths} if all(paths.values()) else {})
    if len(scenes) == 1 and len(bands) == base.sizes["wavelength"]:
        return base.assign_attrs(paths=paths) if "paths" in stated else base
    joined = base.drop_vars("radiance").drop_dims(["light_group", "wavelength"], errors="ignore")
    for other in scenes[1:]:
        labels = [
            name
            for name in other.data_vars
            if "light_group" not in other[name].dims and name not in joined
        ]
        joined = joined.assign({name: other[name].variable for name in labels})
    cube = base["radiance"].variable
    lazy = indexing.LazilyIndexedArray(
        _Joined(
            [s["radiance"].variable for s in scenes], [[held[g][b] for b in bands] for g in groups]
        )
    )
    bands_nm = ("wavelength", np.array(bands), base.wavelength.attrs)
    joined = joined.assign_coords(light_group=np.array(groups, object), wavelength=bands_nm)
    joined["radiance"] = xr.Variable(cube.dims, lazy, cube.attrs)
    if all("xyz_noise" in s for s in scenes):
        planes = np.stack([_noise_planes(scenes, ways[g]) for g in groups])
        joined["xyz_noise"] = xr.Variable(
            ("light_group", "xyz_channel", "y", "x"), planes, scenes[0]["xyz_noise"].attrs
        )
    if all("half_difference" in s for s in scenes):
        planes = np.stack([_half_planes(scenes, ways[g]) for g in groups])
        joined["half_difference"] = xr.Variable(
            ("light_group", "y", "x"), planes, scenes[0]["half_difference"].attrs
        )
    joined.attrs |= stated
    return joined


def _held(scenes) -> dict[str, dict[float, list[Plane]]]:
    """Return {group: {band in nm: the planes whose weighted sum it is}}."""
    every: dict[str, dict] = {}
    for k, scene in enumerate(scenes):
        for i, group in enumerate(map(str, scene.light_group.values)):
            for j, band in enumerate(scene.wavelength.values):
                every.setdefault(group, {}).setdefault(float(band), []).append((k, i, j))
    return {
        group: {band: _weighted(planes, scenes, group) for band, planes in bands.items()}
        for group, bands in every.items()
    }


def _weighted(planes, scenes, group) -> list[Plane]:
    kept = [
        planes[n]
        for n in pooled([(scenes[k].attrs.get("path_span") or {}).get(group) for k, _, _ in planes])
    ]
    paths = [_paths(scenes[k], group) for k, _, _ in kept]
    return [
        (*plane, n / sum(paths) if len(kept) > 1 else 1.0)
        for plane, n in zip(kept, paths, strict=True)
    ]


def _paths(scene, group) -> int:
    first, end = (scene.attrs.get("path_span") or {}).get(group, (0, 0))
    return end - first


def _ways(held, bands, scenes, group) -> list[tuple]:
    """Return the different ways in which bands of a group are put together, each as ((scene,
    position of the group, weight), ...).
    """
    return list(dict.fromkeys(tuple((k, i, weight) for k, i, _, weight in held[b]) for b in bands))


def _noise(scenes, ways, group):
    """Return the noise that is stated of a group: of the bands that are known worst. None where
    none is.
    """
    found = []
    for way in ways:
        stated = [(scenes[k].attrs.get("noise") or {}).get(group) for k, _, _ in way]
        found.append(stated[0] if len(way) == 1 else pooled_noise([w for *_, w in way], stated))
    found = [n for n in found if n is not None]
    return (found[0] if len(ways) == 1 else max(found)) if found else None


def _noise_planes(scenes, ways) -> np.ndarray:
    """Return the standard errors (xyz_channel, y, x) of X, Y and Z of a group.

    Stores of one way are independent: squares add up. Bands that were put together in different
    ways may share their paths, and are taken as if they did: an upper bound.
    """
    squares = lambda way: sum(
        (weight * scenes[k]["xyz_noise"].variable[i].values.astype(float)) ** 2
        for k, i, weight in way
    )
    return sum(np.sqrt(squares(way)) for way in ways).astype(np.float32)


def _half_planes(scenes, ways) -> np.ndarray:
    """Return what halves of a group's paths differ by (y, x): a mean, as the light itself, and
    summed over bands that were put together in different ways.
    """
    mean = lambda way: sum(
        weight * scenes[k]["half_difference"].variable[i].values.astype(float)
        for k, i, weight in way
    )
    return sum(mean(way) for way in ways).astype(np.float32)


class _Joined(BackendArray):
    """Radiance (light_group, wavelength, y, x) put together from several variables:
    `planes[group][wavelength]` says of which.
    """

    def __init__(self, parts: list[xr.Variable], planes: list[list[list[Plane]]]):
        self.parts, self.planes = parts, planes
        self.shape = (len(planes), len(planes[0]), *parts[0].shape[2:])
        self.dtype = parts[0].dtype

    def __getitem__(self, key):
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._read
        )

    def _read(self, key):
        wanted = [np.arange(n)[k] for n, k in zip(self.shape, key, strict=True)]
        groups, bands, *inside = (np.atleast_1d(w) for w in wanted)
        # a mean is summed in float64, what comes from one store is passed on bit for bit
        several = any(len(self.planes[g][b]) > 1 for g in groups for b in bands)
        out = np.zeros(
            (len(groups), len(bands), *map(len, inside)), float if several else self.dtype
        )
        for row, group in zip(out, groups, strict=True):
            pieces: dict[
                tuple, list
            ] = {}  # (part, position of the group, weight): (where it goes, position of the band)
            for here, band in enumerate(bands):
                for part, first, second, weight in self.planes[group][band]:
                    pieces.setdefault((part, first, weight), []).append((here, second))
            for (part, first, weight), places in pieces.items():
                here, second = np.array(places).T
                values = self.parts[part][(first, _run(second), *key[2:])].values
                row[here] += np.multiply(values, weight, dtype=out.dtype).reshape(row[here].shape)
        return out.astype(self.dtype, copy=False).reshape([n for w in wanted for n in w.shape])


def _run(positions: np.ndarray):
    """Return positions that follow each other as a slice, which a store reads as one piece; others
    as they are.
    """
    first, last = int(positions[0]), int(positions[-1])
    return (
        slice(first, last + 1)
        if np.array_equal(positions, np.arange(first, last + 1))
        else positions
    )

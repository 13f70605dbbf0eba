"""Join the stores of one scene lazily along light group and wavelength, and average stores that
hold the same light.

xarray's own concat reads every array unless dask is installed. The small lazy array of this module
reads only the requested parts from the stores that hold them: from the first store, or the mean
over all stores with different paths (`sample_accumulation`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from ..errors import ConfigError
from ..runs.sample_accumulation import pooled, pooled_noise

if TYPE_CHECKING:
    from xarray.core.indexing import BasicIndexer, OuterIndexer

# number of a scene, position of the group in it, position of the band, weight
Plane = tuple[int, int, int, float]


def join_scenes(scenes: list[xr.Dataset], groups_asked: Sequence[str] | None = None) -> xr.Dataset:
    """Return the first scene, extended by the groups, bands, labels and paths of the other scenes.

    Parameters
    ----------
    scenes : scene radiance Datasets of one recipe. Scenes that hold the same light are pooled if
        both state different paths in `path_span`; otherwise the first one is used. A scene on
        another grid adds nothing.
    groups_asked : names of the light groups that decide which bands are returned; None: the groups
        that have all bands of the first scene.

    Returns
    -------
    Dataset : lazy if the inputs are. Its bands, nm, are those stored for all of `groups_asked`. Its
        groups are all groups that have these bands. The attributes `groups`, `noise` and, if paths
        are stated, `paths` describe them.

    Raises
    ------
    ConfigError : no scene holds any of `groups_asked`.
    """
    base = scenes[0]
    scenes = [
        s
        for s in scenes
        if all(np.array_equal(scenes[0][d].values, s[d].values) for d in ("y", "x"))
    ]
    planes_held = _held(scenes)
    if groups_asked is None:
        groups_asked = [
            g for g in planes_held if set(base.wavelength.values) <= planes_held[g].keys()
        ]
    lit = [g for g in groups_asked if g in planes_held]
    if not lit:
        raise ConfigError(
            f"the stored scene has no light of the groups {', '.join(groups_asked) or 'asked for'};"
            f" expected a lighting with a weight for some of {', '.join(planes_held)}"
        )
    bands = sorted(set.intersection(*(set(planes_held[g]) for g in lit)))
    groups = [g for g in planes_held if set(bands) <= planes_held[g].keys()]
    combinations = {g: _ways(planes_held[g], bands) for g in groups}
    paths = {
        g: min(
            sum(_paths(scenes[k], g) for k, _, _ in combination) for combination in combinations[g]
        )
        for g in groups
    }
    noise = {g: v for g in groups if (v := _noise(scenes, combinations[g], g)) is not None}
    attributes = {"groups": groups, "noise": noise} | (
        {"paths": paths} if all(paths.values()) else {}
    )
    if len(scenes) == 1 and len(bands) == base.sizes["wavelength"]:
        return base.assign_attrs(paths=paths) if "paths" in attributes else base
    joined = base.drop_vars("radiance").drop_dims(["light_group", "wavelength"], errors="ignore")
    for scene in scenes[1:]:
        labels = [
            name
            for name in scene.data_vars
            if "light_group" not in scene[name].dims and name not in joined
        ]
        joined = joined.assign({name: scene[name].variable for name in labels})
    cube = base["radiance"].variable
    lazy = indexing.LazilyIndexedArray(
        _Joined(
            [s["radiance"].variable for s in scenes],
            [[planes_held[g][b] for b in bands] for g in groups],
        )
    )
    bands_nm = ("wavelength", np.array(bands), base.wavelength.attrs)
    joined = joined.assign_coords(light_group=np.array(groups, object), wavelength=bands_nm)
    joined["radiance"] = xr.Variable(cube.dims, lazy, cube.attrs)
    if all("xyz_noise" in s for s in scenes):
        planes = np.stack([_noise_planes(scenes, combinations[g]) for g in groups])
        joined["xyz_noise"] = xr.Variable(
            ("light_group", "xyz_channel", "y", "x"), planes, scenes[0]["xyz_noise"].attrs
        )
    if all("half_difference" in s for s in scenes):
        planes = np.stack([_half_planes(scenes, combinations[g]) for g in groups])
        joined["half_difference"] = xr.Variable(
            ("light_group", "y", "x"), planes, scenes[0]["half_difference"].attrs
        )
    joined.attrs |= attributes
    return joined


def _held(scenes: Sequence[xr.Dataset]) -> dict[str, dict[float, list[Plane]]]:
    """Return {group: {band in nm: the planes whose weighted sum is the light}}."""
    every: dict[str, dict] = {}
    for k, scene in enumerate(scenes):
        for i, group in enumerate(map(str, scene.light_group.values)):
            for j, band in enumerate(scene.wavelength.values):
                every.setdefault(group, {}).setdefault(float(band), []).append((k, i, j))
    return {
        group: {band: _weighted(planes, scenes, group) for band, planes in bands.items()}
        for group, bands in every.items()
    }


def _weighted(
    planes: Sequence[tuple[int, int, int]], scenes: Sequence[xr.Dataset], group: str
) -> list[Plane]:
    pooled_planes = [
        planes[n]
        for n in pooled([(scenes[k].attrs.get("path_span") or {}).get(group) for k, _, _ in planes])
    ]
    paths = [_paths(scenes[k], group) for k, _, _ in pooled_planes]
    return [
        (*plane, n / sum(paths) if len(pooled_planes) > 1 else 1.0)
        for plane, n in zip(pooled_planes, paths, strict=True)
    ]


def _paths(scene: xr.Dataset, group: str) -> int:
    first, end = (scene.attrs.get("path_span") or {}).get(group, (0, 0))
    return end - first


def _ways(planes_held: dict[float, list[tuple[Any, ...]]], bands: Sequence[float]) -> list[tuple]:
    """Return the different combinations of scenes for the bands of a group, each as ((scene,
    position of the group, weight), ...).
    """
    return list(
        dict.fromkeys(tuple((k, i, weight) for k, i, _, weight in planes_held[b]) for b in bands)
    )


def _noise(
    scenes: Sequence[xr.Dataset], combinations: Sequence[tuple[tuple[Any, ...], ...]], group: str
) -> float | None:
    """Return the stated noise of a group, that of its noisiest bands; None if none is stated."""
    noises = []
    for combination in combinations:
        noise_by_part = [(scenes[k].attrs.get("noise") or {}).get(group) for k, _, _ in combination]
        noises.append(
            noise_by_part[0]
            if len(combination) == 1
            else pooled_noise([w for *_, w in combination], noise_by_part)
        )
    noises = [n for n in noises if n is not None]
    return (noises[0] if len(combinations) == 1 else max(noises)) if noises else None


def _noise_planes(scenes: Sequence[xr.Dataset], combinations: Sequence[Any]) -> np.ndarray:
    """Return the standard errors (xyz_channel, y, x) of X, Y and Z of a group.

    Stores combined in the same way are independent, so their squares add up. Bands combined in
    different ways may share paths. They are treated as fully dependent, which gives an upper bound.
    """
    squares = lambda way: sum(
        (weight * scenes[k]["xyz_noise"].variable[i].values.astype(float)) ** 2
        for k, i, weight in way
    )
    return sum(np.sqrt(squares(way)) for way in combinations).astype(np.float32)


def _half_planes(scenes: Sequence[xr.Dataset], combinations: Sequence[Any]) -> np.ndarray:
    """Return the differences (y, x) between the half buffers of a group: averaged over stores
    like the light itself, and summed over bands that are combined in different ways.
    """
    mean = lambda way: sum(
        weight * scenes[k]["half_difference"].variable[i].values.astype(float)
        for k, i, weight in way
    )
    return sum(mean(way) for way in combinations).astype(np.float32)


class _Joined(BackendArray):
    """Radiance (light_group, wavelength, y, x) combined from several variables.
    `planes[group][wavelength]` lists them.
    """

    def __init__(self, variables: list[xr.Variable], planes: list[list[list[Plane]]]) -> None:
        self.parts = variables
        self.planes = planes
        self.shape = (len(planes), len(planes[0]), *variables[0].shape[2:])
        self.dtype = variables[0].dtype

    def __getitem__(self, key: BasicIndexer | OuterIndexer) -> np.ndarray:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._read
        )

    def _read(self, key: Any) -> np.ndarray:
        indices = [np.arange(n)[k] for n, k in zip(self.shape, key, strict=True)]
        groups, bands, *inside = (np.atleast_1d(w) for w in indices)
        # a mean is summed in float64; light from a single store is returned bit for bit
        several = any(len(self.planes[g][b]) > 1 for g in groups for b in bands)
        values_read = np.zeros(
            (len(groups), len(bands), *map(len, inside)), float if several else self.dtype
        )
        for row, group in zip(values_read, groups, strict=True):
            # {(part, position of the group, weight): [(index in the result, position of the band)]}
            bands_of_plane: dict[tuple, list] = {}
            for target, band in enumerate(bands):
                for part, first, second, weight in self.planes[group][band]:
                    bands_of_plane.setdefault((part, first, weight), []).append((target, second))
            for (part, first, weight), band_pairs in bands_of_plane.items():
                target, second = np.array(band_pairs).T
                values = self.parts[part][(first, _run(second), *key[2:])].values
                row[target] += np.multiply(values, weight, dtype=values_read.dtype).reshape(
                    row[target].shape
                )
        return values_read.astype(self.dtype, copy=False).reshape(
            [n for w in indices for n in w.shape]
        )


def _run(positions: np.ndarray) -> Any:
    """Return consecutive positions as a slice, which a store reads as one piece; other positions
    unchanged.
    """
    first = int(positions[0])
    last = int(positions[-1])
    return (
        slice(first, last + 1)
        if np.array_equal(positions, np.arange(first, last + 1))
        else positions
    )

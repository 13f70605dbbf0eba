"""Spectral radiance of stored scenes: EXR with one part for each light group.

Channels are named as in Fichet, Pacanowski and Wilkie 2021 (J. Comput. Graph. Tech. 10(3), section
3), for example `S0.550,000nm`. Each header states the wavelengths and the unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenEXR

import isethdr_core
from isethdr_core.cli.progress import track
from isethdr_core.errors import CatalogError
from isethdr_core.storage import store

from ..job import Job
from ..output_folder import errors_of_openexr

if TYPE_CHECKING:
    import xarray as xr


def check(job: Job) -> None:
    """Check that the radiance of all runs is stored.

    Raises
    ------
    CatalogError : the scene of a run makes its own radiance, or its store is gone.
    """
    for item in job.items:
        if not item.attributes.get("scene_ids"):
            raise CatalogError(
                f"run {item.key} has no stored radiance: its scene states its own; leave radiance"
                " out of --to, or choose runs with a renderer"
            )
    missing = [path for path in _scenes(job) if not path.is_dir()]
    if missing:
        raise CatalogError(
            f"the radiance {missing[0].stem} was removed; run the scene again, or leave radiance"
            " out of --to"
        )


def write(job: Job) -> None:
    """Write one EXR for each scene, with all stored light groups and the bands that all have."""
    written = set()
    for path in track(list(_scenes(job)), job.format):
        scene = store.open_scene(path)
        name = str(scene.attrs.get("recipe") or path.stem)
        if name not in written:
            write_radiance(scene, job.new_file(f"radiance/{name}.exr", "image/x-exr"))
        written.add(name)


def write_radiance(scene: xr.Dataset, path: Path) -> None:
    """Write scene radiance, W m-2 sr-1 nm-1, float32, from the top left, with one part per group.

    Parameters
    ----------
    scene : scene radiance Dataset; all groups are in memory while the file is written.
    path : file to write.
    """
    bands = [float(nm) for nm in scene["wavelength"].values]
    names = [f"S0.{nm:.3f}nm".replace(".", ",").replace("S0,", "S0.") for nm in bands]
    parts = []
    for group in map(str, scene["light_group"].values):
        light = scene["radiance"].sel(light_group=group).values.astype(np.float32, copy=False)
        channels = {name: np.ascontiguousarray(band) for name, band in zip(names, light)}
        parts.append(OpenEXR.Part(_header(scene, group, bands), channels, group))
    with errors_of_openexr(), OpenEXR.File(parts) as file:
        file.write(str(path))


def _header(scene: xr.Dataset, group: str, bands: list[float]) -> dict[str, Any]:
    return {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "spectralLayoutVersion": "1.0",
        "emissiveUnits": "W.m^-2.sr^-1.nm^-1",
        "wavelengthsNm": " ".join(f"{nm:g}" for nm in bands),
        "lightGroup": group,
        "fieldWidth": float(scene.attrs["field_width"]),
        "fieldHeight": float(scene.attrs["field_height"]),
        "projection": str(scene.attrs.get("projection", "tangent")),
        "comments": (
            f"spectral radiance of the light group {group} at weight 1, W m-2 sr-1 nm-1; tiles"
            " beyond the field are overscan; isethdr " + isethdr_core.__version__
        ),
    }


def _scenes(job: Job) -> Iterator[Path]:
    of_runs = (
        item.shot.path.parents[1] / "scenes" / f"{name}.zarr"  # in the home of the run
        for item in job.items
        for name in item.attributes["scene_ids"]
    )
    yield from dict.fromkeys([*job.scenes, *of_runs])

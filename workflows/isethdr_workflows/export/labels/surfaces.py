"""Surface distance and orientation of each pixel as EXR, float32.

`depth` writes the channels `depth` (m, along the optical axis) and `distance` (m, along the ray);
they are infinite in the sky. `normals` writes `normal.x`, `normal.y` and `normal.z`, unit vectors
in world axes (x forward, y left, z up), which are 0 in the sky. The files of a run have the pixels
of a camera. The files of a stored scene have its tiles, including overscan.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import OpenEXR

from isethdr_core.cli.progress import track
from isethdr_core.errors import CatalogError
from isethdr_core.storage import store

from ..job import Item, Job
from ..output_folder import errors_of_openexr

if TYPE_CHECKING:
    import xarray as xr

TYPE = "image/x-exr"
LABELS = {"depth": ("depth", "distance"), "normals": ("normal",)}  # {format: its labels}
COMMENTS = {
    "depth": "depth along the optical axis and distance along the ray, m; infinite in the sky",
    "normals": "unit normals in world axes: x forward, y left, z up; 0 in the sky",
}


def check(job: Job) -> None:
    """Check that each picture or scene has the labels of the format.

    Raises
    ------
    CatalogError : a label was not stored, or the scene has none.
    """
    for item in job.items:
        if missing := _missing(item.truth(), job.format):
            raise CatalogError(
                f"run {item.key} has no {missing} for camera {item.camera}, which {job.format}"
                f" needs; {_remedy(item)}"
            )
    for path in job.scenes:
        if missing := _missing(store.open_scene(path), job.format):
            raise CatalogError(
                f"the scene {path.stem} has no {missing}, which {job.format} needs; expected a"
                " rendered scene with all labels; type for example isethdr dataset generate night"
                " count=1"
            )


def _remedy(item: Item) -> str:
    """Return why a run lacks a label, and what to type."""
    if not item.attributes.get("scene_ids"):
        return (
            "its scene states its own radiance, without geometry; expected a rendered scene; type"
            " for example isethdr run scene=street leave_out=false"
        )
    return (
        "a run stores the labels that its metrics read, or all of a rendered scene; type for"
        " example isethdr run leave_out=false"
    )


def _missing(dataset: xr.Dataset, format_name: str) -> str:
    """Return the first label of a format that a Dataset lacks, "" if none is missing."""
    return next((name for name in LABELS[format_name] if name not in dataset), "")


def write(job: Job) -> None:
    """Write one file for each picture, and one for each scene."""
    for item in job.each():
        path = job.new_file(f"{job.format}/{item.name}.exr", TYPE, item)
        write_labels(item.truth(), path, job.format)
    for path, scene in _scenes(job):
        name = str(scene.attrs.get("recipe") or path.stem)
        field = {
            "fieldWidth": float(scene.attrs["field_width"]),
            "fieldHeight": float(scene.attrs["field_height"]),
            "projection": str(scene.attrs.get("projection", "tangent")),
        }
        new = job.new_file(f"{job.format}/{name}.exr", TYPE)
        write_labels(scene, new, job.format, field)


def _scenes(job: Job) -> Iterator[tuple[Path, xr.Dataset]]:
    """Yield the stored scenes. Stores of one recipe have the same labels, so only one is used."""
    written = set()
    for path in track(list(job.scenes), job.format):
        scene = store.open_scene(path)
        name = scene.attrs.get("recipe") or path.stem
        if name not in written:
            yield path, scene
        written.add(name)


def write_labels(
    labels: xr.Dataset, path: Path, format_name: str, header: dict[str, Any] | None = None
) -> None:
    """Write the labels of a format as channels of an EXR file.

    Parameters
    ----------
    labels : Dataset with `depth` and `distance` (y, x), m, or `normal` (y, x, 3).
    path : file to write.
    format_name : `depth` or `normals`.
    header : further entries of the header.
    """
    channels = {}
    for name in LABELS[format_name]:
        value = labels[name].values.astype(np.float32, copy=False)
        if value.ndim == 2:
            channels[name] = np.ascontiguousarray(value)
            continue
        for k, axis in enumerate("xyz"):
            channels[f"{name}.{axis}"] = np.ascontiguousarray(value[..., k])
    entries = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "comments": COMMENTS[format_name],
    }
    if format_name == "depth":
        entries["units"] = "m"
    with errors_of_openexr():
        OpenEXR.File(entries | (header or {}), channels).write(str(path))

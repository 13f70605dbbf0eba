"""The visible pixels of each object of a picture, and the categories of COCO files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from isethdr_catalog.dataset import NONE, is_thing
from scipy.ndimage import find_objects

from isethdr_core.data.categories import CATEGORIES
from isethdr_core.errors import CatalogError

from ..job import Item, Job

if TYPE_CHECKING:
    import xarray as xr

VEHICLES = ("bicycle", "car", "motorcycle", "bus", "truck")
ANIMALS = ("cat", "dog", "horse", "sheep", "cow", "deer", "boar", "fox")


@dataclass(frozen=True, eq=False)
class Visible:
    """The visible part of one object.

    Parameters
    ----------
    row : row of the table of objects: instance, category, name, distance_m, visible_fraction, ...
    left, top : the first column and row of its pixels.
    window : (height, width) bool, its pixels within the smallest box that holds them.
    """

    row: dict[str, Any]
    left: int
    top: int
    window: np.ndarray

    @property
    def area(self) -> int:
        """The number of pixels."""
        return int(self.window.sum())

    @property
    def box(self) -> list[float]:
        """The smallest box, [left, top, width, height] in pixels from the top left corner."""
        height, width = self.window.shape
        return [float(v) for v in (self.left, self.top, width, height)]


def check(job: Job) -> None:
    """Check that each picture has a map of objects and their table.

    Raises
    ------
    CatalogError : the labels of a run were not stored, or its scene has none.
    """
    for item in job.items:
        if missing := _missing(item):
            raise CatalogError(
                f"run {item.key} has no {missing} for camera {item.camera}, which {job.format}"
                " needs; a rendered scene stores it where a metric reads it; type for example"
                " isethdr run metric@metric.contrast=object_contrast"
            )


@lru_cache(maxsize=1024)  # several formats use it
def _missing(item: Item) -> str:
    """Return the name of a label that a picture lacks, "" if none is missing."""
    truth = item.truth()
    if "instance" not in truth:
        return "map of objects"
    rows = truth.attrs.get("objects")
    # a picture may show nothing: the table is then empty, and so is the map
    shows_nothing = rows is not None and not truth["instance"].values.any()
    return "" if rows or shows_nothing else "table of objects"


def visible_objects(truth: xr.Dataset) -> Iterator[Visible]:
    """Yield the objects that have at least one pixel, in the order of their numbers.

    Parameters
    ----------
    truth : reference picture with the label `instance` and the attribute `objects`.

    Raises
    ------
    CatalogError : a pixel belongs to an object that the table does not list.
    """
    instance = truth["instance"].values.astype(np.int64)
    rows = {int(row["instance"]): row for row in truth.attrs["objects"]}
    for number, found in enumerate(find_objects(instance), 1):
        if found is None:
            continue
        if number not in rows:
            raise CatalogError(
                f"the map of objects holds the number {number}, which the table does not list;"
                " run the scene again"
            )
        down, across = found
        window = instance[down, across] == number
        yield Visible(rows[number], across.start, down.start, window)


def lit_by(item: Item, row: dict[str, Any]) -> dict[str, dict[str, float]]:
    """Return `illuminance_lx` of an object by light group, under the lighting of its run; empty if
    the scene does not state it.

    Parameters
    ----------
    item : the picture.
    row : row of the table of objects.
    """
    if "illuminance_lx" not in row:
        return {}
    weights = item.attributes["weights"]
    lit = {group: lx * weights.get(group, 0.0) for group, lx in row["illuminance_lx"].items()}
    return {"illuminance_lx": lit}


def category_rows(things_only: bool) -> list[dict[str, Any]]:
    """Return the categories in COCO's form.

    Parameters
    ----------
    things_only : whether only things are listed; otherwise each row has `isthing`, as in panoptic
        files.
    """
    rows = []
    for name, number in CATEGORIES.items():
        if name == NONE or things_only and not is_thing(name):
            continue
        row = {"id": number, "name": name, "supercategory": _above(name)}
        rows.append(row if things_only else row | {"isthing": int(is_thing(name))})
    return rows


def _above(name: str) -> str:
    if name in VEHICLES:
        return "vehicle"
    if name in ANIMALS:
        return "animal"
    return name if name == "person" else "outdoor" if is_thing(name) else "background"


def image_row(item: Item, licence: int) -> dict[str, Any]:
    """Return COCO's entry of a picture, with the run, the camera, the sequence and the time.

    Parameters
    ----------
    item : the picture.
    licence : number of the licence in the file.
    """
    height, width = item.size
    return {
        "id": item.number,
        "file_name": item.png,
        "width": width,
        "height": height,
        "license": licence,
        "date_captured": str(item.attributes.get("created", "")),
        "run": item.key,
        "camera": item.camera,
        **item.frame,
    }


LICENCE = 1  # number of the only licence of a file


def head(job: Job, about: str) -> dict[str, Any]:
    """Return the beginning of a COCO file: info and licence.

    Parameters
    ----------
    job : the export.
    about : description of the file.
    """
    return {
        "info": {
            "description": f"{job.title}: {about}",
            "version": "1.0",
            "year": int(job.created[:4]),
            "contributor": "",
            "url": "",
            "date_created": job.created,
        },
        "licenses": [
            {
                "id": LICENCE,
                "name": job.licence or "not stated",
                "url": job.licence if "://" in job.licence else "",
            }
        ],
    }

"""Boxes and masks of objects in COCO's layout, one file for all pictures.

`bbox` is the box of the visible part, which is that of the mask. `bbox_full` is the box of the
whole object, as if nothing hid it, cut at the frame. It is left out if the geometry of the scene
cannot be built again.
"""

from __future__ import annotations

from typing import Any

from isethdr_catalog.dataset import is_thing

from ..job import Item, Job
from . import geometry, masks
from .masks import LICENCE, Visible, visible_objects
from .run_length import lengths, text

COPIED = ("instance", "name", "distance_m", "visible_fraction", "in_frame", "truncation")


def check(job: Job) -> None:
    """Check that each picture has labels; raises as `masks.check`."""
    masks.check(job)


def write(job: Job) -> None:
    """Write `coco.json`."""
    images = []
    annotations = []
    for item in job.each():
        images.append(masks.image_row(item, LICENCE))
        truth = item.truth()
        full = geometry.full_boxes(item)
        for seen in visible_objects(truth):
            if is_thing(seen.row["category"]):
                row = annotation(item, seen, full, len(annotations) + 1)
                annotations.append(row)
    content = masks.head(job, "visible objects with boxes and masks")
    content |= {"images": images, "annotations": annotations}
    job.write_json("coco.json", content | {"categories": masks.category_rows(things_only=True)})


def annotation(
    item: Item, seen: Visible, full: dict[int, list[float]], number: int
) -> dict[str, Any]:
    """Return the annotation of one object.

    Parameters
    ----------
    item : the picture.
    seen : visible part of the object, and its row in the table.
    full : {number of the object: box [left, top, width, height] of the whole object, px}.
    number : number of the annotation in the file, from 1.
    """
    shape = item.size
    row: dict[str, Any] = {
        "id": number,
        "image_id": item.number,
        "category_id": masks.CATEGORIES[seen.row["category"]],
        "bbox": seen.box,
        "area": seen.area,
        "iscrowd": 0,
        "segmentation": {
            "size": list(shape),
            "counts": text(lengths(seen.window, seen.left, seen.top, shape)),
        },
    }
    row |= {name: seen.row[name] for name in COPIED if name in seen.row}
    row |= masks.lit_by(item, seen.row)
    if seen.row["instance"] in full:
        row["bbox_full"] = full[seen.row["instance"]]
    return row

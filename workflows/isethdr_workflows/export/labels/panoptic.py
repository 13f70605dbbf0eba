"""The segment of every pixel in COCO's panoptic layout: a JSON file, and one PNG for each picture.

Each thing is a segment with its instance number. All pixels of a stuff category are one segment.
Pixels without an object, such as the sky, have the number 0.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from isethdr_catalog.dataset import is_thing
from PIL import Image

from ..job import Item, Job
from . import masks
from .masks import LICENCE, Visible, visible_objects

FOLDER = "panoptic"


def check(job: Job) -> None:
    """Check that each picture has labels; raises as `masks.check`."""
    masks.check(job)


def write(job: Job) -> None:
    """Write `panoptic.json` and the pictures of segments."""
    images = []
    annotations = []
    for item in job.each():
        images.append(masks.image_row(item, LICENCE))
        name = f"{item.name}.png"
        path = job.new_file(f"{FOLDER}/{name}", "image/png", item)
        segments = write_segments(item, path)
        annotations.append({"image_id": item.number, "file_name": name, "segments_info": segments})
    content = masks.head(job, "segments of all pixels")
    content |= {"images": images, "annotations": annotations}
    job.write_json("panoptic.json", content | {"categories": masks.category_rows(False)})


def write_segments(item: Item, path: Path) -> list[dict[str, Any]]:
    """Write the segments of a picture as RGB, number = R + 256 G + 65536 B; return their list.

    Parameters
    ----------
    item : the picture.
    path : file to write (PNG).
    """
    segments: dict[str, dict[str, Any]] = {}
    numbers = np.zeros(item.size, np.uint32)
    for seen in visible_objects(item.truth()):
        category = seen.row["category"]
        key = str(seen.row["instance"]) if is_thing(category) else category
        if key in segments:
            _grow(segments[key], seen)
        else:
            segments[key] = {
                "id": int(seen.row["instance"]),
                "category_id": masks.CATEGORIES[category],
                "area": seen.area,
                "bbox": seen.box,
                "iscrowd": 0,
            }
        height, width = seen.window.shape
        here = numbers[seen.top : seen.top + height, seen.left : seen.left + width]
        here[seen.window] = segments[key]["id"]
    rgb = np.stack([numbers & 255, numbers >> 8 & 255, numbers >> 16 & 255], -1)
    Image.fromarray(rgb.astype(np.uint8)).save(path)
    return list(segments.values())


def _grow(segment: dict[str, Any], seen: Visible) -> None:
    """Add the pixels of one more object to a segment."""
    segment["area"] += seen.area
    boxes = np.array([segment["bbox"], seen.box])
    low = boxes[:, :2].min(0)
    high = (boxes[:, :2] + boxes[:, 2:]).max(0)
    segment["bbox"] = [*low.tolist(), *(high - low).tolist()]

"""The formats of `isethdr export`. There are no slow imports, because `--help` lists formats."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Format:
    """A format: its module in this package, with the functions `check(job)` and `write(job)`."""

    module: str
    writes: str  # what it writes, as text for the help
    of_scenes: bool = False  # whether stored scenes can be exported, too


FORMATS = {
    "png": Format("pictures.png", "pictures as displayed"),
    "animation": Format("pictures.animation", "a sequence as a moving picture"),
    "exr": Format("pictures.exr", "pictures and references, linear, cd/m2"),
    "radiance": Format("pictures.radiance", "spectral radiance by light group", of_scenes=True),
    "dng": Format("pictures.raw", "raw captures"),
    "coco": Format("labels.coco", "boxes and masks of objects"),
    "panoptic": Format("labels.panoptic", "the segment of every pixel"),
    "boxes3d": Format("labels.boxes_3d", "boxes of objects in metres"),
    "flow": Format("labels.flow", "motion of each pixel until the next frame"),
    "depth": Format("labels.surfaces", "depth and distance of each pixel, m", of_scenes=True),
    "normals": Format("labels.surfaces", "normals of surfaces at each pixel", of_scenes=True),
    # cards come last: they describe the files of the other formats
    "stac": Format("cards.stac", "a STAC collection of the pictures"),
    "croissant": Format("cards.croissant", "Croissant metadata of the folder"),
}


def listed() -> str:
    """Return the formats and what they write, for the help of the command."""
    return "; ".join(f"{name}: {known.writes}" for name, known in FORMATS.items())

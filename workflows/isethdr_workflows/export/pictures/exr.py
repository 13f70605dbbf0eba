"""Linear pictures and their references: EXR, float32, R, G, B of sRGB primaries in cd/m2.

A D65 grey of 1 cd/m2 is (1, 1, 1). Negative values are kept, of colours beyond the primaries and of
estimates below zero, so that XYZ follows by one matrix.
"""

from __future__ import annotations

from isethdr_core.display.display_view import write_exr

from ..job import Job

TYPE = "image/x-exr"


def check(job: Job) -> None:
    """Every stored run has its pictures."""


def write(job: Job) -> None:
    """Write the picture and the reference of each item."""
    for item in job.each():
        write_exr(item.picture(), job.new_file(f"exr/{item.name}.exr", TYPE, item), "srgb")
        reference = job.new_file(f"exr/{item.name}_reference.exr", TYPE, item)
        write_exr(item.truth(), reference, "srgb")

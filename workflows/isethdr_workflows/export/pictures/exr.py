"""Linear pictures and their references: EXR, float32, R, G, B of sRGB primaries in cd/m2.

A D65 grey of 1 cd/m2 is (1, 1, 1). Negative values of colours outside the primaries and of
estimates below zero are kept, so that a single matrix converts all values back to XYZ.
"""

from __future__ import annotations

from isethdr_core.display.display_view import write_exr

from ..job import Job
from ..output_folder import errors_of_openexr

TYPE = "image/x-exr"


def check(job: Job) -> None:
    """Accept all pictures, because every stored run has them."""


def write(job: Job) -> None:
    """Write the picture and the reference of each item."""
    for item in job.each():
        picture = job.new_file(f"exr/{item.name}.exr", TYPE, item)
        reference = job.new_file(f"exr/{item.name}_reference.exr", TYPE, item)
        with errors_of_openexr():
            write_exr(item.picture(), picture, "srgb")
            write_exr(item.truth(), reference, "srgb")

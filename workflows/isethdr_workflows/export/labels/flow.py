"""Motion of each pixel until the next frame: Middlebury's .flo (Baker et al. 2011, section 3.2).

A file is the float32 202021.25, width and height as int32, and u and v of each pixel as float32,
row by row, little-endian, in pixels to the right and down. Unknown motion is 1e10.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.errors import CatalogError
from isethdr_core.quantities import MOTION

from ..job import Job

TAG = np.float32(202021.25)
UNKNOWN = np.float32(1e10)  # readers treat values above 1e9 as unknown


def check(job: Job) -> None:
    """Raise CatalogError unless each picture has the label `motion`."""
    for item in job.items:
        if MOTION not in item.truth():
            raise CatalogError(
                f"run {item.key} has no motion; expected pictures of a sequence; type for example"
                " isethdr run scene=street scene.frames_per_s=30"
            )


def write(job: Job) -> None:
    """Write one file for each picture."""
    for item in job.each():
        motion = item.truth()[MOTION].values.astype("<f4")
        path = job.new_file(f"flow/{item.name}.flo", "application/octet-stream", item)
        known = np.isfinite(motion).all(-1, keepdims=True)
        with path.open("wb") as file:
            file.write(TAG.astype("<f4").tobytes())
            file.write(np.array(motion.shape[1::-1], "<i4").tobytes())
            file.write(np.where(known, motion, UNKNOWN).astype("<f4").tobytes())

"""A sequence as a moving picture: one animated PNG for each camera, as displayed by the report.

The frames of a camera are its runs in the order of `scene.time_s`. All frames have the white and
the tone curve of the first one, so that changes of the light are visible.
"""

from __future__ import annotations

from itertools import pairwise

from PIL import Image

from isethdr_core.display import display_view
from isethdr_core.errors import CatalogError

from ..job import Item, Job
from .png import shared_view

LAST_MS = 500.0  # least time for which the last frame is shown before the sequence starts again


def check(job: Job) -> None:
    """Raise CatalogError unless each camera has one picture at each of at least two times."""
    for camera, items in _by_camera(job).items():
        times = [item.time_s for item in items]
        if len(set(times)) < max(2, len(times)):
            raise CatalogError(
                f"camera {camera} has {len(items)} pictures at {len(set(times))} times; expected"
                " one sequence, two times or more; type for example"
                " isethdr run -m scene=street scene.time_s=0,0.1,0.2"
            )


def write(job: Job) -> None:
    """Write one animated PNG for each camera."""
    for camera, items in _by_camera(job).items():
        view = shared_view(items[0].shot.path)
        frames = [
            Image.fromarray(display_view.display(item.picture(), *view, natural_colour=True))
            for item in items
        ]
        times = [item.time_s for item in items]
        shown_ms = [1000 * (after - before) for before, after in pairwise(times)]
        path = job.new_file(f"animation/{camera}.png", "image/apng")
        frames[0].save(
            path,
            save_all=True,
            append_images=frames[1:],
            duration=[*shown_ms, max(LAST_MS, shown_ms[-1])],
            loop=0,
        )


def _by_camera(job: Job) -> dict[str, list[Item]]:
    """Return the pictures of each camera in the order of their times; those of a job are in that
    order only within each sequence.
    """
    found: dict[str, list[Item]] = {}
    for item in sorted(job.items, key=lambda item: item.time_s):
        found.setdefault(item.camera, []).append(item)
    return found

"""Pictures as displayed by the report, 8 bit sRGB, with one white and one tone curve for all
pictures of a run.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from isethdr_catalog.report.pictures import compression, shown_white_cd_m2
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import isethdr_core
from isethdr_core.display import display_view
from isethdr_core.results.stored import open_run

from ..job import Item, Job

SRGB = b"sRGB", b"\x00"  # PNG chunk that declares sRGB values, with rendering intent perceptual


def check(job: Job) -> None:
    """Accept all pictures, because every stored run has them."""


def write(job: Job) -> None:
    """Write one PNG for each picture. Its header states the white, the run and the camera."""
    for item in job.each():
        _write_one(item, job.new_file(item.png, "image/png", item), job.licence)


def _write_one(item: Item, path: Path, licence: str) -> None:
    white, compressed = shared_view(item.shot.path)
    shown = display_view.display(item.picture(), white, compressed, natural_colour=True)
    header = PngInfo()
    header.add(*SRGB)
    header.add_text("Description", f"sRGB, white {white:.4g} cd/m2, tone a = {compressed:.4g}")
    header.add_text("Source", f"isethdr run {item.key}, camera {item.camera}")
    header.add_text("Software", f"isethdr {isethdr_core.__version__}")
    if licence:
        header.add_itxt("Copyright", licence)
    Image.fromarray(shown).save(path, pnginfo=header)


@lru_cache(maxsize=1)
def shared_view(path: Path) -> tuple[float, float]:
    """Return the white, cd/m2, and the compression with which the report shows the pictures of a
    run. They come from the reference with the most pixels, with room for flare in the pictures.
    """
    run = open_run(path)
    truths = [run.open(f"truth/{camera}") for camera in run.cameras]
    reference = max(truths, key=lambda truth: truth.sizes["y"] * truth.sizes["x"])
    white = shown_white_cd_m2(reference, [run.open(f"picture/{camera}") for camera in run.cameras])
    return white, compression(reference, white)

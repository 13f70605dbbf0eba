"""Bank of noise-free pictures, which are made once, kept in the home folder, and read from there
without a copy in memory.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from isethdr_core.cli.progress import track
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.chain.side_by_side import sharing, side_by_side
from isethdr_core.storage.home_folder import home
from isethdr_core.store import content_hash

from ..files import write_file

AT_A_TIME = 8  # number of pictures in memory


def bank(
    title: str, recipe: Any, count: int, make: Callable[[int], np.ndarray], threads: int = 1
) -> np.ndarray:
    """Return pictures (picture, plane, y, x) float32. They are made if their file is missing.

    Parameters
    ----------
    title : beginning of the file's name.
    recipe : everything that determines the pictures; its hash is part of the file's name.
    count : number of pictures.
    make : function of a number that returns its picture (plane, y, x); all have one size.
    threads : number of threads that make pictures at the same time, if `make` allows it.

    Raises
    ------
    CatalogError : the file cannot be written, for example because the disk is full.
    ConfigError : the pictures differ in size.
    """
    path = folder() / f"{title}-{content_hash(recipe)[:16]}.npy"
    if not is_complete(path):
        write_file(path, _content(title, count, make, threads))
    return np.load(path, mmap_mode="r")


def _content(
    title: str, count: int, make: Callable[[int], np.ndarray], threads: int
) -> Iterator[bytes]:
    """Yield the parts of a file of pictures, a few at a time, because all may not fit in memory."""
    shape: tuple[int, ...] = ()
    for first in track(range(0, count, AT_A_TIME), f"making {title}"):
        numbers = range(first, min(first + AT_A_TIME, count))
        with sharing(threads):
            pictures = side_by_side([partial(make, number) for number in numbers])
        if first == 0:
            shape = pictures[0].shape
            yield _header((count, *shape))
        for number, picture in zip(numbers, pictures, strict=True):
            if picture.shape != shape:
                sizes = [f"{columns} x {rows}" for _, rows, columns in (shape, picture.shape)]
                raise ConfigError(
                    f"picture {number + 1} of the {title} has {sizes[1]} pixels and the first one"
                    f" {sizes[0]}; expected one size; render all scenes of the dataset with one"
                    " size"
                )
            yield np.ascontiguousarray(picture, np.float32).tobytes()


def _header(shape: tuple[int, ...]) -> bytes:
    """Return the header of a NumPy file of float32 values."""
    header = io.BytesIO()
    described = {"descr": "<f4", "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(header, described)
    return header.getvalue()


def is_complete(path: Path) -> bool:
    """Return whether a file of a bank exists and can be read."""
    try:
        np.load(path, mmap_mode="r")
    except (OSError, ValueError):
        return False
    return True


def folder() -> Path:
    """Return the folder of all banks."""
    return home() / "training" / "banks"


def crop(pictures: Sequence[np.ndarray], side: int, rng: np.random.Generator) -> np.ndarray:
    """Return a random square (plane, y, x) of a random picture, mirrored at random.

    Parameters
    ----------
    pictures : pictures (plane, y, x), each at least `side` high and wide.
    side : side of the square, pixels.
    rng : random generator of picture, position and mirroring.
    """
    planes = pictures[int(rng.integers(len(pictures)))]
    y, x = (int(rng.integers(n - side + 1)) for n in planes.shape[1:])
    return planes[:, y : y + side, x : x + side][:, :: rng.choice((-1, 1)), :: rng.choice((-1, 1))]

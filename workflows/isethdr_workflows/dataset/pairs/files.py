"""Files of pairs: NumPy or EXR. The folder of a scene appears once all of its files are written."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import OpenEXR

from isethdr_core.errors import CatalogError
from isethdr_core.storage.atomic_write import remove_leftovers, temporary_path

from ...export.job import sha256
from .arrays import Sample

LARGEST_EXACT = 2**24  # whole numbers up to here are exact in float32


def write_scene(folder: Path, name: str, samples: Sequence[Sample], form: str) -> int:
    """Write the folder of a scene, and return its size in bytes.

    Parameters
    ----------
    folder : folder of the pairs.
    name : name of the scene's folder.
    samples : arrays and labels of each camera.
    form : `numpy` or `exr`.

    Raises
    ------
    CatalogError : the folder cannot be written, for example because the disk is full; then there
        is no folder of the scene.
    """
    write, ending = WRITERS[form]
    temporary = temporary_path(folder, name)
    try:
        remove_leftovers(folder)
        temporary.mkdir(parents=True)
        for one in samples:
            path = temporary / f"{one.camera}{ending}"
            write(path, one)
            labels = one.labels | {"file": path.name, "sha256": sha256(path)}
            text = json.dumps(labels, ensure_ascii=False, allow_nan=False, indent=1)
            (temporary / f"{one.camera}.json").write_text(text, encoding="utf-8")
        temporary.rename(folder / name)
    except OSError as err:
        if not (folder / name).is_dir():  # else another process has written the same pairs
            raise cannot_write(folder / name, err) from err
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return sum(path.stat().st_size for path in (folder / name).iterdir())


def cannot_write(path: Path, err: OSError) -> CatalogError:
    """Return the error of a file that cannot be written."""
    return CatalogError(
        f"cannot write {path}: {err.strerror or err}; pairs that are written are complete; make"
        " room and type the same command again"
    )


def write_npz(path: Path, one: Sample) -> None:
    """Write the arrays as one compressed file for `numpy.load`."""
    np.savez_compressed(path, **one.arrays)  # type: ignore[arg-type]


def write_exr(path: Path, one: Sample) -> None:
    """Write the arrays as float32 into one OpenEXR file. Each array is a part of the file, and each
    of its planes is a channel.

    DN and numbers of objects are exact up to 2^24.
    """
    captures = one.labels["captures"]
    parts = []
    for name, values in one.arrays.items():
        if name == "xyz":
            planes = {letter: values[..., k] for k, letter in enumerate("XYZ")}
        elif values.ndim == 2:
            planes = {"Y": values}
        elif name == "channel_radiance":
            planes = dict(zip(one.labels["channels"], values, strict=True))
        elif values.ndim == 4:
            planes = {
                f"{capture}_{shot}": values[shot, k]
                for shot in range(len(values))
                for k, capture in enumerate(captures)
            }
        else:
            planes = dict(zip(captures, values, strict=True))
        channels = {key: np.ascontiguousarray(plane, np.float32) for key, plane in planes.items()}
        header = {
            "compression": OpenEXR.ZIP_COMPRESSION,
            "type": OpenEXR.scanlineimage,
            "comments": "; ".join(f"{k}: {v}" for k, v in one.labels["arrays"][name].items()),
        }
        parts.append(OpenEXR.Part(header, channels, name))
    with OpenEXR.File(parts) as file:
        try:
            file.write(str(path))
        except RuntimeError as err:  # the library raises it if the file cannot be written
            raise OSError(None, str(err).splitlines()[0]) from err


Writer = Callable[[Path, Sample], None]
WRITERS: dict[str, tuple[Writer, str]] = {
    "numpy": (write_npz, ".npz"),
    "exr": (write_exr, ".exr"),
}

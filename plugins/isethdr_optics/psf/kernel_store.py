"""Kernel store: kernels and their transforms on disk, shared by processes.

The name of a file is a hash of everything the kernels depend on. The file holds, in NumPy's format:
one array per band, facts (float64), checksums (uint32) of both and of their headers. It is written
under a temporary name and renamed, so that any number of processes may share a folder. Each process
maps the arrays into memory; all processes share one copy. If the folder cannot be written to,
nothing is stored.
"""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from isethdr_core import store
from isethdr_core.runs import provenance

if TYPE_CHECKING:
    from .kernel_request import KernelRequest

# largest size of all files together; beyond it, the files that were unused for longest are removed
LIMIT_BYTES = 8 << 30
PART = "-band-"  # part of the name of a file with one band, which is kept until all are computed
REACH = "-reach-"  # part of a name; the tiles from the axis to the border, (y, x), follow
WORTH_KEEPING_S = 1.0  # kernels that were computed in less time are not written to disk
# the same for kernels from one pattern, of which there are many when lenses are compared
PATTERN_WORTH_KEEPING_S = 5.0
# age of a temporary file from which on its writer is assumed to have been interrupted
ABANDONED_S = 3600.0


def name(request: KernelRequest, way: str | None = None) -> str | None:
    """Return the file name of kernels; None if it cannot identify their content.

    The name is a hash of the lens, its flares, the sampling, and the code that computes kernels.

    Parameters
    ----------
    request : the kernels that are asked for.
    way : method of computing the kernels, if there are several.
    """
    lens = request.lens
    flares = request.flares
    if not provenance.have_source(lens, *flares):
        return None
    try:
        made_of = store.content_hash(
            {
                "optics": [_named(c) for c in (lens, *flares)],
                "sampling": [request.edges_nm, np.round(request.pitch_um, 9), way],
                "code": provenance.fingerprint(lens, *flares),
                "files": provenance.input_digests(lens, *flares),
                "versions": provenance.libraries(lens, *flares),
            }
        )
    except (TypeError, ValueError, OSError):  # a field is not JSON, or a file is not readable
        return None
    return f"{made_of}{REACH}{'x'.join(map(str, request.reach))}"


def _named(
    component: Any,
) -> list[dict[Any, Any] | dict[str, float | str] | dict[str, float] | str]:
    return [provenance.identity(component), store.jsonable(component)]


def _folder() -> Path:
    return store.home() / "kernels"


def load(key: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (facts, arrays): facts (fact, band), float64, and memory-mapped arrays (band, ...).
    Return None if the file is missing or damaged.
    """
    path = _folder() / f"{key}.npy"
    try:
        with open(path, "rb") as file:
            np.lib.format.read_magic(file)
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
            bands = np.memmap(path, dtype, "r", file.tell(), shape)
            end_of_bands = file.tell() + bands.nbytes
            file.seek(end_of_bands)
            facts = np.load(file)
            headers = (0, end_of_bands - bands.nbytes), (end_of_bands, file.tell() - facts.nbytes)
            checks = np.load(file)
            parts = facts, *bands, *(_bytes(file, *header) for header in headers)
        if [_check(part) for part in parts] != checks.tolist():
            return None
        os.utime(path)
    except Exception:  # noqa: BLE001 - a damaged header may raise anything in NumPy
        return None
    return facts, bands


def reaches(key: str) -> list[tuple[int, ...]]:
    """Return the reaches (y, x), in tiles, of stored kernels with names that differ from `key` only
    in the reach. `load` tests the checksums; this function does not.
    """
    made_of = key.partition(REACH)[0]
    files = _folder().glob(f"{made_of}{REACH}*.npy")
    ends = [path.stem.partition(REACH)[2] for path in files if PART not in path.name]
    # transforms are stored in the same folder, under a longer name
    return [tuple(map(int, end.split("x"))) for end in ends if "-" not in end]


def save(
    key: str,
    shape: Sequence[int],
    dtype: str | np.dtype,
    bands: Sequence[np.ndarray],
    facts: Callable[..., Any],
) -> None:
    """Store arrays for `load`; do nothing if the folder cannot be written to.

    Parameters
    ----------
    key : name of the kernels, from `name`.
    shape, dtype : shape (band, ...) and type of all bands together.
    bands : iterable of one array per band; it is consumed one array at a time.
    facts : function that returns (fact, band) float64; it is called after the last band.
    """
    folder = _folder()
    dtype = np.dtype(dtype)
    temporary = folder / f".{key}.{os.getpid()}-{uuid.uuid4().hex[:6]}.tmp"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with open(temporary, "wb+") as file:
            np.lib.format.write_array_header_1_0(
                file, {"descr": dtype.str, "fortran_order": False, "shape": tuple(shape)}
            )
            start = file.tell()
            checks = []
            for band in bands:
                band = np.ascontiguousarray(band, dtype)
                checks.append(_check(band))
                file.write(band)
            end_of_bands = file.tell()
            facts_array = np.ascontiguousarray(facts(), float)
            np.save(file, facts_array)
            headers = (0, start), (end_of_bands, file.tell() - facts_array.nbytes)
            checks += [_check(_bytes(file, *header)) for header in headers]
            file.seek(0, os.SEEK_END)
            np.save(file, np.array([_check(facts_array), *checks], np.uint32))
        os.replace(temporary, folder / f"{key}.npy")
        _remove_oldest(folder)
    except OSError:
        pass
    finally:
        try:
            temporary.unlink(missing_ok=True)
        except OSError:
            pass


def remove_parts(key: str) -> None:
    """Remove the files of single bands, after all bands have been saved in one file."""
    for path in _folder().glob(f"{key}{PART}*.npy"):
        with suppress(OSError):
            path.unlink(missing_ok=True)


def _check(a: np.ndarray) -> int:
    """Return a checksum of an array: the sum of its 32-bit words, modulo 2^32.

    A change of any single bit changes the sum. Computing it takes as long as reading the array.
    """
    return int(np.add.reduce(np.ascontiguousarray(a).reshape(-1).view(np.uint32), dtype=np.uint32))


def _bytes(file: BinaryIO, start: int, end: int) -> np.ndarray:
    """Return the bytes of an open file from `start` to `end`."""
    file.seek(start)
    return np.frombuffer(file.read(end - start), np.uint8)


def _remove_oldest(folder: Path) -> None:
    """Remove old files until the folder is below its limit, and stale temporary files. A removed
    file that another process has mapped stays readable there.
    """
    for path in folder.glob(".*.tmp"):
        if time.time() - path.stat().st_mtime > ABANDONED_S:
            path.unlink(missing_ok=True)
    total = 0
    files = sorted(
        ((p.stat(), p) for p in folder.glob("*.npy")), key=lambda f: f[0].st_mtime, reverse=True
    )
    for stat, path in files:
        total += stat.st_size
        if total > LIMIT_BYTES:
            path.unlink(missing_ok=True)

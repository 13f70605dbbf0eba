"""Kernel store: kernels and their transforms on disk, shared by processes.

The name of a file is a hash of everything the kernels depend on. The file holds, in NumPy's format:
one array per band, facts (float64), checksums (uint32). It is written under a temporary name and
renamed, so that any number of processes may share a folder. Each process maps the arrays into
memory, where they exist once for all. If the folder cannot be written to, nothing is stored.
"""

from __future__ import annotations

import os
import time
import uuid
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from isethdr_core import store
from isethdr_core.runs import provenance

if TYPE_CHECKING:
    from .kernel_request import KernelRequest

LIMIT_BYTES = 8 << 30  # of all files together; beyond it those unused for longest go
PART = "-band-"  # in the name of a file with one band, until all bands are computed
REACH = "-reach-"  # in a name, before the tiles to the border, (y, x)
WORTH_KEEPING_S = 1.0  # kernels made faster than this are not written to disk
# of kernels from one pattern, which are many while somebody tries lenses
PATTERN_WORTH_KEEPING_S = 5.0
ABANDONED_S = 3600.0  # age at which a temporary file's writer is taken for dead


def name(request: KernelRequest, way: str | None = None) -> str | None:
    """Return the file name of kernels; None if their content cannot be named.

    The lens, its flares and the code that computes kernels are part of the name. `way` : method of
    computing the kernels, if there are several.
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
    except (TypeError, ValueError, OSError):  # fields that are no values
        return None
    return f"{made_of}{REACH}{'x'.join(map(str, request.reach))}"


def _named(
    component: Any,
) -> list[dict[Any, Any] | dict[str, float | str] | dict[str, float] | str]:
    return [provenance.identity(component), store.jsonable(component)]


def _folder() -> Path:
    return store.home() / "kernels"


def load(key: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Return (facts, arrays): (fact, band) float64 and (band, ...), mapped; None where missing or
    damaged.
    """
    path = _folder() / f"{key}.npy"
    try:
        with open(path, "rb") as file:
            np.lib.format.read_magic(file)
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
            bands = np.memmap(path, dtype, "r", file.tell(), shape)
            file.seek(bands.nbytes, os.SEEK_CUR)
            facts = np.load(file)
            checks = np.load(file)
        if [_check(part) for part in (facts, *bands)] != checks.tolist():
            return None
        os.utime(path)
    except (OSError, ValueError, EOFError):
        return None
    return facts, bands


def reaches(key: str) -> list[tuple[int, ...]]:
    """Return the reaches (y, x), in tiles, of stored kernels whose names differ from `key` only in
    the reach. Their checksums are not tested here but by `load`.
    """
    made_of = key.partition(REACH)[0]
    files = _folder().glob(f"{made_of}{REACH}*.npy")
    ends = [path.stem.partition(REACH)[2] for path in files if PART not in path.name]
    # transforms are stored beside the kernels, under a longer name
    return [tuple(map(int, end.split("x"))) for end in ends if "-" not in end]


def save(
    key: str,
    shape: Sequence[int],
    dtype: str | np.dtype,
    bands: Sequence[np.ndarray],
    facts: Callable[..., Any],
) -> None:
    """Keep arrays for `load`; do nothing where that is not possible.

    Parameters
    ----------
    key : name of the kernels, as of `name`.
    shape, dtype : of all bands together.
    bands : iterable of one array per band, taken one at a time.
    facts : called at last; returns (fact, band) float64.
    """
    folder = _folder()
    dtype = np.dtype(dtype)
    temporary = folder / f".{key}.{os.getpid()}-{uuid.uuid4().hex[:6]}.tmp"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with open(temporary, "wb") as file:
            np.lib.format.write_array_header_1_0(
                file, {"descr": dtype.str, "fortran_order": False, "shape": tuple(shape)}
            )
            checks = []
            for band in bands:
                band = np.ascontiguousarray(band, dtype)
                checks.append(_check(band))
                file.write(band)
            facts_array = np.ascontiguousarray(facts(), float)
            np.save(file, facts_array)
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

    A change of any one bit changes it. It takes as long as reading the array.
    """
    return int(np.add.reduce(np.ascontiguousarray(a).reshape(-1).view(np.uint32), dtype=np.uint32))


def _remove_oldest(folder: Path) -> None:
    """Keep the folder below its limit; a file that another process has mapped lives on until that
    lets go of it.
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

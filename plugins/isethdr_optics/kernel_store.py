"""Kernel store: kernels kept on disk between processes, under a name made of all that they depend on.

A file holds, one after another in NumPy's format: facts (float64), checksums (uint32), kernels (float32). It is written under a temporary
name and renamed, so any number of processes may share a folder; each maps the kernels into memory, where they are held once for all.
Where nothing can be written, nothing is kept.
"""

from __future__ import annotations

import os
import time
import uuid
import zlib
from pathlib import Path

import numpy as np

from isethdr_core import provenance, store

LIMIT_BYTES = 8 << 30  # of all files together; beyond it those unused for longest go
ABANDONED_S = 3600.0  # age at which a temporary file's writer is taken for dead


def name(lens, flares, wavelength_nm, pitch_um, reach) -> str | None:
    """Return the file's name for kernels of these arguments and of the code that makes them; None where they have no such name."""
    try:
        return store.content_hash(
            {
                "optics": [_named(c) for c in (lens, *flares)],
                "sampling": [np.asarray(wavelength_nm, float), np.round(pitch_um, 9), list(reach)],
                "code": provenance.fingerprint(lens, *flares, core=("isethdr_core.physics", __package__)),
                "files": provenance.input_digests(lens, *flares),
                "versions": [np.__version__, provenance.versions().get("scipy")],
            }
        )
    except (TypeError, ValueError, ImportError, OSError):  # fields that are no values, or a class typed at a prompt
        return None


def _named(component):
    return [type(component).__module__, type(component).__qualname__, store.jsonable(component)]


def _folder() -> Path:
    return store.home() / "kernels"


def load(key: str):
    """Return (facts, kernels): (fact, band) float64 and (band, y, x) float32, mapped; None where missing or damaged."""
    path = _folder() / f"{key}.npy"
    try:
        with open(path, "rb") as file:
            facts, checks = np.load(file), np.load(file)
            np.lib.format.read_magic(file)
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
            bands = np.memmap(path, dtype, "r", file.tell(), shape)
        if [zlib.crc32(part) for part in (facts, *bands)] != checks.tolist():
            return None
        os.utime(path)
    except (OSError, ValueError, EOFError):
        return None
    return facts, bands


def save(key: str, facts, bands) -> None:
    """Keep kernels for `load`; do nothing where that is not possible."""
    folder = _folder()
    temporary = folder / f".{key}.{os.getpid()}-{uuid.uuid4().hex[:6]}.tmp"
    shape = (len(bands), *bands[0].shape)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with open(temporary, "wb") as file:
            np.save(file, facts)
            np.save(file, np.array([zlib.crc32(part) for part in (facts, *bands)], np.uint32))
            np.lib.format.write_array_header_1_0(file, {"descr": "<f4", "fortran_order": False, "shape": shape})
            for band in bands:  # one at a time: no second copy of all
                file.write(np.ascontiguousarray(band, "<f4"))
        os.replace(temporary, folder / f"{key}.npy")
        _remove_oldest(folder)
    except OSError:
        pass
    finally:
        try:
            temporary.unlink(missing_ok=True)
        except OSError:
            pass


def _remove_oldest(folder):
    """Keep the folder below its limit; a file that another process has mapped lives on until that lets go of it."""
    for path in folder.glob(".*.tmp"):
        if time.time() - path.stat().st_mtime > ABANDONED_S:
            path.unlink(missing_ok=True)
    total = 0
    files = sorted(((p.stat(), p) for p in folder.glob("*.npy")), key=lambda f: f[0].st_mtime, reverse=True)
    for stat, path in files:
        total += stat.st_size
        if total > LIMIT_BYTES:
            path.unlink(missing_ok=True)

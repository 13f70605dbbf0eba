"""Locate a copy of LLVM that `scripts/llvm.sh` unpacked into this Python environment.

The script needs no root.
"""

from __future__ import annotations

import ctypes
import os
import sys
from functools import cache
from pathlib import Path


def unpacked() -> Path | None:
    """Return the libLLVM unpacked below this Python environment, or None."""
    libraries = sorted(Path(sys.prefix, "lib", "llvm").glob("libLLVM*.so*"))
    return libraries[0] if libraries else None


@cache
def use_unpacked() -> None:
    """Make Dr.Jit use the unpacked libLLVM, unless DRJIT_LIBLLVM_PATH names another. Call this
    before importing mitsuba.

    The libraries that libLLVM needs are in its folder, where the loader does not search. They are
    loaded here first, in several rounds because they depend on each other. Child processes find
    them through LD_LIBRARY_PATH.
    """
    library = unpacked()
    if library is None or os.environ.get("DRJIT_LIBLLVM_PATH"):
        return
    os.environ["DRJIT_LIBLLVM_PATH"] = str(library)
    os.environ["LD_LIBRARY_PATH"] = os.pathsep.join(
        filter(None, [str(library.parent), os.environ.get("LD_LIBRARY_PATH", "")])
    )
    waiting = [p for p in sorted(library.parent.glob("*.so*")) if p != library]
    while waiting:
        not_loaded = [p for p in waiting if not _loaded(p)]
        if len(not_loaded) == len(waiting):
            break
        waiting = not_loaded


def _loaded(path: Path) -> bool:
    try:
        ctypes.CDLL(str(path), mode=ctypes.RTLD_GLOBAL)
    except OSError:
        return False
    return True

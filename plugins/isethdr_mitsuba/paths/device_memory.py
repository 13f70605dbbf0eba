"""NumPy arrays in memory that compiled code reads in whole vectors.

Dr.Jit reads NumPy arrays in place, and compiles different code for arrays that do not begin at a
vector boundary. NumPy aligns its memory to vectors only by chance, so the same values would need
sometimes one kernel, sometimes another.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

VECTOR_BYTES = 64  # vector size of the processors with the widest vectors


def aligned(values: npt.ArrayLike, dtype: npt.DTypeLike) -> np.ndarray:
    """Return a flat copy of `values` that begins at a multiple of `VECTOR_BYTES`."""
    flat = np.ravel(values)
    size_bytes = flat.size * np.dtype(dtype).itemsize
    memory = np.empty(size_bytes + VECTOR_BYTES, np.uint8)
    begin = -memory.ctypes.data % VECTOR_BYTES
    out = memory[begin : begin + size_bytes].view(dtype)
    out[:] = flat
    return out

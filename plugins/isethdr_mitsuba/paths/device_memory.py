"""NumPy arrays in memory that compiled code reads in whole vectors.

Dr.Jit reads NumPy's memory where it lies, and compiles other code where that does not begin at a
whole vector. NumPy's memory does so by chance: the same lists would take one kernel or another.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

VECTOR_BYTES = 64  # of the widest processors


def aligned(values: npt.ArrayLike, dtype: npt.DTypeLike) -> np.ndarray:
    """Return a flat copy of `values` that begins at a multiple of `VECTOR_BYTES`."""
    flat = np.ravel(values)
    size_bytes = flat.size * np.dtype(dtype).itemsize
    memory = np.empty(size_bytes + VECTOR_BYTES, np.uint8)
    begin = -memory.ctypes.data % VECTOR_BYTES
    out = memory[begin : begin + size_bytes].view(dtype)
    out[:] = flat
    return out

"""Random words of pixels: one 64-bit word per (stream, row, column).

The word of pixel (y, x) is word x % 4 of Philox4x64-10 (Salmon et al. 2011, "Parallel random
numbers: as easy as 1, 2, 3") with key = 128-bit hash of the stream and counter = [x // 4 + 1, y, 0,
0]. It does not depend on image size, chunks, order, processes, or the light in other pixels. A
stream is a tuple of strings and numbers, as `isethdr_core.seeds.Generator` returns it.
"""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict

import numpy as np

# number of cached generators, one per stream: a shot uses a dozen streams, block after block
KEPT = 32
_of_thread = threading.local()


def philox(stream: tuple[object, ...]) -> np.random.Philox:
    """Return NumPy's Philox with a key from a tuple of str and int. Tuples of different length or
    type have different keys.
    """
    key = hashlib.blake2b(repr(tuple(stream)).encode(), digest_size=16).digest()
    return np.random.Philox(key=int.from_bytes(key, "little"))


def _generator_of(stream: tuple[object, ...]) -> np.random.Philox:
    """Return this thread's own Philox of a stream; the counter is where the last use left it."""
    generators = _of_thread.__dict__.setdefault("found", OrderedDict())
    key = repr(tuple(stream))
    if key not in generators:
        generators[key] = philox(stream)
        if len(generators) > KEPT:
            generators.popitem(last=False)
    return generators[key]


def words(stream: tuple[object, ...], y0: int, y1: int, x0: int, x1: int) -> np.ndarray:
    """Return the int64 words of the pixels in rows y0:y1 and columns x0:x1.

    Parameters
    ----------
    stream : key of one purpose, for example `generator.stream("LPHG", "read")`.
    y0, y1, x0, x1 : pixel positions, 0 or more; `y1` and `x1` are excluded.

    Returns
    -------
    (y1 - y0, x1 - x0) int64 array, all 2^64 values equally likely.
    """
    bits = _generator_of(stream)  # the counter is set for every row
    state = bits.state
    first = x0 % 4
    out = np.empty((y1 - y0, x1 - x0), np.int64)
    for y in range(y0, y1):
        # NumPy adds 1 to the counter before it computes the next four words. Position 4 means that
        # all of the last four words were used.
        state["state"]["counter"][:] = x0 // 4, y, 0, 0
        state["buffer_pos"] = 4
        state["has_uint32"] = 0
        bits.state = state
        out[y - y0] = bits.random_raw(x1 - x0 + first)[first:].view(np.int64)
    return out


def tail(word: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (p, upper): the probability p in (0, 0.5] of the tail beyond the draw; `upper` states
    whether it is the upper tail.

    The relative precision of p is kept down to p = 2^-65. A uniform number in (0, 1) would round to
    1 there.
    """
    return ((word ^ (word >> 63)) + 0.5) * 2.0**-64, word >= 0

"""Machine speed: how fast this processor is, for estimates of run time.

Before a run is stored, a component estimates its time from its work and from constants in seconds.
The constants were measured on one machine. On a processor that is three times as fast, such
estimates were three to four times too long.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from time import thread_time

import numpy as np
import scipy

__all__ = ["relative_speed"]

SIDE = 256  # of the transformed square
LENGTH = 1 << 18  # of the other arrays
REPEATS = 7  # the fastest counts: the first fill caches, and other processes delay some
# CPU seconds of the tasks on the server of 2 GHz on which the constants of the lenses and of the
# renderer were measured. They were set on a faster machine (AMD EPYC, family 26), which takes 1/3.5
# of them: its renderer and three lenses took 1/3.3 to 1/4.1 of their estimated times.
TRANSFORM_S = 6.7e-4
GATHER_S = 7.6e-4
SUMS_S = 2.6e-3


@cache
def relative_speed() -> float:
    """Return the speed of this processor over that of the processor on which the constants of the
    lenses and of the renderer were measured.

    A component that estimates its time multiplies the seconds that it measured by the speed of the
    processor on which it measured them, and divides its estimate by that of the present one.

    The speed is the geometric mean over three tasks that are typical of the work: a Fourier
    transform, reads at random places, and running sums. Measuring takes 15 ms, once per process. It
    is repeatable within about 10 %.
    """
    random = np.random.default_rng(0)
    square = random.standard_normal((SIDE, SIDE)).astype(np.complex64)
    values = random.standard_normal(LENGTH)
    places = random.permutation(LENGTH)
    ratios = [
        TRANSFORM_S / _shortest_s(lambda: scipy.fft.fft2(square)),
        GATHER_S / _shortest_s(lambda: values[places]),
        SUMS_S / _shortest_s(lambda: np.cumsum(values)),
    ]
    return float(np.prod(ratios) ** (1 / len(ratios)))


def _shortest_s(task: Callable[[], object]) -> float:
    """Return the CPU seconds of the fastest of some repeats of a task."""
    times = []
    for _ in range(REPEATS):
        start = thread_time()
        task()
        times.append(thread_time() - start)
    return max(min(times), 1e-9)  # a clock may stand still

"""Point: one setting with its error, CPU time and memory; and the Pareto front of all settings."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.pipeline.memory import machine_bytes

# short calls are repeated until they have taken this CPU time in total, or this number of times
SHORT_S = 0.5
MOST_CALLS = 8


@dataclass(frozen=True)
class Point:
    """Run time and error of one setting."""

    setting: str
    error: float
    cpu_s: float
    peak_mb: float = 0.0
    # default: what runs use; now: what a configuration has; peer: what other simulators do; view:
    # denoised for eyes
    mark: str = ""
    label: str = ""  # shorter text for the diagram; empty: the setting


@dataclass(frozen=True)
class Work:
    """All settings of one stage against one reference."""

    stage: str
    error_of: str  # name of the error, with its unit
    reference: str
    reference_error: float  # in the unit of the errors
    points: list[Point] = field(default_factory=list)
    allowed: float = math.nan  # error that a configuration allows, in the same unit
    fails_at: float = 100.0  # larger errors are drawn here
    no_error: str = "exact"  # text after the name of a setting without error


class Timed(NamedTuple):
    """The result of a call, and its cost."""

    result: Any
    cpu_s: float  # CPU time of the cheapest call
    peak_mb: float  # peak memory above that at the start, of the largest call


def timed(call: Callable[[], Any], repeat: int = 2) -> Timed:
    """Return the result, CPU time and peak memory of repeated calls. Short calls are repeated more
    often.

    CPU time depends little on the load of the machine, but other processes compete for its caches.
    The cheapest call is disturbed least.

    Parameters
    ----------
    call : the function that is measured.
    repeat : smallest number of calls.
    """
    best = float("inf")
    most = 0.0
    whole = 0.0
    calls = 0
    result = None
    while calls < repeat or (calls < MOST_CALLS and whole < SHORT_S):
        with ledger.stage(ledger.Ledger(), "idle") as idle:
            pass
        with ledger.stage(ledger.Ledger(), "measured") as row:
            start = time.process_time()
            result = call()
            cpu_s = time.process_time() - start
        best = min(best, cpu_s)
        most = max(most, (row.peak_bytes - idle.peak_bytes) / 1e6)
        whole += cpu_s
        calls += 1
    return Timed(result, best, most)


def refuse_what_does_not_fit(
    title: str,
    count: int,
    needed_bytes: Callable[[int], float],
    free_bytes: int | None = None,
) -> None:
    """Raise ConfigError if a reference needs more memory than is free. The message states its size
    and the largest count that fits.

    Parameters
    ----------
    title : name of the counted things, for the message.
    count : size of the reference, as typed.
    needed_bytes : function(count) -> bytes, which grow with the count.
    free_bytes : free memory, bytes; None: that of the machine.
    """
    free = free_memory() if free_bytes is None else free_bytes
    if count < 1:
        raise ConfigError(
            f"reference is {count!r}; expected a whole number of {title}, above 0; type for example"
            " reference=32"
        )
    if needed_bytes(count) <= free:
        return
    largest = largest_that_fits(count, needed_bytes, free)
    nearest = "none fits: free memory first"
    if largest:
        nearest = f"the largest that fits is {largest}: type reference={largest}"
    raise ConfigError(
        f"{count} {title} take {needed_bytes(count) / 1e9:.3g} GB, {free / 1e9:.3g} GB are free;"
        f" {nearest}"
    )


def largest_that_fits(count: int, needed_bytes: Callable[[int], float], free: int) -> int:
    """Return the largest number below `count` that fits into the free memory; 0 if none does.

    Parameters
    ----------
    count : a number that does not fit.
    needed_bytes : function(count) -> bytes, which grow with the count.
    free : free memory, bytes.
    """
    fits = 0
    too_large = count
    while too_large - fits > 1:
        middle = (fits + too_large) // 2
        if needed_bytes(middle) <= free:
            fits = middle
        else:
            too_large = middle
    return fits


def free_memory() -> int:
    """Return the bytes of memory that are available without swapping (Linux), at most what this
    process may use; 2^62 where neither is known.
    """
    most = int(min(machine_bytes(), 1 << 62))
    try:
        with open("/proc/meminfo") as lines:
            available = next(
                int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:")
            )
    except (OSError, StopIteration):
        return most
    return min(available, most)


def front(points: list[Point]) -> list[Point]:
    """Return the Pareto front, cheapest first: each of its points has a smaller error than all
    cheaper points.

    A point without a known error (nan) is left out.
    """
    best: list[Point] = []
    for point in sorted(points, key=lambda p: (p.cpu_s, p.error)):
        if math.isnan(point.error):
            continue
        if not best or point.error < best[-1].error:
            best.append(point)
    return best


def as_rows(work: Work) -> list[dict[str, Any]]:
    """Return one row per setting."""
    best = front(work.points)
    return [
        {
            "stage": work.stage,
            "setting": p.setting,
            "error": p.error,
            "error_of": work.error_of,
            "cpu_s": p.cpu_s,
            "peak_mb": p.peak_mb,
            "mark": p.mark,
            "front": p in best,
            "reference": work.reference,
            "reference_error": work.reference_error,
        }
        for p in work.points
    ]

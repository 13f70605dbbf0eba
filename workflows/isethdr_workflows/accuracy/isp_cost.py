"""CPU seconds and memory of isps on one shot, each in a process of its own.

In a shared process, an isp would reuse memory that an earlier isp has freed, and this memory would
not be counted.
"""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

from isethdr_core.plugins.registry import build

from .point import timed

# side of the part of the shot that is developed first, so that files and libraries are opened
OPENING_PX = 32


class Cost(NamedTuple):
    """Cost of one picture."""

    cpu_s: float  # CPU time of all threads
    peak_mb: float  # peak memory above that at the start, with all files open


def costs_alone(isps: Sequence[tuple[str, Mapping[str, Any]]], captures: Any) -> list[Cost]:
    """Return the cost of each isp on one shot.

    Parameters
    ----------
    isps : name and fields of each isp.
    captures : the shot, as a sensor returns it.

    Returns
    -------
    for each isp: CPU seconds of the cheapest of two or more calls, and the largest memory.
    """
    alone = ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1)
    with tempfile.TemporaryDirectory() as folder, alone as processes:
        shot = Path(folder) / "shot.pickle"
        shot.write_bytes(pickle.dumps(captures))
        return [processes.submit(_cost, name, dict(fields), shot).result() for name, fields in isps]


def _cost(name: str, fields: dict[str, Any], shot: Path) -> Cost:
    captures = pickle.loads(shot.read_bytes())
    isp = build("isp", name, **fields)
    isp(captures.isel(y=slice(OPENING_PX), x=slice(OPENING_PX)))
    _, cpu_s, peak_mb = timed(lambda: isp(captures))
    return Cost(cpu_s, peak_mb)

"""Records: ledgers of stored runs, and the record that is most similar to a stage to come."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from ...errors import CatalogError
from ...storage import store

NEWEST = 32  # number of stored runs, and of stored scenes, that are read: each takes a millisecond
# a stored stage with other settings counts as less similar by as much as one of this many times
# the size
OTHER_SETTINGS = 4.0
# largest CPU time for loading one module: colour takes 1.6 s for 743 modules
LOADING_S = 3e-3


class Found(NamedTuple):
    """The expected seconds of a stage, and how unlike the record is that they come from."""

    without_cpu_s: bool  # whether the record lacks CPU time; it may have waited most of its time
    distance: float  # logarithm of the ratio of the sizes, larger for other settings
    seconds: float


@dataclass
class NearestRecords:
    """The expected seconds of each stage, from the most similar record considered so far."""

    _found: dict[str, Found] = field(default_factory=dict)

    def consider(self, row: dict[str, Any], ratio: float, unlike: float = 1.0) -> None:
        """Take the estimate from a ledger row if this row is more similar than the rows before. A
        row with CPU time is preferred to any row without it.

        Parameters
        ----------
        row : row of a stored ledger, as plain data.
        ratio : work of the stage to come, relative to that of the row.
        unlike : factor above 1 if settings differ; its logarithm adds to the distance.
        """
        stage = row["stage"]
        without_cpu_s = row.get("cpu_s") is None
        distance = abs(math.log(ratio)) + math.log(unlike)
        before = self._found.get(stage)
        if before is None or (without_cpu_s, distance) < before[:2]:
            busy_s = _busy_s(row)
            loading_s = min(busy_s, LOADING_S * row.get("modules", 0))
            seconds = loading_s + ratio * (busy_s - loading_s)
            self._found[stage] = Found(without_cpu_s, distance, seconds)

    def replace(self, stage: str, seconds: float) -> None:
        """Take an estimate of a component's own in place of the records."""
        self._found[stage] = Found(False, 0.0, seconds)

    def seconds(self, stage: str) -> float | None:
        """Return the expected seconds of a stage; None where no record is known."""
        found = self._found.get(stage)
        return None if found is None else found.seconds


def newest(kind: str) -> list[dict]:
    """Return the root attributes of the newest complete stores of a folder.

    Parameters
    ----------
    kind : name of the folder in the home folder: `runs` or `scenes`.
    """
    attributes = []
    for path in sorted((store.home() / kind).glob("*.zarr"), key=_age)[:NEWEST]:
        with suppress(CatalogError):
            attributes.append(store.read_attrs(path))
    return attributes


def _busy_s(row: dict[str, float | str]) -> float:
    """Return the seconds that a stage took, without the time that it waited for other programs."""
    cpu_s = row.get("cpu_s")  # earlier versions stored none
    return row["seconds"] if cpu_s is None else min(row["seconds"], cpu_s)


def _age(path: Path) -> float:
    try:
        return -path.stat().st_mtime
    except OSError:  # another process has just taken it away
        return math.inf

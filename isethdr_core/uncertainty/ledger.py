"""Ledger: per stage the seconds, the peak memory, the error and what was left out.

A stage reports from inside its `__call__`: `ledger.error(0.03, "relative", "statistical")`,
`ledger.left_out("group streetlights", "weight 0", 0, "cd/m2")`. Outside a run both do nothing.
"""

from __future__ import annotations

import threading
import time
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING

from .error_terms import ErrorNote, How, LightPart

if TYPE_CHECKING:
    import xarray as xr

ABSOLUTE = (
    "W m-2 nm-1",
    "electrons",
    "e",
    "cd/m2",
)  # units in which errors of parts of a sum add up


@dataclass(frozen=True)
class LeftOut:
    """Something that was not computed, why, and the largest change that can make."""

    what: str
    why: str
    bound: float
    unit: str


@dataclass
class Row:
    """One stage of one run."""

    stage: str
    seconds: float = 0.0
    peak_bytes: int = 0
    errors: list[ErrorNote] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    light_parts: dict[str, LightPart] = field(
        default_factory=dict, compare=False, repr=False
    )  # of this run; never stored

    @property
    def error(self) -> float | None:
        """The first error stated, in `error_unit`; None where the stage states none."""
        return self.errors[0].value if self.errors else None

    @property
    def error_unit(self) -> str:
        """The unit of `error`."""
        return self.errors[0].unit if self.errors else ""


class Ledger(list):
    """The rows of a run, in the order of the stages."""

    def as_records(self) -> list[dict]:
        """Return plain dictionaries, ready for JSON."""
        return [_record(row) for row in self]

    @classmethod
    def from_records(cls, records) -> Ledger:
        """Return the ledger that `as_records` was called on."""
        return cls(
            Row(
                r["stage"],
                r["seconds"],
                r["peak_bytes"],
                [ErrorNote(**e) for e in r["errors"]],
                [LeftOut(**o) for o in r["left_out"]],
            )
            for r in records
        )


def _record(row: Row) -> dict:
    notes = {name: [asdict(note) for note in getattr(row, name)] for name in ("errors", "left_out")}
    return {"stage": row.stage, "seconds": row.seconds, "peak_bytes": row.peak_bytes, **notes}


_row: ContextVar[Row | None] = ContextVar("isethdr_ledger_row", default=None)


def error(value: float, unit: str, how: How, what: str = "") -> None:
    """State how wrong the running stage may be."""
    if row := _row.get():
        row.errors.append(ErrorNote(float(value), unit, how, what))


def add_error(note: ErrorNote) -> None:
    """State an error of the running stage with all its fields: source, quantity and part."""
    if row := _row.get():
        row.errors.append(replace(note, value=float(note.value)))


def light_part(name: str, light: xr.DataArray, within_tiles: bool = False) -> None:
    """Declare a part of the running stage's light that an error term acts on by its `part`; parts
    of one name add up.

    Parameters
    ----------
    light : irradiance or photocurrent on the sensor plane, on any grid of tiles.
    within_tiles : `light` is the standard deviation of the light within each tile, of which a pixel
        feels what its borders divide.
    """
    if row := _row.get():
        if name in row.light_parts:
            light = light.copy(data=row.light_parts[name].light.values + light.values)
        row.light_parts[name] = LightPart(light, within_tiles)


def records_errors() -> bool:
    """Return whether anybody will read what the running stage states."""
    return _row.get() is not None


def stated() -> bool:
    """Return whether the running stage has stated an error; True outside a run, where nobody
    asks.
    """
    row = _row.get()
    return row is None or bool(row.errors)


def left_out(what: str, why: str, bound: float, unit: str) -> None:
    """State what the running stage did not compute, and the largest change that can make."""
    if row := _row.get():
        row.left_out.append(LeftOut(what, why, float(bound), unit))


@contextmanager
def parts_of_a_sum():
    """State once what parts of a sum of light state in the same words: the largest relative value,
    the total of absolute ones.
    """
    row = _row.get()
    before = (len(row.errors), len(row.left_out)) if row else (0, 0)
    yield
    if row:
        for notes, first, field_name in (
            (row.errors, before[0], "value"),
            (row.left_out, before[1], "bound"),
        ):
            notes[first:] = _joined(notes[first:], field_name)


def _joined(notes, field_name: str) -> list:
    kept: dict = {}
    for note in notes:
        same = replace(note, **{field_name: 0.0})  # all but the number
        kept.setdefault(same, []).append(getattr(note, field_name))
    return [
        replace(same, **{field_name: sum(values) if same.unit in ABSOLUTE else max(values)})
        for same, values in kept.items()
    ]


@contextmanager
def stage(ledger: Ledger, name: str):
    """Time one stage, watch its peak memory, and collect what it states, into a new row."""
    row = Row(name)
    token = _row.set(row)
    watch = _PeakWatch()
    start = time.perf_counter()
    try:
        yield row
    finally:
        row.seconds = time.perf_counter() - start
        row.peak_bytes = watch.stop()
        _row.reset(token)
        ledger.append(row)


class _PeakWatch:
    """Largest anonymous resident memory of this process, sampled every 20 ms (Linux; 0
    elsewhere).
    """

    def __init__(self):
        self._peak, self._done = _resident_bytes(), threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def _watch(self):
        while not self._done.wait(0.02):
            self._peak = max(self._peak, _resident_bytes())

    def stop(self) -> int:
        self._done.set()
        self._thread.join()
        return max(self._peak, _resident_bytes())


def _resident_bytes() -> int:
    try:
        with open("/proc/self/status") as status:
            for line in status:
                if line.startswith("RssAnon:"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    return 0

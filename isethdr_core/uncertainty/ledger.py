"""Ledger: the seconds, the peak memory, the errors and the omissions of each stage.

A stage reports from inside its `__call__`: `ledger.error(0.03, "relative", "statistical")`,
`ledger.left_out("group streetlights", "weight 0", 0, "cd/m2")`. Outside a run nothing is recorded.
A stage may call a function more than once, or discard its result. Such a function returns its terms
with its result, and the stage records the terms that apply (`record`). `collected` does this for a
component, which reports by itself.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, get_args

from ..errors import PluginError
from . import error_terms
from .earlier_terms import PARTS, ErrorNote, quantity_and_part, term_of, unit_and_part
from .error_terms import ErrorTerm, How, LightPart, Quantity, Reading, Source

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class LeftOut:
    """Something that was not computed, why, and the largest change that this can cause.

    `what` and `why` are for people, `key` and `needless` for code.
    """

    what: str
    why: str
    bound: float
    unit: str
    key: str = ""
    # True: no result depends on it. False: this is not known, or a setting leaves it out
    needless: bool = False


Note: TypeAlias = ErrorTerm | LeftOut  # what a function states of its result


@dataclass
class Row:
    """One stage of one run; its title is `kind name`.

    `reused` : the result was kept from an earlier run, which took these seconds and this memory.
    """

    stage: str
    seconds: float = 0.0  # from its start to its end, however busy the machine was
    peak_bytes: int = 0
    errors: list[ErrorTerm] = field(default_factory=list)
    left_out: list[LeftOut] = field(default_factory=list)
    # declared parts of the light, in this run only; never stored
    light_parts: dict[str, LightPart] = field(default_factory=dict, compare=False, repr=False)
    reused: bool = False
    # CPU time of the stage, including programs that it started, but not simultaneous work on other
    # cameras; None in the records of earlier versions
    cpu_s: float | None = None
    modules: int = 0  # number of Python modules that it loaded first; 0 in earlier records

    @property
    def error(self) -> float | None:
        """The first error stated, in `error_unit`; None if the stage states none."""
        return self.errors[0].value if self.errors else None

    @property
    def error_unit(self) -> str:
        """The unit of `error`."""
        return self.errors[0].unit if self.errors else ""

    @property
    def kind(self) -> str:
        """The kind of the stage."""
        return self.stage.partition(" ")[0]

    def source(self, key: str = "") -> Source:
        """Return the source of an error that this stage states."""
        kind, _, name = self.stage.partition(" ")
        return Source(kind, name, key)


class Ledger(list[Row]):
    """The rows of a run, in the order of the stages."""

    def as_records(self) -> list[dict[str, Any]]:
        """Return plain dictionaries, ready for JSON."""
        return [_record(row) for row in self]

    @classmethod
    def from_records(cls, records: Iterable[dict[str, Any]]) -> Ledger:
        """Return the ledger of records that this or an earlier version made with `as_records`."""
        return cls(
            Row(
                r["stage"],
                r["seconds"],
                r["peak_bytes"],
                [_term(e, r["stage"]) for e in r["errors"]],
                [LeftOut(**o) for o in r["left_out"]],
                reused=r.get("reused", False),
                cpu_s=r.get("cpu_s"),
                modules=r.get("modules", 0),
            )
            for r in records
        )


def _record(row: Row) -> dict[str, Any]:
    notes = {name: [asdict(note) for note in getattr(row, name)] for name in ("errors", "left_out")}
    work = {"seconds": row.seconds, "cpu_s": row.cpu_s, "peak_bytes": row.peak_bytes}
    return {"stage": row.stage, **work, "modules": row.modules, "reused": row.reused, **notes}


def _term(stored: dict[str, Any], stage: str) -> ErrorTerm:
    if "acts_on" not in stored:  # written by an earlier version
        source = Row(stage).source()
        return term_of(ErrorNote(**stored), source.kind, source.name)
    acts_on, part = quantity_and_part(stored["acts_on"], stored["part"])
    read = {"source": Source(**stored["source"]), "acts_on": acts_on, "part": part}
    return ErrorTerm(**(stored | read))


_row: ContextVar[Row | None] = ContextVar("isethdr_ledger_row", default=None)


def error(  # noqa: PLR0913 - plugins call it with these arguments
    value: float,
    unit: str,
    how: How,
    label: str = "",
    *,
    key: str = "",
    acts_on: Quantity | None = None,
    part: str | None = None,
) -> None:
    """State an error of the result of the running stage.

    Parameters
    ----------
    value, unit, how, label, part : as in `ErrorTerm`.
    key : distinguishes errors within the stage. Terms with a key that agree in all except value and
        label are alternatives.
    acts_on : quantity that is wrong; None: the quantity that a stage of this kind returns
        (`error_terms.RETURNED`).

    Raises
    ------
    PluginError : the value is negative or NaN, or `how` is unknown.
    """
    row = _row.get()
    spelt = unit
    unit, part = unit_and_part(unit, part)
    quantity = acts_on or error_terms.RETURNED.get(row.kind if row else "", Quantity.OTHER)
    record(ErrorTerm(Source(key=key), quantity, part, float(value), unit, how, label))
    if row and spelt != unit:
        _declare_earlier(row, part)


def record(*terms: ErrorTerm) -> None:
    """Add error terms to the running stage; a source without a kind becomes this stage's.

    Raises
    ------
    PluginError : the value of a term of this stage is negative or NaN, or its `how` is unknown.
    """
    row = _row.get()
    own = row.source() if row else Source()
    for term in terms:
        # restated terms of other stages were checked, or are stored
        if not term.source.kind or replace(term.source, key="") == own:
            _check(term, row.stage if row else "")
        if row:
            source = term.source if term.source.kind else row.source(term.source.key)
            row.errors.append(replace(term, source=source, value=float(term.value)))


def _check(term: ErrorTerm, stage: str) -> None:
    """Raise PluginError unless a term is a magnitude that is known in one of the ways of `How`.

    A negative term would cancel other errors, and NaN would hide them.
    """
    name = term.label or term.source.key
    title = f"{stage}: the error" if stage else "the error"
    title += f" {name!r}" if name else " without a label"
    if not term.value >= 0:
        raise PluginError(
            f"{title} has the value {term.value:g} {term.unit}; expected the size of the error, 0"
            " or more; type abs(value), or math.inf if the error is not known"
        )
    if term.how not in get_args(How):
        ways = ", ".join(map(repr, get_args(How)))
        raise PluginError(f"{title} has how={term.how!r}; expected one of {ways}")


def add_error(note: ErrorNote | ErrorTerm) -> None:
    """Add an error term, or a note of an earlier version, to the running stage; see `record`.

    Raises
    ------
    PluginError : as `record` raises it.
    """
    if isinstance(note, ErrorTerm):
        record(note)
    elif row := _row.get():
        term = term_of(note, row.source().kind, row.source().name)
        record(term)
        _declare_earlier(row, term.part)


def _declare_earlier(row: Row, part: str | None) -> None:
    """Declare a part that a plugin of an earlier version need not declare."""
    if part in PARTS:
        row.light_parts.setdefault(part, PARTS[part])


def light_part(name: str, light: xr.DataArray, within_tiles: bool = False) -> None:
    """Declare a part of the running stage's light that error terms act on by their `part`.

    Parts of one name add up.

    Parameters
    ----------
    name : name of the part in error terms.
    light : irradiance or photocurrent on the sensor plane, on any grid of tiles.
    within_tiles : whether `light` is the standard deviation of the light within each tile. It acts
        only on pixels with borders that cut tiles.

    Raises
    ------
    PluginError : `light` is no DataArray with the dims y and x and the attribute `units`.
    """
    try:
        _ = light.shape  # a Dataset has none
        dims = tuple(map(str, light.dims))
        attrs = light.attrs
    except AttributeError:
        raise PluginError(
            f"light_part {name!r}: the light is of type {type(light).__name__}; expected an"
            " xarray.DataArray with y and x; type light.copy(data=values)"
        ) from None
    if not {"y", "x"} <= set(dims):
        raise PluginError(
            f"light_part {name!r}: the light has the dims {dims}; expected y and x among them; type"
            " (part * xarray.ones_like(light)).assign_attrs(light.attrs), with the lens's light"
        )
    if "units" not in attrs:
        raise PluginError(
            f"light_part {name!r}: the light has no attribute 'units'; expected the units of the"
            " lens's light; type part.assign_attrs(light.attrs)"
        )
    reading = Reading.DEVIATION if within_tiles else Reading.LIGHT
    _declare(name, LightPart(light, reading))


def image_part(name: str) -> None:
    """Declare the part of the running stage's light that comes from the tiles a pixel looks at."""
    _declare(name, LightPart(None, Reading.IMAGE))


def rest_part(name: str) -> None:
    """Declare the part of the light that does not come from the tiles a pixel looks at."""
    _declare(name, LightPart(None, Reading.REST))


def _declare(name: str, part: LightPart) -> None:
    if row := _row.get():
        declared = row.light_parts.get(name)
        if declared is not None and declared.light is not None and part.light is not None:
            light = part.light.copy(data=declared.light.values + part.light.values)
            part = replace(part, light=light)
        row.light_parts[name] = part


def records_errors() -> bool:
    """Return whether the statements of the running stage are recorded."""
    return _row.get() is not None


def stated() -> bool:
    """Return whether the running stage has stated an error; True outside a run, where nothing is
    recorded.
    """
    row = _row.get()
    return row is None or bool(row.errors)


def left_out(
    what: str, why: str, bound: float, unit: str, *, key: str = "", needless: bool = False
) -> None:
    """State what the running stage did not compute, and the largest change that this can cause.

    Parameters
    ----------
    what, why : what was left out and the reason, for people.
    bound, unit : largest change, and its unit.
    key : what was left out, for code that looks for it.
    needless : whether no result depends on it.
    """
    if row := _row.get():
        row.left_out.append(LeftOut(what, why, float(bound), unit, key, needless))


def record_notes(notes: Iterable[Note]) -> None:
    """Add error terms, and what was left out, to the running stage; see `record`."""
    for note in notes:
        if isinstance(note, LeftOut):
            record_left_out(note)
        else:
            record(note)


def record_left_out(*notes: LeftOut) -> None:
    """Add what was left out to the running stage."""
    if row := _row.get():
        row.left_out += notes


class Kept(NamedTuple):
    """The part of some data that is kept, and the rows for what is left out."""

    kept: Any
    left_out: tuple[LeftOut, ...] = ()


def record_kept(kept: Kept) -> Any:
    """Add the rows for what was left out to the running stage; return the data that is kept."""
    record_left_out(*kept.left_out)
    return kept.kept


class Collected(NamedTuple):
    """The result of a call, and the rows that it stated."""

    result: Any
    row: Row


def collected(call: Callable[[], Any]) -> Collected:
    """Return `call()` and what it states, which does not become part of the running stage.

    It is for components that are called again, whose terms have been recorded already, and for
    attempts that may be discarded. `record_row` adds the terms of a result that is kept.
    """
    running = _row.get()
    row = Row(running.stage if running else "")
    token = _row.set(row if running else None)  # outside a run nothing is recorded
    try:
        return Collected(call(), row)
    finally:
        _row.reset(token)


@contextmanager
def gathered(title: str) -> Iterator[Row]:
    """Collect what is stated within this context in a separate row, outside the ledger.

    Plans use this: they carry their terms until light is computed with them.

    Parameters
    ----------
    title : title of the row if no stage is running.
    """
    running = _row.get()
    row = Row(running.stage if running and running.kind == Row(title).kind else title)
    token = _row.set(row)
    try:
        yield row
    finally:
        _row.reset(token)


def record_row(other: Row) -> None:
    """Add what another row states to the running stage."""
    if row := _row.get():
        record(*other.errors)
        row.left_out += other.left_out
        record_light_parts(other)


def record_light_parts(other: Row) -> None:
    """Move the light that another row declares to the running stage, where it adds up."""
    for name, part in other.light_parts.items():
        _declare(name, part)
    other.light_parts = {}


def row_of_sum(parts: Iterable[Row]) -> Row:
    """Return the row for a sum of light, from the rows for its parts.

    Errors add up as in `error_terms.of_sum`. Omissions with the same text or key are listed once.
    """
    parts = list(parts)
    out = Row(parts[0].stage if parts else "", errors=error_terms.of_sum(p.errors for p in parts))
    omitted: dict[tuple[Any, ...], list[LeftOut]] = {}
    for note in (note for part in parts for note in part.left_out):
        words = note.key or (note.what, note.why)
        omitted.setdefault((words, note.unit), []).append(note)
    out.left_out = [
        replace(notes[0], bound=error_terms.total((n.bound for n in notes), unit))
        for (_, unit), notes in omitted.items()
    ]
    return out


@contextmanager
def stage(ledger: Ledger, name: str) -> Iterator[Row]:
    """Time one stage, watch its peak memory, and collect what it states, into a new row."""
    row = Row(name)
    token = _row.set(row)
    watch = _PeakWatch()
    loaded = len(sys.modules)
    start = time.perf_counter()
    start_cpu_s = cpu_s()
    try:
        yield row
    finally:
        row.seconds = time.perf_counter() - start
        row.cpu_s = cpu_s() - start_cpu_s
        row.modules = max(len(sys.modules) - loaded, 0)
        row.peak_bytes = watch.stop()
        _row.reset(token)
        ledger.append(row)


# CPU seconds of the threads that helped with the running part; None outside `part_of_work`
_helped_s: ContextVar[list[float] | None] = ContextVar("isethdr_helped_s", default=None)


def cpu_s() -> float:
    """Return the CPU seconds spent so far: of this process and of the programs that it started and
    that ended. Within `part_of_work`: of this thread and of those that helped it.
    """
    helped_s = _helped_s.get()
    if helped_s is not None:
        return time.thread_time() + sum(helped_s)
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


@contextmanager
def part_of_work(helps: bool) -> Iterator[None]:
    """Count the CPU seconds of one part of work, while other threads do other work.

    Parameters
    ----------
    helps : whether this thread works on the part for another one, which then counts its seconds.
    """
    around = _helped_s.get()
    own: list[float] = []
    token = _helped_s.set(own)
    start_s = time.thread_time()
    try:
        yield
    finally:
        _helped_s.reset(token)
        if around is not None:
            around.append(sum(own) + (time.thread_time() - start_s if helps else 0.0))


class _PeakWatch:
    """Largest anonymous resident memory of this process, sampled every 20 ms (Linux; 0
    elsewhere).
    """

    def __init__(self) -> None:
        self._peak = _resident_bytes()
        self._done = threading.Event()
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def _watch(self) -> None:
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

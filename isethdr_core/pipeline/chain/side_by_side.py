"""Side by side: independent parts of a run on several threads.

`sharing(threads)` states how many threads may work within a block. Each call of `side_by_side` in
it is worked on by the calling thread and by threads that help. Calls may be nested. A thread that
waits for its helpers does not count, so that others may start one.

Results do not depend on the number of threads. If a part fails, the parts before it are finished,
so that the error is the one that a single thread would have met first. Parts after it end at their
next stage. Ctrl-C ends all parts at their next stage.

Each part runs in a copy of the context of the call: what a part states, and what it keeps with
`derived_once.shared`, is its own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import Context, ContextVar, copy_context
from threading import Lock, Semaphore, Thread, current_thread
from typing import Any, TypeVar

from ...plugins.protocols import ThreadSafe
from ...plugins.registry import plugin_manager
from ...runs.processor import processors, threads_asked
from ...uncertainty import ledger

T = TypeVar("T")


class Unwanted(BaseException):
    """Ends a part whose result is not wanted any more."""


# how many more threads may work; None: the calling thread alone
_free: ContextVar[Semaphore | None] = ContextVar("isethdr_free_threads", default=None)
# the part that is running, with the parts around it: each call and the number of its part
_running: ContextVar[tuple[tuple[_Call, int], ...]] = ContextVar("isethdr_running", default=())


def threads_for(components: Iterable[object]) -> int:
    """Return how many threads may work on a run: as many as this process has processors, or
    OMP_NUM_THREADS where that is less. It is one unless all that is called is `ThreadSafe`.

    Parameters
    ----------
    components : components that are called. Plugins with hooks around stages are called as well.
    """
    hook = plugin_manager().hook
    hooks = (hook.isethdr_before_stage, hook.isethdr_after_stage, hook.isethdr_on_stage_error)
    plugins = [impl.plugin for one in hooks for impl in one.get_hookimpls()]
    if not all(isinstance(c, ThreadSafe) and c.THREAD_SAFE for c in (*components, *plugins)):
        return 1
    most = processors()
    return min(most, threads_asked() or most)


@contextmanager
def sharing(threads: int) -> Iterator[None]:
    """Let calls of `side_by_side` within the block use this number of threads, the calling one
    included.
    """
    token = _free.set(Semaphore(threads - 1) if threads > 1 else None)
    try:
        yield
    finally:
        _free.reset(token)


def side_by_side(parts: Sequence[Callable[[], T]]) -> list[T]:
    """Return the results of independent parts of work, in the order of the parts.

    Parameters
    ----------
    parts : functions without arguments. They start in this order.
    """
    free = _free.get()
    if free is None or len(parts) < 2:
        return [part() for part in parts]
    return _Call(parts, free).results()


def end_if_unwanted() -> None:
    """Raise Unwanted if the results of the running part are not wanted any more."""
    if any(number >= call.end for call, number in _running.get()):
        raise Unwanted


class _Call:
    """One call of `side_by_side`."""

    def __init__(self, parts: Sequence[Callable[[], Any]], free: Semaphore) -> None:
        self.end = len(parts)  # parts from this number on are not wanted
        self._parts = parts
        self._free = free
        self._context: Context = copy_context()
        self._thread = current_thread()
        self._lock = Lock()
        self._started = 0
        self._helpers: list[Thread] = []
        self._results: list[Any] = [None] * len(parts)
        self._errors: dict[int, BaseException] = {}

    def results(self) -> list[Any]:
        """Return the results of all parts, or raise the first error."""
        try:
            while (number := self._next()) is not None:
                self._find_helpers()
                self._run(number)
            self._wait()
        except BaseException:  # Ctrl-C between two parts or while waiting
            self.end = 0
            self._wait()
            raise
        if self._errors:
            raise min(self._errors.items(), key=_order)[1]
        return self._results

    def _next(self) -> int | None:
        """Return the number of the next part; None if all have started."""
        with self._lock:
            if self._started >= self.end:
                return None
            self._started += 1
            return self._started - 1

    def _find_helpers(self) -> None:
        """Start helper threads for the parts that have not started, within the limit of threads."""
        for _ in range(self._started, self.end):
            if not self._free.acquire(blocking=False):
                return
            helper = Thread(target=self._help)
            self._helpers.append(helper)
            helper.start()

    def _help(self) -> None:
        try:
            while (number := self._next()) is not None:
                self._run(number)
        finally:
            self._free.release()

    def _run(self, number: int) -> None:
        try:
            self._results[number] = self._context.copy().run(self._result, number)
        except Unwanted:
            pass
        except BaseException as err:
            with self._lock:
                self._errors[number] = err
                # Ctrl-C, or a call to exit: nothing is wanted any more
                self.end = min(self.end, number if isinstance(err, Exception) else 0)

    def _result(self, number: int) -> Any:
        _running.set((*_running.get(), (self, number)))
        with ledger.part_of_work(current_thread() is not self._thread):
            end_if_unwanted()
            return self._parts[number]()

    def _wait(self) -> None:
        """Wait for the helper threads. The limit of threads does not count this one meanwhile."""
        if not self._helpers:
            return
        self._free.release()
        try:
            for helper in self._helpers:
                helper.join()
        finally:
            self._free.acquire()


def _order(failure: tuple[int, BaseException]) -> tuple[bool, int]:
    """Return the sort key of a failed part: first what ends the process, then errors in order."""
    number, err = failure
    return isinstance(err, Exception), number

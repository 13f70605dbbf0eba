"""Threads: blocks of work on several threads, and linear algebra on one thread."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

from isethdr_core.runs.processor import processors, threads_asked

MOST_THREADS = 8


def cpus() -> int:
    """Return the number of threads to use: OMP_NUM_THREADS if it is set, else the number of
    processors that this process may use.
    """
    return threads_asked() or processors()


@contextmanager
def threads() -> Iterator[Callable[[Callable[[Any], Any], Iterable[Any]], list[Any]]]:
    """Yield `apply(function, items)`, which returns the list of results, computed by several
    threads. Several callers may share it.

    Each thread takes the next item itself. Submitting items of a millisecond one by one to the pool
    would cost a tenth of their work.
    """
    count = min(cpus(), MOST_THREADS)

    def apply(function: Callable[..., Any], items: range) -> list[Any]:
        items = list(items)
        results = [None] * len(items)
        numbers = deque(range(len(items)))

        def work() -> None:
            while True:
                try:
                    number = numbers.popleft()
                except IndexError:
                    return
                results[number] = function(items[number])

        working = [pool.submit(work) for _ in range(min(count, len(items)))]
        try:
            wait(working, return_when=FIRST_EXCEPTION)
        finally:
            numbers.clear()  # no thread goes on after an error or Ctrl-C
        for one in working:
            one.result()
        return results

    with executor(count) as pool:
        yield apply


@contextmanager
def executor(count: int) -> Iterator[ThreadPoolExecutor]:
    """Yield a pool of `count` threads; linear algebra libraries have one thread meanwhile.

    Threads of such a library would keep spinning after their work, in competition with those of the
    pool: kernels with phase took half as many CPU seconds more.
    """
    with _libraries().limit(limits=1, user_api="blas"), ThreadPoolExecutor(count) as pool:
        yield pool


@cache
def _libraries() -> ThreadpoolController:
    """Return the controller of the linear algebra libraries of this process. It is cached, because
    finding them takes milliseconds.
    """
    return ThreadpoolController()

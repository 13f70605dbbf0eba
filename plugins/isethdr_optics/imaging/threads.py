"""Threads: blocks of work on as many threads as are of use, and linear algebra on one."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from contextlib import contextmanager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

MOST_THREADS = 8


def cpus() -> int:
    """Return how many threads to use: OMP_NUM_THREADS where it is set, else the processors at
    hand.
    """
    return int(os.environ.get("OMP_NUM_THREADS") or os.cpu_count() or 1)


@contextmanager
def threads() -> Iterator[Callable[[Callable[[Any], Any], Iterable[Any]], list[Any]]]:
    """Give `apply(function, items)`, which returns a list as `map` would, worked on by several
    threads; several callers may share it.

    Each thread takes one item after the other by itself: to hand out items of a millisecond one by
    one would cost as much as a tenth of their work.
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
            numbers.clear()  # after an error or Ctrl-C nobody goes on
        for one in working:
            one.result()
        return results

    with executor(count) as pool:
        yield apply


@contextmanager
def executor(count: int) -> Iterator[ThreadPoolExecutor]:
    """Give a pool of `count` threads; a linear algebra library has one thread meanwhile.

    Its own threads would go on spinning when they are done, beside those of the pool: kernels with
    phase took half as many CPU seconds more.
    """
    with _libraries().limit(limits=1, user_api="blas"), ThreadPoolExecutor(count) as pool:
        yield pool


@cache
def _libraries() -> ThreadpoolController:
    """Return what controls the linear algebra libraries of this process; to look for them takes
    milliseconds.
    """
    return ThreadpoolController()

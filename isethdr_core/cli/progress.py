"""Progress: the running stage, its time, and the remaining time; on a terminal only.

`for part in track(parts, "rendering"):` inside a component shows a bar. If standard error is no
terminal, nothing is shown or imported. Work of less than two seconds is not shown.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from threading import Lock
from typing import TYPE_CHECKING, Any

from .terminal import console

if TYPE_CHECKING:
    from rich.progress import Progress

SHOWN_AFTER_S = 2.0  # shorter tasks are not shown
_is_hidden = ContextVar("is_hidden", default=False)
_starting = Lock()  # stages of several cameras may begin and end at the same time


@contextmanager
def hidden() -> Iterator[None]:
    """Hide the progress of stages in the block: all jobs of a sweep share one progress line."""
    before = _is_hidden.set(True)
    try:
        yield
    finally:
        _is_hidden.reset(before)


@contextmanager
def shown(title: str, total: float | None = None) -> Iterator[Callable[[], None]]:
    """Show `title` and the seconds it takes while the block runs; yield a function that counts one
    part of `total` as done.
    """
    if _is_hidden.get() or not sys.stderr.isatty():
        yield lambda: None
        return
    display = _display()
    with _starting:
        task = display.add_task(title, total=total)
        if len(display.tasks) == 1:
            display.start()
    try:
        yield lambda: display.advance(task)
    finally:
        with _starting:
            display.remove_task(task)
            if not display.tasks:
                display.stop()


def track(items: Iterable, title: str, total: int | None = None) -> Iterator:
    """Yield `items`, and show the number of finished items and the remaining time.

    Parameters
    ----------
    items : the items to process.
    title : one word or two, for example "rendering".
    total : number of items, if `items` has no length.
    """
    with shown(title, total if total is not None else len(items)) as advance:
        for item in items:
            yield item
            advance()


@cache
def _display() -> Progress:
    """Return the one display of this process: rich draws nested stages and bars below each
    other.
    """
    from rich.progress import (
        BarColumn,
        Progress,
        SpinnerColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    class Late(Progress):
        """Tasks show once they have taken a while, so that quick stages do not flicker."""

        def get_renderables(self) -> Iterator[Any]:
            yield self.make_tasks_table(
                [t for t in self.tasks if (t.elapsed or 0.0) > SHOWN_AFTER_S]
            )

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("remaining"),
        TimeRemainingColumn(),
    )
    return Late(*columns, console=console(stderr=True), transient=True)

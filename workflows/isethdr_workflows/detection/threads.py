"""Threads for the frames and windows of many scenes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from threading import Lock
from typing import TypeVar

from isethdr_optics.imaging.threads import cpus, executor

COMPOSING = Lock()  # Hydra has one global state, so only one thread may compose at a time

One = TypeVar("One")
Made = TypeVar("Made")


def at_once(function: Callable[[One], Made], items: Sequence[One]) -> list[Made]:
    """Return `function` of each item, computed by as many threads as there are processors. Threads
    help because most of the time is spent in operations on large arrays, not in Python code.

    Parameters
    ----------
    function : function of one item.
    items : the items.
    """
    with executor(cpus()) as pool:
        return list(pool.map(function, items))

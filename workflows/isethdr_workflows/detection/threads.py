"""Threads for the frames and windows of many scenes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from threading import Lock
from typing import TypeVar

from isethdr_optics.imaging.threads import executor

from isethdr_core.pipeline.chain import Chain
from isethdr_core.pipeline.chain.side_by_side import threads_for

COMPOSING = Lock()  # Hydra has one global state, so only one thread may compose at a time

One = TypeVar("One")
Made = TypeVar("Made")


def at_once(
    function: Callable[[One], Made], items: Sequence[One], threads: int | None = None
) -> list[Made]:
    """Return `function` of each item, computed by several threads. Threads help because most of the
    time is spent in operations on large arrays, not in Python code.

    Parameters
    ----------
    function : function of one item.
    items : the items.
    threads : number of threads; None: as many as this process has processors.
    """
    with executor(threads or threads_for(())) as pool:
        return list(pool.map(function, items))


def threads_of(built: Chain, rendering: bool = False) -> int:
    """Return how many threads may work with such components, each thread on a scene of its own.

    It is one if any of the components does not declare `THREAD_SAFE` (docs/how-to/plugins.md).

    Parameters
    ----------
    built : components of a scene.
    rendering : whether the threads also build and render scenes.
    """
    called: list[object] = [*built.cameras.values(), built.isp, *built.metrics.values()]
    called += [built.lighting, built.lens, *built.flares.values()]
    if rendering:
        called += [built.scene, built.renderer]
    return threads_for(called)

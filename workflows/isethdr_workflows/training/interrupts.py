"""Ctrl-C during a training. It takes effect between two steps, so that the stored state is never
that of half a step.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def between_steps() -> Iterator[Callable[[], None]]:
    """Delay Ctrl-C within the block. Yield a function that raises KeyboardInterrupt if Ctrl-C was
    typed; call it after each step.

    Only the main thread of a process handles signals. In other threads nothing is delayed. A
    process in the background that ignores Ctrl-C goes on ignoring it.
    """
    typed = threading.Event()

    def stop_if_typed() -> None:
        if typed.is_set():
            raise KeyboardInterrupt

    ignored = signal.getsignal(signal.SIGINT) == signal.SIG_IGN
    if ignored or threading.current_thread() is not threading.main_thread():
        yield stop_if_typed
        return
    before = signal.signal(signal.SIGINT, lambda *_: typed.set())
    try:
        yield stop_if_typed
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)

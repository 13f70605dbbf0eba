"""Interrupts: Ctrl-C and SIGTERM end a run, also where native code hides the exception that they
raise.

Mitsuba and Dr.Jit call Python from native code, and turn every exception there into a RuntimeError.
A sweep or a dataset would take this for a failed job, and go on with the next one.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def interrupts_kept() -> Iterator[None]:
    """Run a block, and raise again what the handler of a signal raised in it if another exception
    comes out of the block.

    Signals reach the main thread only; in other threads the block runs unchanged.

    Raises
    ------
    KeyboardInterrupt, SystemExit : as the handler of the signal raises it.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    raised: list[BaseException] = []
    # a signal that is ignored, or ends the process at once, has no handler in Python
    handlers = {s: h for s in SIGNALS if callable(h := signal.getsignal(s))}

    def noted(number: int, frame: FrameType | None) -> Any:
        try:
            return handlers[signal.Signals(number)](number, frame)
        except BaseException as err:
            raised.append(err)
            raise

    for number in handlers:
        signal.signal(number, noted)
    try:
        yield
    except Exception as err:
        if raised:
            raise raised[0] from err
        raise
    finally:
        for number, handler in handlers.items():
            if signal.getsignal(number) is noted:  # the block may have set another one
                signal.signal(number, handler)

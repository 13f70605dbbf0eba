"""Fixtures of the tests of trainings."""

from __future__ import annotations

import signal

import pytest


@pytest.fixture
def interrupts():
    """Ctrl-C as in a process in the foreground; tests may run in one that ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)

"""Ctrl-C and SIGTERM end a stage, also if the component turns their exception into another one."""

from __future__ import annotations

import signal
import sys

import pytest

from isethdr_core.pipeline.chain import stage
from isethdr_core.runs.parent_watch import exit_on_sigterm
from isethdr_core.uncertainty.ledger import Ledger


@pytest.fixture
def handlers():
    """Restore the handlers of both signals after a test."""
    before = {s: signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    exit_on_sigterm()
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def hidden(number: signal.Signals):
    """Raise a signal and report its exception as native code does."""
    try:
        signal.raise_signal(number)
    except BaseException as err:
        raise RuntimeError("failed to instantiate a plugin") from err


@pytest.mark.parametrize(
    ("number", "raised"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, SystemExit)]
)
def test_a_signal_that_a_component_hides_ends_the_stage(handlers, number, raised):
    handler = signal.getsignal(number)
    with pytest.raises(raised):
        stage(Ledger(), "renderer", "x", None, lambda: hidden(number))
    assert signal.getsignal(number) is handler


def test_an_error_without_a_signal_stays_as_it_is(handlers):
    with pytest.raises(ZeroDivisionError):
        stage(Ledger(), "renderer", "x", None, lambda: 1 / 0)
    with pytest.raises(SystemExit):
        stage(Ledger(), "renderer", "x", None, sys.exit)


def test_a_handler_that_returns_is_called_once(handlers):
    calls = []
    signal.signal(signal.SIGTERM, lambda number, _: calls.append(number))

    def fails():
        signal.raise_signal(signal.SIGTERM)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        stage(Ledger(), "renderer", "x", None, fails)
    assert calls == [signal.SIGTERM]


def test_a_handler_that_a_component_sets_stays(handlers):
    own = lambda number, _: None
    stage(Ledger(), "renderer", "x", None, lambda: signal.signal(signal.SIGTERM, own))
    assert signal.getsignal(signal.SIGTERM) is own

"""Stages: one step of a run, with the hooks of plugins around it and its row in the ledger."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from types import CodeType, FunctionType, MethodType
from typing import Any

from ...cli import progress
from ...plugins.component import Stage
from ...plugins.registry import plugin_manager
from ...runs.reuse import NOT_KEPT, Kept
from ...uncertainty import ledger
from ...uncertainty.ledger import Ledger
from .interrupts import interrupts_kept
from .side_by_side import end_if_unwanted


def stage(
    rows: Ledger,
    kind: str,
    name: str,
    component: Any | None,
    call: Callable[..., Any],
    kept: Kept = NOT_KEPT,
) -> Any:
    """Run `call()` as one stage, and return its result.

    Parameters
    ----------
    rows : ledger that gets the row of the stage.
    kind : kind of the component, for example `lens`.
    name : name of the stage after its kind; it may be empty.
    component : component that the hooks receive; None if the stage has none.
    call : function without arguments that computes the result.
    kept : place of a result of an earlier run. If there is one, it replaces the call, and its row
        replaces the row of this stage.
    """
    end_if_unwanted()
    hook = plugin_manager().hook
    at_work = Stage(kind, name, component)
    title = f"{kind} {name}" if name else kind
    _call_hook(hook.isethdr_before_stage, at_work, title)
    try:
        with interrupts_kept(), ledger.stage(rows, title) as at_work.row, progress.shown(title):
            earlier = kept.reuse.earlier(kept.name)
            start_s = ledger.cpu_s()
            if earlier is None:
                at_work.result = call()
            else:
                ledger.record_row(earlier.row)
                at_work.result = earlier.result
        if earlier is None:
            spent_s = ledger.cpu_s() - start_s
            kept.reuse.keep(kept.name, at_work.result, at_work.row, spent_s)
        else:
            at_work.row.seconds = earlier.row.seconds
            at_work.row.cpu_s = earlier.row.cpu_s
            at_work.row.reused = True
            at_work.row.peak_bytes = earlier.row.peak_bytes
    except BaseException as err:
        at_work.error = err
        err.add_note(f"in stage {title}")
        hook.isethdr_on_stage_error(stage=at_work)
        raise
    _call_hook(hook.isethdr_after_stage, at_work, title)
    return at_work.result


def _call_hook(hook: Any, at_work: Stage, title: str) -> None:
    """Call a hook of all plugins. An error of one gets a note with the plugin, hook and stage."""
    try:
        hook(stage=at_work)
    except Exception as err:
        codes = {frame.f_code for frame, _ in traceback.walk_tb(err.__traceback__)}
        for impl in hook.get_hookimpls():
            if _code_of(impl.function) in codes:
                err.add_note(f"in {hook.name} of plugin {impl.plugin_name!r}, at stage {title}")
        raise


def _code_of(function: object) -> CodeType | None:
    """Return the code of a function or method, which is that of its frames."""
    plain = function.__func__ if isinstance(function, MethodType) else function
    return plain.__code__ if isinstance(plain, FunctionType) else None

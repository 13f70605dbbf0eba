"""Derived once: what follows from light, reference picture and labels alone, for all realisations.

A run asks sensor and metrics again and again: in every noise realisation, and after changes of the
scene. Light, reference picture and labels mostly stay the same objects. Within `shared(...)` what
depends on these alone is computed once. Outside of it, everything is computed on each call.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, TypeVar

T = TypeVar("T")


@dataclass
class _Scope:
    """Results that were derived from `sources`, which must not change meanwhile."""

    sources: tuple[Any, ...]
    results: dict[Hashable, Any] = field(default_factory=dict)


_scope: ContextVar[_Scope | None] = ContextVar("isethdr_derived_once", default=None)
_values_only: ContextVar[bool] = ContextVar("isethdr_values_only", default=False)


@contextmanager
def shared(*sources: Any) -> Iterator[None]:
    """Keep what `once` derives from these objects until the end of the block.

    Parameters
    ----------
    sources : objects that nobody changes within the block, such as a reference picture. A block
        within another knows the objects and results of that one too.
    """
    around = _scope.get() or _Scope(())
    token = _scope.set(_Scope((*around.sources, *sources), dict(around.results)))
    try:
        yield
    finally:
        _scope.reset(token)


def once(key: Hashable, sources: tuple[Any, ...], compute: Callable[[], T]) -> T:
    """Return `compute()`, or what it returned before for the same key and the same objects.

    Parameters
    ----------
    key : names the computation and all its parameters. One without a hash is never found again.
    sources : the objects that the result depends on, compared by identity; None depends on nothing.
    compute : function without arguments that states nothing in the ledger. Nobody may change what
        it returns.
    """
    scope = _scope.get()
    if scope is None:
        return compute()
    if any(s is not None and all(s is not known for known in scope.sources) for s in sources):
        return compute()
    whole = key, tuple(map(id, sources))
    try:
        hash(whole)
    except TypeError:  # a parameter that cannot be compared, such as an array
        return compute()
    if whole not in scope.results:
        scope.results[whole] = compute()
    return scope.results[whole]


@contextmanager
def values_only() -> Iterator[None]:
    """Tell metrics that nobody reads the intervals of their scores within the block."""
    token = _values_only.set(True)
    try:
        yield
    finally:
        _values_only.reset(token)


def intervals_wanted() -> bool:
    """Return whether anybody reads the intervals of a metric's scores; else they may be NaN."""
    return not _values_only.get()

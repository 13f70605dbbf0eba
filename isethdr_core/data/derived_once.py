"""Derived once: results that depend only on light, reference picture and labels, kept for all noise
realisations.

A run calls sensor and metrics many times: for every noise realisation, and after changes of the
scene. Light, reference picture and labels mostly stay the same objects. Within `shared(...)`,
results that depend on them alone are computed once. Outside such a block, everything is computed on
each call. Several threads may work within one block.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    import xarray as xr

T = TypeVar("T")


@dataclass
class _Scope:
    """Results that were derived from `sources`, which must not change meanwhile."""

    sources: tuple[Any, ...]
    results: dict[Hashable, Any] = field(default_factory=dict)
    # lock of each result: a second thread waits while the first computes the result
    locks: dict[Hashable, Lock] = field(default_factory=dict)

    def knows(self, source: Any) -> bool:
        """Return whether this object cannot change: it is a source, or a kept result."""
        return any(source is known for known in (*self.sources, *tuple(self.results.values())))


_scope: ContextVar[_Scope | None] = ContextVar("isethdr_derived_once", default=None)
_values_only: ContextVar[bool] = ContextVar("isethdr_values_only", default=False)


@contextmanager
def shared(*sources: Any) -> Iterator[None]:
    """Keep the results of `once` for these objects until the end of the block.

    Parameters
    ----------
    sources : objects that do not change within the block, such as a reference picture. A nested
        block also uses the objects and results of the outer one.
    """
    around = _scope.get() or _Scope(())
    token = _scope.set(_Scope((*around.sources, *sources), dict(around.results)))
    try:
        yield
    finally:
        _scope.reset(token)


def once(key: Hashable, sources: tuple[Any, ...], compute: Callable[[], T]) -> T:
    """Return `compute()`, or its earlier result for the same key and the same objects.

    Parameters
    ----------
    key : names the computation and all its parameters. If it cannot be hashed, nothing is kept.
    sources : the objects that the result depends on, compared by identity. Each must be a source of
        `shared`, an earlier result or None; otherwise nothing is kept.
    compute : function without arguments that states nothing in the ledger. Its result must not be
        changed.
    """
    scope = _scope.get()
    if scope is None:
        return compute()
    if any(s is not None and not scope.knows(s) for s in sources):
        return compute()
    full_key = key, tuple(map(id, sources))
    try:
        hash(full_key)
    except TypeError:  # a parameter without a hash, such as an array
        return compute()
    with scope.locks.setdefault(full_key, Lock()):
        if full_key not in scope.results:
            scope.results[full_key] = compute()
        return scope.results[full_key]


def read_only(data: xr.Dataset) -> xr.Dataset:
    """Return a Dataset of the same arrays, whose values cannot be changed in place through it.

    It is `data` itself if its values cannot be changed already.

    A metric that writes into the arrays of its picture then fails. Variables and attributes of the
    Dataset can still be replaced, which changes no other Dataset.
    """
    locked = {}
    for name, array in data.data_vars.items():
        values = array.values
        if values.flags.writeable:
            view = values.view()
            view.flags.writeable = False
            locked[name] = array.copy(deep=False, data=view)
    return data.assign(locked) if locked else data


@contextmanager
def values_only() -> Iterator[None]:
    """Tell metrics that the intervals of their scores are not used within the block."""
    token = _values_only.set(True)
    try:
        yield
    finally:
        _values_only.reset(token)


@contextmanager
def with_intervals() -> Iterator[None]:
    """Tell metrics that the intervals of their scores are used within the block, as they are
    outside of `values_only`.
    """
    token = _values_only.set(False)
    try:
        yield
    finally:
        _values_only.reset(token)


def intervals_wanted() -> bool:
    """Return whether the intervals of a metric's scores are used; otherwise they may be NaN."""
    return not _values_only.get()

"""Check a component's class against the Protocols of its kind, when its plugin is loaded.

The core would never call a method whose name is misspelt, and would fail late in a run on one that
takes other parameters. Both are refused here, with the right name and parameters.
"""

from __future__ import annotations

import dataclasses
import difflib
import inspect
from functools import cache, cached_property
from typing import Any, NamedTuple

from ..errors import PluginError, did_you_mean
from .accuracy_knobs import check_knobs, check_shares
from .protocols import NamesItsEffort
from .protocols.by_kind import OPTIONAL, abilities_of, required_of

# difflib ratio from which two names resemble each other: that of two swapped letters in a word of
# five; bundled methods reach 0.76
NEAR = 0.8
CALL = "__call__"


class Arguments(NamedTuple):
    """One way in which the core passes arguments: a number of them by position, and these
    by name.
    """

    by_position: int
    by_name: tuple[str, ...]


class Vocabulary(NamedTuple):
    """The names that the core uses of components of a kind, {name: Protocol}."""

    callables: dict[str, type]
    constants: dict[str, type]
    any_kind: frozenset[str]  # every name that the core uses of any kind; these are not misspelt


def check(kind: str, name: str, cls: type) -> None:
    """Refuse a class that lacks a required method of its kind, or has an ability that cannot be
    used.

    Parameters
    ----------
    kind, name : name under which the class is offered.
    cls : the class.

    Raises
    ------
    PluginError : a required method is missing, a method has the wrong parameters, or a public name
        resembles that of an ability. The message holds the right name and parameters.
    """
    subject = f"{kind}/{name}"
    for protocol in required_of(kind):
        _check_required(subject, kind, protocol, cls)
    for protocol in abilities_of(kind):
        _check_offered(subject, protocol, cls)
    if offers(cls, "accuracy_knobs"):
        check_knobs(subject, kind, _raw(cls, "accuracy_knobs"), _defaults(cls))
    if offers(cls, "error_shares"):
        check_shares(subject, kind, _raw(cls, "error_shares"))
    _check_spelling(subject, kind, cls)


@cache
def methods(protocol: type) -> dict[str, inspect.Signature]:
    """Return {name: signature without self} of the methods of a Protocol."""
    return {
        name: _without_self(inspect.signature(member))
        for name, member in vars(protocol).items()
        if inspect.isfunction(member) and (name == CALL or not name.startswith("_"))
    }


@cache
def constants(protocol: type) -> frozenset[str]:
    """Return the names of a Protocol's members that are class attributes."""
    return frozenset(vars(protocol).get("__annotations__", {}))


@cache
def fields(protocol: type) -> frozenset[str]:
    """Return the names of a Protocol's members that may be fields of a component."""
    return frozenset(n for n, member in vars(protocol).items() if isinstance(member, property))


@cache
def names(kind: str) -> frozenset[str]:
    """Return every name that the core uses of a component of a kind."""
    protocols_of_kind = (*required_of(kind), *abilities_of(kind))
    return frozenset(
        name for p in protocols_of_kind for name in (*methods(p), *constants(p), *fields(p))
    )


def written(name: str, protocol: type) -> str:
    """Return the signature of a Protocol's method as text: its name, parameters and types."""
    return f"{name}{methods(protocol)[name]}".replace("'", "")


def _check_required(subject: str, kind: str, protocol: type, cls: type) -> None:
    """Check the methods of a kind. Only a missing call is refused: no run needs the others."""
    for name in methods(protocol):
        called = _called_as(kind, protocol, cls) if name == CALL else protocol
        if offers(cls, name):
            _check_method(subject, called, name, cls)
        elif name == CALL:
            raise PluginError(
                f"{subject}: {cls.__qualname__} cannot be called; expected the method "
                f"{written(name, called)} ({called.__name__})"
            )


def _called_as(kind: str, protocol: type, cls: type) -> type:
    """Return the Protocol of a class's call: an ability that changes the call, or its kind."""
    for ability in abilities_of(kind):
        other_methods = [name for name in methods(ability) if name != CALL]
        if CALL in methods(ability) and all(offers(cls, name) for name in other_methods):
            return ability
    return protocol


def _check_offered(subject: str, protocol: type, cls: type) -> None:
    for name in methods(protocol):
        if name != CALL and offers(cls, name):
            _check_method(subject, protocol, name, cls)
    if protocol is NamesItsEffort and offers(cls, "effort_fields"):
        _check_effort(subject, cls)


def _check_effort(subject: str, cls: type) -> None:
    fields = _fields(cls)
    for name in _raw(cls, "effort_fields") or ():
        if name not in fields:
            raise PluginError(
                f"{subject}: effort_fields names {name!r}, which is no field"
                f"{did_you_mean(name, fields)}"
            )


def _check_method(subject: str, protocol: type, name: str, cls: type) -> None:
    raw = _raw(cls, name)
    if name in _fields(cls):
        found_kind = "a field"
    elif isinstance(raw, property | cached_property):
        found_kind = "a property"
    else:
        found_kind = "" if _callable(raw) else f"{raw!r}"
    if found_kind:
        raise PluginError(
            f"{subject}: {name!r} is {found_kind}; expected the method {written(name, protocol)} "
            f"({protocol.__name__})"
        )
    if problem := _problem(raw, protocol, name):
        raise PluginError(
            f"{subject}: method {name}{_own_signature(raw)} cannot be called as "
            f"{written(name, protocol)} ({protocol.__name__}): {problem}"
        )


def _check_spelling(subject: str, kind: str, cls: type) -> None:
    words = _vocabulary(kind)
    for name in _public(cls):
        if name not in words.any_kind:
            candidates = words.callables if _callable(_raw(cls, name)) else words.constants
            _refuse_near(subject, name, cls, candidates)


@cache
def _vocabulary(kind: str) -> Vocabulary:
    protocols_of_kind = (*required_of(kind), *abilities_of(kind))
    return Vocabulary(
        {name: p for p in protocols_of_kind for name in methods(p) if name != CALL},
        {name: p for p in protocols_of_kind for name in constants(p)},
        frozenset().union(*map(names, OPTIONAL)),
    )


def _refuse_near(subject: str, name: str, cls: type, candidates: dict[str, type]) -> None:
    """Refuse a public name that resembles one of `candidates` {name: Protocol}.

    The name is accepted if the class also has the correctly spelt member, or if the name belongs to
    a method that the core could not call in its place.
    """
    near = _nearest(name, tuple(candidates))
    if near is None or offers(cls, near):
        return
    protocol = candidates[near]
    raw = _raw(cls, name)
    if near in methods(protocol):
        if _problem(raw, protocol, near):
            return
        right = written(near, protocol)
        member = "method"
    else:
        right = near
        member = "class attribute"
    raise PluginError(
        f"{subject}: unknown {member} {name!r}; did you mean {right} ({protocol.__name__})? "
        f"A {member} of your own needs a name that begins with an underscore"
    )


@cache
def _nearest(name: str, candidates: tuple[str, ...]) -> str | None:
    """Return the candidate that a name resembles most, whatever the case of both; None if none."""
    in_lower_case = {candidate.lower(): candidate for candidate in candidates}
    near = difflib.get_close_matches(name.lower(), in_lower_case, 1, NEAR)
    return in_lower_case[near[0]] if near else None


def offers(cls: type, name: str) -> bool:
    """Return whether a class has a field, method or attribute that is not set to None."""
    return name in _fields(cls) or _raw(cls, name) is not None


@cache
def _fields(cls: type) -> frozenset[str]:
    fields = dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ()
    return frozenset(f.name for f in fields)


def _defaults(cls: type) -> dict[str, Any]:
    """Return {field: default} of the fields that users set; `MISSING` where a function makes it."""
    fields = dataclasses.fields(cls) if dataclasses.is_dataclass(cls) else ()
    return {f.name: f.default for f in fields if f.init}


@cache
def _members(cls: type) -> dict[str, Any]:
    """Return {name: attribute} of a class and its bases, without calling any descriptor."""
    return {name: raw for base in reversed(cls.__mro__) for name, raw in vars(base).items()}


def _raw(cls: type, name: str) -> Any:
    return _members(cls).get(name)


def _public(cls: type) -> list[str]:
    """Return the public names of a class and its bases that are no fields."""
    return [n for n in _members(cls) if not n.startswith("_") and n not in _fields(cls)]


def _callable(raw: Any) -> bool:
    return callable(raw) or isinstance(raw, staticmethod | classmethod)


def _function(raw: Any) -> Any:
    return raw.__func__ if isinstance(raw, staticmethod | classmethod) else raw


def _own_signature(raw: Any) -> str:
    return str(inspect.signature(_function(raw))).replace("'", "")


def _problem(raw: Any, protocol: type, name: str) -> str:
    """Return the reason why a method cannot be called as its Protocol requires; empty if it can."""
    if inspect.isfunction(raw):
        return _problem_of(raw, True, protocol, name)
    return _problem_of.__wrapped__(_function(raw), isinstance(raw, classmethod), protocol, name)


@cache
def _problem_of(function: Any, bound: bool, protocol: type, name: str) -> str:
    """Return the reason as `_problem` does. A function that is `bound` gets the component or its
    class as the first argument.
    """
    try:
        signature = inspect.signature(function)
    except (ValueError, TypeError):  # a compiled function without a readable signature
        return ""
    for arguments in _calls(protocol, name):
        by_position = [None] * (bound + arguments.by_position)
        try:
            signature.bind(*by_position, **dict.fromkeys(arguments.by_name))
        except TypeError as err:
            return str(err)
    return ""


@cache
def _calls(protocol: type, name: str) -> tuple[Arguments, ...]:
    """Return the ways of a call: all arguments or the required ones, by position or by name."""
    every = tuple(methods(protocol)[name].parameters.values())
    required = tuple(p for p in every if p.default is p.empty)
    calls = []
    for some in (every, required):
        positional = [p.name for p in some if p.kind is p.POSITIONAL_OR_KEYWORD]
        first = sum(p.kind is p.POSITIONAL_ONLY for p in some)
        named = tuple(p.name for p in some if p.kind is p.KEYWORD_ONLY)
        calls += [
            Arguments(first + len(positional), named),
            Arguments(first, (*positional, *named)),
        ]
    return tuple(dict.fromkeys(calls))


def _without_self(signature: inspect.Signature) -> inspect.Signature:
    return signature.replace(parameters=list(signature.parameters.values())[1:])

"""Spending: what the components of one chain declare that they spend the error allowed on, and
their shares, put into the fields that take them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, TypeVar, cast

from ..data.error_costs import Cost
from ..plugins.accuracy_knobs import ErrorShare, knobs_of, shares_of
from .budget import Division, Spending, division

SINGLE = ("lighting", "lens")  # fields of a chain that hold one component
TABLES = {"flare": "flares", "sensor": "cameras"}  # {kind: field that holds components by name}
Parts = TypeVar("Parts")


def of_chain(parts: Any) -> list[Spending]:
    """Return what the components of a chain spend the error allowed on.

    A budgeted field that holds a number of the user's own is outside the budget: it neither takes a
    share nor leaves one.

    Parameters
    ----------
    parts : `isethdr_core.pipeline.chain.Chain`, before `told`.
    """
    found = []
    for kind, name, component in _components(parts):
        who = f"{kind} {name}".strip()
        found += [Spending(kind, who, share) for share in shares_of(component)]
        found += [
            Spending(kind, who, ErrorShare(knob.field, knob.cost), knob.field)
            for knob in knobs_of(component)
            if knob.budgeted
            and isinstance(knob.cost, Cost)
            and getattr(component, knob.field) is None
        ]
    return found


def told(parts: Parts, relative: Callable[[], float]) -> Parts:
    """Return a chain that knows its division, with the shares in the fields that take them.

    Parameters
    ----------
    parts : `isethdr_core.pipeline.chain.Chain`.
    relative : function() -> the relative error that is allowed in all; 0 where light is asked for
        exactly, and no field is set. Called where a field takes a share.
    """
    shares = division(of_chain(parts))
    chain: Any = replace(parts, shares=shares)  # type: ignore[type-var]
    allowed = relative() if shares.told else 0.0
    if not allowed:
        return cast(Parts, chain)
    for kind in SINGLE:
        component = _told(getattr(chain, kind), kind, shares, allowed)
        chain = replace(chain, **{kind: component})
    for kind, table in TABLES.items():
        components = {
            name: _told(component, f"{kind} {name}", shares, allowed)
            for name, component in getattr(chain, table).items()
        }
        chain = replace(chain, **{table: components})
    return cast(Parts, chain)


def _components(parts: Any) -> Iterator[tuple[str, str, Any]]:
    """Yield (kind, name in its table, component) of all whose errors reach the electrons."""
    for kind in SINGLE:
        yield kind, "", getattr(parts, kind)
    for kind, table in TABLES.items():
        for name, component in getattr(parts, table).items():
            yield kind, name, component


def _told(component: Any, who: str, shares: Division, allowed: float) -> Any:
    fields = {name: share * allowed for (one, name), share in shares.told.items() if one == who}
    return replace(component, **fields) if fields else component

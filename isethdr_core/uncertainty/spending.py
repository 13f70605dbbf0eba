"""Spending: the errors for which the components of a chain need a share of the error allowed, and
the fields in which they receive their shares.
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
    """Return the errors for which the components of a chain need a share of the error allowed.

    A budgeted field with a value set by the user takes no share.

    Parameters
    ----------
    parts : `isethdr_core.pipeline.chain.Chain`, before `with_shares`.
    """
    spendings = []
    for kind, name, component in _components(parts):
        who = f"{kind} {name}".strip()
        spendings += [Spending(kind, who, share) for share in shares_of(component)]
        spendings += [
            Spending(kind, who, ErrorShare(knob.field, knob.cost), knob.field)
            for knob in knobs_of(component)
            if knob.budgeted
            and isinstance(knob.cost, Cost)
            and getattr(component, knob.field) is None
        ]
    return spendings


def with_shares(parts: Parts, relative: Callable[[], float]) -> Parts:
    """Return the chain with the division of its error budget, and the shares in its fields.

    Parameters
    ----------
    parts : `isethdr_core.pipeline.chain.Chain`.
    relative : function() -> the total relative error allowed. 0 means that light is computed
        exactly; no field is then set. It is called only if a field takes a share.
    """
    shares = division(of_chain(parts))
    chain: Any = replace(cast(Any, parts), shares=shares)
    allowed = relative() if shares.by_field else 0.0
    if not allowed:
        return cast(Parts, chain)
    for kind in SINGLE:
        component = _with_shares(getattr(chain, kind), kind, shares, allowed)
        chain = replace(chain, **{kind: component})
    for kind, table in TABLES.items():
        components = {
            name: _with_shares(component, f"{kind} {name}", shares, allowed)
            for name, component in getattr(chain, table).items()
        }
        chain = replace(chain, **{table: components})
    return cast(Parts, chain)


def _components(parts: Any) -> Iterator[tuple[str, str, Any]]:
    """Yield (kind, name in its table, component) of the components that change the electrons."""
    for kind in SINGLE:
        yield kind, "", getattr(parts, kind)
    for kind, table in TABLES.items():
        for name, component in getattr(parts, table).items():
            yield kind, name, component


def _with_shares(component: Any, who: str, shares: Division, allowed: float) -> Any:
    fields = {
        name: share * allowed
        for (field_owner, name), share in shares.by_field.items()
        if field_owner == who
    }
    return replace(component, **fields) if fields else component

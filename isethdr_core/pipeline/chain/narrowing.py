"""Narrowing: the demand that remains after a component, and the union of several demands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ...errors import PluginError
from ...plugins.protocols import NarrowsDemand
from .. import window
from ..demand import Demand, Response


def narrowed(component: Any, demand: Demand) -> Demand:
    """Return the demand as the component narrows it, or unchanged.

    Raises
    ------
    PluginError : the component returns no demand.
    """
    if not isinstance(component, NarrowsDemand):
        return demand
    less = component.narrow(demand)
    if not isinstance(less, Demand):
        raise PluginError(
            f"{type(component).__name__}.narrow(demand) returned {less!r}; expected a Demand; type"
            " `return demand` where nothing is dropped"
        )
    return less


def union(demands: Sequence[Demand]) -> Demand:
    """Return the smallest demand that covers all of `demands`, at least one."""
    covering, *others = demands
    for other in others:
        covering = union_of_two(covering, other)
    return covering


def union_of_two(one: Demand, other: Demand) -> Demand:
    """Return the smallest demand that covers two. None for groups or bands means all of them."""
    groups = None
    if one.groups is not None and other.groups is not None:
        groups = tuple(dict.fromkeys(one.groups + other.groups))
    wavelength_nm = None
    if one.wavelength_nm is not None and other.wavelength_nm is not None:
        wavelength_nm = tuple(sorted(set(one.wavelength_nm) | set(other.wavelength_nm)))
    return replace(
        one,
        groups=groups,
        wavelength_nm=wavelength_nm,
        labels=one.labels | other.labels,
        error_allowed=min(one.error_allowed, other.error_allowed),
        stored_error_allowed=min(one.stored_error_allowed, other.stored_error_allowed),
        response=response_of_both(one.response, other.response),
        margin=one.margin or other.margin,
        window_m=window.wider(one.window_m, other.window_m),
    )


def response_of_both(one: Response | None, other: Response | None) -> Response | None:
    """Return the response of two sensors; None if one of them needs light wavelength by
    wavelength.
    """
    if one is other:
        return one
    if one is None or other is None:
        return None
    return one + other

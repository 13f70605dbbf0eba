"""Imaging plan: how a lens makes the light of one field, decided once, with what that leaves out
and its errors.

A lens with a method `plan` (`PlansImaging`) decides which tiles, bands, kernels, wings and ghosts
sensors can tell. Any other lens gets a `TrivialPlan`, which leaves nothing out.
"""

from __future__ import annotations

from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any, TypeGuard

from ..plugins.protocols import ImagingPlan, MakesPhotocurrent, PlansImaging, StatesErrors
from ..uncertainty import ledger
from ..uncertainty.earlier_terms import maps_of
from ..uncertainty.error_terms import ErrorMaps, ErrorTerm
from ..uncertainty.ledger import LeftOut
from .demand import Response

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr


@dataclass(frozen=True)
class LightBudget:
    """What of the light on the image plane is needed, and how wrong it may be."""

    error_allowed: float = 0.0  # relative, of every tile; 0 asks for the exact way
    window_m: tuple[float, float] | None = None  # (width, height) that sensors see; None: all
    sensed_nm: tuple[float, ...] | None = None  # bands that sensors see; None: all


def plans_imaging(lens: Any) -> TypeGuard[PlansImaging]:
    """Return whether a lens makes plans of its own light.

    A subclass that overrides how light is made (`__call__`, `photocurrent` or `spread_errors`), but
    not `plan`, makes other light than the plan that it inherits.
    """
    if not isinstance(lens, PlansImaging):
        return False
    classes = type(lens).__mro__

    def defined(name: str) -> int:
        return next((k for k, one in enumerate(classes) if name in vars(one)), len(classes))

    makes_light = ("__call__", "photocurrent", "spread_errors")
    return defined("plan") <= min(map(defined, makes_light))


@dataclass(frozen=True, eq=False)
class TrivialPlan:
    """The plan of a lens that makes none: all light of all tiles and bands."""

    lens: Any
    flares: tuple = ()
    response: Response | None = None
    error_allowed: float = 0.0
    terms: tuple[ErrorTerm, ...] = ()
    left_out: tuple[LeftOut, ...] = ()

    def image(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return what the lens makes of mixed radiance."""
        if self.response is not None and isinstance(self.lens, MakesPhotocurrent):
            return self.lens.photocurrent(mixed, self.flares, self.response)
        known = {}
        if self.error_allowed and "error_allowed" in signature(self.lens.__call__).parameters:
            known = {"error_allowed": self.error_allowed}
        return self.lens(mixed, flares=self.flares, **known)

    def light_errors(self, mixed: xr.DataArray, weights: np.ndarray) -> ErrorMaps | None:
        """Return what the lens knows of its errors; None where it does not say."""
        if not isinstance(self.lens, StatesErrors):
            return None
        return maps_of(self.lens.spread_errors(mixed, self.flares, weights, self.response))


def imaged(plan: ImagingPlan, mixed: xr.DataArray) -> xr.DataArray:
    """Return the light that a plan makes; what the plan leaves out, and its errors, are stated in
    the ledger.
    """
    ledger.record(*plan.terms)
    ledger.record_kept(ledger.Kept(plan, tuple(plan.left_out)))
    return plan.image(mixed)

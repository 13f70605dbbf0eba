"""Imaging plan: how a lens makes the light of one field, decided once, with what that leaves out
and its errors.

A lens with a method `plan` (`PlansImaging`) decides what of the field, and of its own effects,
sensors can tell. It may tell beforehand what its plan will need (`OutlinesImaging`), so that no
light is rendered in vain. Any other lens gets a `TrivialPlan`, which leaves nothing out, and an
outline that says the same.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from inspect import signature
from typing import TYPE_CHECKING, Any, TypeGuard

from ..plugins.protocols import (
    ImagingPlan,
    KeepsLight,
    MakesPhotocurrent,
    OutlinesImaging,
    PlansImaging,
    StatesErrors,
)
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


@dataclass(frozen=True)
class FieldAhead:
    """What is known of a field before there is any light of it; None: not known."""

    size: tuple[float, float, str] | None = None  # (width, height, projection) of the camera's
    bands_nm: tuple[float, ...] | None = None  # centres of all bands that the light will have


@dataclass(frozen=True)
class ImagingOutline:
    """What a plan will need and leave out, known before there is any light."""

    margin: bool = True  # light of tiles beyond the camera's field, which may get into it
    left_out: tuple[LeftOut, ...] = ()


def plans_imaging(lens: Any) -> TypeGuard[PlansImaging]:
    """Return whether a lens makes plans of its own light.

    A subclass that overrides how light is made (`__call__`, `photocurrent` or `spread_errors`), but
    not `plan`, makes other light than the plan that it inherits.
    """
    return isinstance(lens, PlansImaging) and _tells_of_its_own_light(lens, "plan")


def _tells_of_its_own_light(lens: Any, method: str) -> bool:
    """Return whether a method of a lens knows the light that the lens makes: no subclass of the
    class that defines it makes other light.
    """
    classes = type(lens).__mro__

    def defined(name: str) -> int:
        return next((k for k, base in enumerate(classes) if name in vars(base)), len(classes))

    makes_light = ("__call__", "photocurrent", "spread_errors")
    return defined(method) <= min(map(defined, makes_light))


@dataclass(frozen=True, eq=False)
class TrivialPlan:
    """The plan of a lens that makes none: all light of all tiles and bands."""

    lens: Any
    flares: tuple[Any, ...] = ()
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
        light: xr.DataArray = self.lens(mixed, flares=self.flares, **known)
        return light

    def light_errors(self, mixed: xr.DataArray, weights: np.ndarray) -> ErrorMaps | None:
        """Return what the lens knows of its errors; None where it does not say."""
        if not isinstance(self.lens, StatesErrors):
            return None
        return maps_of(self.lens.spread_errors(mixed, self.flares, weights, self.response))


def outlined(
    lens: Any, flares: Sequence[Any], ahead: FieldAhead, budget: LightBudget
) -> ImagingOutline:
    """Return what the plan of a lens will need, as the lens says; everything where it says
    nothing.
    """
    if plans_imaging(lens) and isinstance(lens, OutlinesImaging):
        return lens.outline(flares, ahead, budget)
    in_place = (
        isinstance(lens, KeepsLight)
        and _tells_of_its_own_light(lens, "keeps_light")
        and lens.keeps_light(flares)
    )
    return ImagingOutline(margin=not in_place)


def imaged(plan: ImagingPlan, mixed: xr.DataArray) -> xr.DataArray:
    """Return the light that a plan makes; what the plan leaves out, and its errors, are stated in
    the ledger.
    """
    ledger.record(*plan.terms)
    ledger.record_left_out(*plan.left_out)
    return plan.image(mixed)


@dataclass(eq=False)
class Imaging:
    """How the light on the sensor plane is made of mixed radiance: planned once, when the plan is
    first asked for.
    """

    mixed: xr.DataArray
    make_plan: Callable[[], ImagingPlan]

    @cached_property
    def plan(self) -> ImagingPlan:
        """The plan of the lens: it makes the light, and knows the errors of it."""
        return self.make_plan()

    def light(self) -> xr.DataArray:
        """Return the light on the sensor plane: photocurrent where all sensors ask for it and the
        lens can, else irradiance.
        """
        return imaged(self.plan, self.mixed)

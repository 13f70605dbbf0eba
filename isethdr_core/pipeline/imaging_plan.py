"""Imaging plan: how a lens computes the light of one field, with the omissions and errors, decided
once.

A lens with a method `plan` (`PlansImaging`) decides which parts of the field, and of its own
effects, are measurable by the sensors. It may outline its plan before rendering
(`OutlinesImaging`), so that no unused light is rendered. Any other lens gets a `TrivialPlan`, which
leaves nothing out.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from inspect import signature
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeGuard

from ..data.quantities import LABEL_PREFIX
from ..plugins.protocols import (
    FocusesAtDepth,
    ImagingPlan,
    KeepsLight,
    MakesPhotocurrent,
    NarrowsDemand,
    OutlinesImaging,
    PlansImaging,
    StatesErrors,
    StatesSpreadErrors,
)
from ..uncertainty import ledger
from ..uncertainty.earlier_terms import maps_of
from ..uncertainty.error_terms import ErrorMaps, ErrorTerm
from ..uncertainty.ledger import LeftOut
from .demand import Demand, Response

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr


@dataclass(frozen=True)
class LightBudget:
    """The part of the light on the image plane that is needed, and the error allowed."""

    error_allowed: float = 0.0  # relative error allowed in every tile; 0: exact computation
    window_m: tuple[float, float] | None = None  # (width, height) that sensors cover; None: all
    sensed_nm: tuple[float, ...] | None = None  # bands to which sensors respond; None: all


@dataclass(frozen=True)
class FieldAhead:
    """Properties of a field before its light is computed; None: not known."""

    size: tuple[float, float, str] | None = None  # (width, height, projection) of the field
    bands_nm: tuple[float, ...] | None = None  # centres of all bands that the light will have


@dataclass(frozen=True)
class ImagingOutline:
    """The inputs and omissions of a plan, known before any light is computed."""

    margin: bool = True  # whether light of tiles beyond the camera's field may get into it
    left_out: tuple[LeftOut, ...] = ()


def plans_imaging(lens: Any) -> TypeGuard[PlansImaging]:
    """Return whether a lens plans the light that it makes.

    A subclass that overrides the computation of light (`__call__`, `photocurrent`, `light_errors`
    or its earlier name `spread_errors`), but not `plan`, inherits a plan that describes different
    light.
    """
    return isinstance(lens, PlansImaging) and _tells_of_its_own_light(lens, "plan")


def _tells_of_its_own_light(lens: Any, method: str) -> bool:
    """Return whether a method of a lens describes the light that the lens makes: no subclass of the
    class that defines the method computes the light differently.
    """
    classes = type(lens).__mro__

    def defined(name: str) -> int:
        return next((k for k, base in enumerate(classes) if name in vars(base)), len(classes))

    makes_light = ("__call__", "photocurrent", "light_errors", "spread_errors")
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
        """Return the light that the lens makes of mixed radiance."""
        if self.response is not None and isinstance(self.lens, MakesPhotocurrent):
            return self.lens.photocurrent(mixed, self.flares, self.response)
        keywords = {}
        if self.error_allowed and "error_allowed" in signature(self.lens.__call__).parameters:
            keywords = {"error_allowed": self.error_allowed}
        light: xr.DataArray = self.lens(mixed, flares=self.flares, **keywords)
        return light

    def light_errors(self, mixed: xr.DataArray, weights: np.ndarray) -> ErrorMaps | None:
        """Return the errors of the light that the lens states; None if it states none, and if it
        inherits a statement about other light (`plans_imaging`).
        """
        lens = self.lens
        if isinstance(lens, StatesErrors) and _tells_of_its_own_light(lens, "light_errors"):
            return maps_of(lens.light_errors(mixed, self.flares, weights, self.response))
        if isinstance(lens, StatesSpreadErrors) and _tells_of_its_own_light(lens, "spread_errors"):
            message = f"{type(lens).__name__}.spread_errors is now called light_errors; rename it"
            warnings.warn(message, DeprecationWarning, stacklevel=2)
            return maps_of(lens.spread_errors(mixed, self.flares, weights, self.response))
        return None


def outlined(
    lens: Any, flares: Sequence[Any], ahead: FieldAhead, budget: LightBudget
) -> ImagingOutline:
    """Return the outline of a lens's plan; if the lens has none, an outline that needs everything.

    Parameters
    ----------
    lens : lens of the run.
    flares : flare models of the run.
    ahead : size and bands of the field, as far as they are known.
    budget : light that is needed, and the error allowed.
    """
    if plans_imaging(lens) and isinstance(lens, OutlinesImaging):
        return lens.outline(flares, ahead, budget)
    in_place = (
        isinstance(lens, KeepsLight)
        and _tells_of_its_own_light(lens, "keeps_light")
        and lens.keeps_light(flares)
    )
    return ImagingOutline(margin=not in_place)


def labelled(lens: Any, mixed: xr.DataArray, scene: xr.Dataset) -> xr.DataArray:
    """Return mixed radiance with the labels that a lens asks for, as coordinates (y, x) such as
    `label_depth`. Labels that the scene lacks are left out.

    Parameters
    ----------
    lens : lens of the run.
    mixed : ([component,] wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    scene : scene radiance with its labels, on the same tiles.
    """
    if not isinstance(lens, NarrowsDemand):
        return mixed
    asked = ledger.collected(lambda: lens.narrow(Demand())).result.labels
    known = {LABEL_PREFIX + n: scene[n].variable for n in sorted(asked) if n in scene}
    return mixed.assign_coords(known) if known else mixed


def _labels_of(mixed: xr.DataArray) -> dict[str, Any]:
    """Return the labels of mixed radiance that `labelled` has added, by coordinate."""
    return {
        str(name): coordinate.variable
        for name, coordinate in mixed.coords.items()
        if str(name).startswith(LABEL_PREFIX)
    }


def in_focus(lens: Any) -> Any:
    """Return the lens with all depths in focus, so that imaging needs no depth."""
    return lens.in_focus() if isinstance(lens, FocusesAtDepth) else lens


def imaged(plan: ImagingPlan, mixed: xr.DataArray) -> xr.DataArray:
    """Return the light of a plan, and state its omissions and errors in the ledger."""
    ledger.record(*plan.terms)
    ledger.record_left_out(*plan.left_out)
    return plan.image(mixed)


@dataclass(eq=False)
class Imaging:
    """Computes the light on the sensor plane from mixed radiance. The plan is made once, on first
    use. Threads that work on several cameras use it one at a time.
    """

    mixed: xr.DataArray
    make_plan: Callable[[], ImagingPlan]
    _turn: Lock = field(default_factory=Lock, init=False)

    @cached_property
    def plan(self) -> ImagingPlan:
        """The plan of the lens. It computes the light and its errors."""
        return self.make_plan()

    def light_errors(self, mixed: xr.DataArray, weights: np.ndarray) -> ErrorMaps | None:
        """Return the errors of the light that the plan states; None if it states none.

        Parameters
        ----------
        mixed : (wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1, on the tiles of `self.mixed`.
        weights : (channel, wavelength) of the irradiance in each channel.
        """
        # a plan that is made for this call needs the labels, too
        mixed = mixed.assign_coords(_labels_of(self.mixed))
        with self._turn:
            return self.plan.light_errors(mixed, weights)

    def light(self) -> xr.DataArray:
        """Return the light on the sensor plane: photocurrent if all sensors accept it and the lens
        can compute it, otherwise irradiance.
        """
        return imaged(self.plan, self.mixed)

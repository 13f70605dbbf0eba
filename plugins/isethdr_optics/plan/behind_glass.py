"""Behind glass: a lens behind drops or a film images the radiance that they transmit."""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from isethdr_core import ledger
from isethdr_core.ledger import LeftOut
from isethdr_core.plugins.protocols import Flare, RedirectsLight
from isethdr_core.uncertainty.error_terms import ErrorMaps, ErrorTerm

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

    from .depth_layers import DefocusedPlan
    from .lens_plan import LensPlan


@dataclass(frozen=True, eq=False)
class Glass:
    """Flares in front of a lens, and one field behind them."""

    lens: Any
    flares: tuple[RedirectsLight, ...]  # ordered from the outside to the lens
    field: weakref.ref[xr.DataArray]  # the field in front of the flares
    behind: xr.DataArray  # the same field behind the flares
    notes: tuple[LeftOut, ...]  # effects that the flares' models leave out

    def radiance(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return mixed radiance ([component,] wavelength, y, x) behind the glass."""
        if self.field() is mixed:
            return self.behind
        return ledger.collected(lambda: redirected(self.lens, self.flares, mixed)).result


@dataclass(frozen=True, eq=False)
class PlanBehindGlass:
    """A plan (`isethdr_core.plugins.protocols.ImagingPlan`) of one lens behind a glass."""

    glass: Glass
    plan: LensPlan | DefocusedPlan  # plan for the field behind the glass
    terms: tuple[ErrorTerm, ...]
    left_out: tuple[LeftOut, ...]

    def image(self, mixed: xr.DataArray) -> xr.DataArray:
        """Return the light of mixed radiance ([component,] wavelength, y, x), as `LensPlan.image`.

        Raises
        ------
        UnitError : as `LensPlan.image`.
        """
        return self.plan.image(self.glass.radiance(mixed))

    def light_errors(self, mixed: xr.DataArray, weights: np.ndarray) -> ErrorMaps:
        """Return the errors of the light of `mixed` from the kernels' errors, as
        `LensPlan.light_errors`.
        """
        return self.plan.light_errors(self.glass.radiance(mixed), weights)


def plan_behind(glass: Glass, plan: LensPlan | DefocusedPlan) -> PlanBehindGlass:
    """Return the plan of a lens behind a glass.

    Parameters
    ----------
    glass : flares in front of the lens, and the field behind them.
    plan : plan for the field behind the glass.
    """
    return PlanBehindGlass(glass, plan, plan.terms, (*glass.notes, *plan.left_out))


def split(flares: Sequence[Flare]) -> tuple[tuple[RedirectsLight, ...], tuple[Flare, ...]]:
    """Return the flares in front of the lens, and the others."""
    front = tuple(f for f in flares if isinstance(f, RedirectsLight))
    return front, tuple(f for f in flares if not isinstance(f, RedirectsLight))


def redirected(lens: Any, flares: Sequence[RedirectsLight], mixed: xr.DataArray) -> xr.DataArray:
    """Return mixed radiance behind the flares in front of a lens.

    Parameters
    ----------
    lens : lens behind the flares.
    flares : flares, ordered from the outside to the lens.
    mixed : mixed radiance ([component,] wavelength, y, x).
    """
    for flare in flares:
        mixed = flare.redirected(lens, mixed)
    return mixed


def glass(lens: Any, flares: tuple[RedirectsLight, ...], field: xr.DataArray) -> Glass:
    """Return the flares in front of a lens together with the field behind them.

    Parameters
    ----------
    lens : lens behind the flares.
    flares : flares, ordered from the outside to the lens.
    field : mixed radiance ([component,] wavelength, y, x) in front of the flares.
    """
    behind, row = ledger.collected(lambda: redirected(lens, flares, field))
    return Glass(lens, flares, weakref.ref(field), behind, tuple(row.left_out))

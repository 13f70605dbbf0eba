"""Lens plans: how a lens plans the imaging of one field, and states the errors of its light.

A plan leaves out what no later stage needs.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:
    import xarray as xr

    from ...pipeline.demand import Response
    from ...pipeline.imaging_plan import FieldAhead, ImagingOutline, LightBudget
    from ...uncertainty.error_terms import ErrorMaps, ErrorTerm
    from ...uncertainty.ledger import LeftOut
    from .flares import Flare, Numbers


class ImagingPlan(Protocol):
    """How a lens images one field; `PlansImaging` returns it."""

    @property
    def terms(self) -> Sequence[ErrorTerm]:
        """The errors that are known before imaging."""
        ...

    @property
    def left_out(self) -> Sequence[LeftOut]:
        """The omissions, each with a bound on its effect."""
        ...

    def image(self, mixed: xr.DataArray, /) -> xr.DataArray:
        """Return irradiance or photocurrent of mixed radiance on the planned field."""
        ...

    def light_errors(self, mixed: xr.DataArray, weights: Numbers, /) -> ErrorMaps | None:
        """Return the errors of the light of `mixed`, tile by tile, (channel, y, x).

        Parameters
        ----------
        mixed : (wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
        weights : (channel, band), weights of the irradiance of each band of `mixed`.

        Returns
        -------
        Errors on the tiles of the light that `image` returns; None if the errors are not known.
        """
        ...


@runtime_checkable
class PlansImaging(Protocol):
    """A lens that decides once which parts of a field, and of its own effects, are needed."""

    def plan(
        self,
        flares: Sequence[Flare],
        field: xr.DataArray,
        response: Response | None,
        budget: LightBudget,
        /,
    ) -> ImagingPlan:
        """Return the plan of imaging a field.

        Parameters
        ----------
        flares : flare models in the lens.
        field : mixed radiance `([component,] wavelength, y, x)`.
        response : response of all sensors; None if one of them needs light wavelength by
            wavelength.
        budget : the part of the light that is needed, and the error allowed.
        """
        ...


@runtime_checkable
class OutlinesImaging(Protocol):
    """A lens with a plan that is partly known before any light is computed."""

    def outline(
        self, flares: Sequence[Flare], ahead: FieldAhead, budget: LightBudget, /
    ) -> ImagingOutline:
        """Return the inputs that the plan will need, and its certain omissions.

        The lens has to plan its imaging too (`PlansImaging`): otherwise nothing may be left out.

        Parameters
        ----------
        flares : flare models in the lens.
        budget : the part of the light that is needed, and the error allowed; its `sensed_nm` is
            None if it is not known.
        ahead : the known properties of the field.
        """
        ...


@runtime_checkable
class MakesPhotocurrent(Protocol):
    """A lens that can compute the photocurrent of the sensors instead of irradiance."""

    def photocurrent(
        self, mixed: xr.DataArray, flares: Sequence[Flare], response: Response, /
    ) -> xr.DataArray:
        """Return photocurrent in the window of the sensors, or irradiance if that is cheaper.

        Parameters
        ----------
        mixed : mixed radiance `([component,] wavelength, y, x)`.
        flares : flare models in the lens.
        response : response of all sensors; its `noise_fraction_allowed` is the error allowed.

        Returns
        -------
        DataArray `([component,] channel, y, x)`, electrons m-2 s-1, or irradiance.
        """
        ...


@runtime_checkable
class StatesErrors(Protocol):
    """A lens that knows the errors of its light, tile by tile."""

    def light_errors(
        self,
        mixed: xr.DataArray,
        flares: Sequence[Flare],
        weights: Numbers,
        response: Response | None,
        /,
    ) -> ErrorMaps | tuple[Numbers, Numbers] | None:
        """Return the errors of the light, tile by tile.

        Parameters
        ----------
        mixed : mixed radiance `([component,] wavelength, y, x)`.
        flares : flare models in the lens.
        response : response of all sensors; None for irradiance.
        weights : (channel, band), weights of the irradiance of each band.

        Returns
        -------
        Standard deviation and bound, each (channel, y, x), in the unit of irradiance times
        `weights`; None if they are not known. A tuple is accepted until version 1.0.
        """
        ...


@runtime_checkable
class StatesSpreadErrors(Protocol):
    """Earlier form of `StatesErrors`, under another name; accepted until version 1.0."""

    def spread_errors(
        self,
        mixed: xr.DataArray,
        flares: Sequence[Flare],
        weights: Numbers,
        response: Response | None,
        /,
    ) -> ErrorMaps | tuple[Numbers, Numbers] | None:
        """Return the errors of the light, tile by tile.

        Parameters
        ----------
        mixed : mixed radiance `([component,] wavelength, y, x)`.
        flares : flare models in the lens.
        weights : (channel, band), weights of the irradiance of each band.
        response : response of all sensors; None for irradiance.
        """
        ...

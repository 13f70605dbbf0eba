"""Imaging stage: light on the sensor plane, by the plan of the lens."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .. import bands
from ..imaging_plan import Imaging, ImagingPlan, LightBudget, TrivialPlan, plans_imaging

if TYPE_CHECKING:
    import xarray as xr

    from ..demand import Demand
    from .components import Chain


def imaging_plan(chain: Chain, mixed: xr.DataArray, demand: Demand) -> ImagingPlan:
    """Return the plan by which the lens computes light on the sensor plane.

    The plan is trivial if the lens has none of its own, or if nothing may be left out.

    Parameters
    ----------
    chain : components of the run.
    mixed : ([component,] wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    demand : demand of the sensors for light on the sensor plane.
    """
    flares = tuple(chain.flares.values())
    if not chain.leave_out:
        return TrivialPlan(chain.lens, flares)
    if not plans_imaging(chain.lens):
        return TrivialPlan(chain.lens, flares, demand.response, demand.error_allowed)
    sensed_nm = bands.sensed_nm(chain.cameras.values(), mixed.wavelength.values)
    budgeted = LightBudget(demand.error_allowed, demand.window_m, sensed_nm)
    return chain.lens.plan(flares, mixed, demand.response, budgeted)


def imaging(chain: Chain, mixed: xr.DataArray, demand: Demand) -> Imaging:
    """Return the imaging of mixed radiance. Its plan is made once, on first use.

    Parameters
    ----------
    chain : components of the run.
    mixed : ([component,] wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    demand : demand of the sensors for light on the sensor plane.
    """
    return Imaging(mixed, lambda: imaging_plan(chain, mixed, demand))


def on_sensor(chain: Chain, mixed: xr.DataArray, demand: Demand) -> xr.DataArray:
    """Return the light on the sensor plane, without its plan.

    Parameters
    ----------
    chain : components of the run.
    mixed : ([component,] wavelength, y, x) mixed radiance, W m-2 sr-1 nm-1.
    demand : demand of the sensors for light on the sensor plane.
    """
    return imaging(chain, mixed, demand).light()

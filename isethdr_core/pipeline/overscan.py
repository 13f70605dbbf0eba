"""Overscan: tiles beyond the camera's field, rendered so that the lens can spread their light into
the field.

These tiles are left out if the plan of the lens needs none of them (`ImagingOutline.margin`) and
every lighting depends on the field only (`LooksWithinField`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from ..plugins.protocols import LooksWithinField, RendersMargin
from ..uncertainty import ledger
from .demand import Demand
from .imaging_plan import ImagingOutline


def left_out_where_unseen(
    demand: Demand, renderer: Any, outline: ImagingOutline, lightings: Sequence[Any]
) -> Demand:
    """Return the demand without overscan, if no light from the renderer's overscan can reach the
    camera's field.

    Parameters
    ----------
    demand : demand for the scene radiance.
    renderer : renderer of the run; None if the scene provides its own radiance.
    outline : outline of the lens's plan.
    lightings : lightings of all versions.
    """
    if not (
        isinstance(renderer, RendersMargin)
        and renderer.margin
        and not outline.margin
        and all(isinstance(light, LooksWithinField) and light.WITHIN_FIELD for light in lightings)
    ):
        return demand
    ledger.left_out(
        f"tiles beyond the camera's field, {renderer.margin:.0%} on each side",
        "the lens spreads none of their light into the field",
        0.0,
        "W m-2 sr-1 nm-1",
        needless=True,
    )
    return replace(demand, margin=False)

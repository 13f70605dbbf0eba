"""Margin: tiles beyond the camera's field, rendered so that a lens can spread their light into it.

A lens that spreads none says so (`KeepsLight`), and a lighting that looks at nothing beyond the
field does (`LooksWithinField`). Where all do, the margin is left out; where any of them does not,
it stays.
"""

from __future__ import annotations

from dataclasses import replace

from ..plugins.protocols import KeepsLight, LooksWithinField, RendersMargin
from ..uncertainty import ledger
from .demand import Demand


def left_out_where_unseen(demand: Demand, renderer, lens, flares, lightings) -> Demand:
    """Return the demand without the renderer's margin where no light of it can reach the camera's
    field.
    """
    if not (
        isinstance(renderer, RendersMargin)
        and renderer.margin
        and isinstance(lens, KeepsLight)
        and lens.keeps_light(flares)
        and all(isinstance(light, LooksWithinField) and light.WITHIN_FIELD for light in lightings)
    ):
        return demand
    ledger.left_out(
        f"tiles beyond the camera's field, {renderer.margin:.0%} on each side",
        "the lens spreads no light into it",
        0.0,
        "W m-2 sr-1 nm-1",
        needless=True,
    )
    return replace(demand, margin=False)

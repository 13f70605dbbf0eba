"""Outline: what the plan of a lens will need and certainly leave out, before the light is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core import quantities
from isethdr_core.ledger import LeftOut
from isethdr_core.physics.optics import projection as projections
from isethdr_core.pipeline import bands
from isethdr_core.pipeline.imaging_plan import FieldAhead, ImagingOutline, LightBudget
from isethdr_core.pipeline.window import SLIVER

from ..abilities import ChecksLens, FieldAngles
from ..field.omissions import known_ahead

if TYPE_CHECKING:
    from isethdr_core.plugins.protocols import Flare

    from ..abilities import LensOptics


def outline(
    lens: LensOptics, flares: Sequence[Flare], ahead: FieldAhead, budget: LightBudget
) -> ImagingOutline:
    """Return the outline of the plan of a lens, as
    `isethdr_core.plugins.protocols.OutlinesImaging.outline`.

    Parameters
    ----------
    lens : a lens of this package.
    flares : its flare components.
    ahead : the known facts of the field.
    budget : the light that is needed.

    Raises
    ------
    ConfigError : a flare does not fit the lens or the field.
    """
    if ahead.size is not None:
        _check_flares(lens, flares, ahead.size)
    in_place = lens.keeps_light(flares)
    left_out = [*known_ahead(lens), *_bands(ahead.bands_nm, budget.sensed_nm)]
    if in_place:
        left_out += _tiles(lens, ahead.size, budget.window_m)
    return ImagingOutline(margin=not in_place, left_out=tuple(left_out))


def _check_flares(
    lens: LensOptics, flares: Sequence[Flare], size: tuple[float, float, str]
) -> None:
    """Raise ConfigError if a flare does not fit the lens or a field (width, height, projection)."""
    width, height, projection = size
    widest_rad = float(projections.angle_rad(width / 2, height / 2, projection))
    field = FieldAngles(projection, widest_rad)
    for flare in flares:
        if isinstance(flare, ChecksLens):
            flare.check_lens(lens, field)


def _bands(
    offered_nm: tuple[float, ...] | None, sensed_nm: tuple[float, ...] | None
) -> list[LeftOut]:
    """Return the row of the ledger for the outer bands to which no sensor responds."""
    if not offered_nm or not sensed_nm:
        return []
    outer_bands = bands.outer(np.isin(offered_nm, sensed_nm))
    blind = len(offered_nm) - len(offered_nm[outer_bands])
    if not blind:
        return []
    what = f"{blind} of {len(offered_nm)} bands through the lens"
    unit = "electrons per electron that the same photons make at the peak"
    return [
        LeftOut(
            what, "no sensor responds to them", bands.UNSEEN, unit, key=bands.BANDS, needless=True
        )
    ]


def _tiles(
    lens: LensOptics, size: tuple[float, float, str] | None, window_m: tuple[float, float] | None
) -> list[LeftOut]:
    """Return the row of the ledger for the share of the camera's field that no sensor sees."""
    if size is None or window_m is None:
        return []
    whole_m = lens.image_size_m(*size)
    seen_share = math.prod(
        min(side / full, 1.0) for side, full in zip(window_m, whole_m, strict=True)
    )
    if seen_share >= 1 - SLIVER:
        return []
    what = f"{100 * (1 - seen_share):.3g} % of the camera's field through the lens"
    return [LeftOut(what, "no sensor sees it", 0.0, quantities.IRRADIANCE, needless=True)]

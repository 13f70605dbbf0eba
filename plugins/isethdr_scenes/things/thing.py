"""A thing of a driving scene: what is known of it before a mesh is built."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .riding import RidingPosition

Detail = Literal["near", "middle", "far"]


@dataclass(frozen=True)
class Thing:
    """One member of a family. It stands at its own origin on z = 0, looks along +x, and is centred
    in x and y.

    Families that need more derive from this class; every field is hashable and has a default.
    """

    family: str  # for example `sedan`
    variant: int  # member of the family: the seed of all that its ranges leave open
    category: str  # a name of `isethdr_core.data.categories`
    size_m: tuple[float, float, float]  # length, width, height of the mesh, within 3 cm
    group: str = ""  # of `registry.GROUPS`, for example `car`
    paint: str = ""  # a name of `materials.PAINT`, where the family is painted
    # where its rider touches it, of a two-wheeler whose family does not tell
    riding: RidingPosition | None = None

"""A thing of a driving scene: the data that are known before its mesh is built."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .riding import RidingPosition

Detail = Literal["near", "middle", "far"]


@dataclass(frozen=True)
class Thing:
    """One member of a family. It stands on z = 0, faces +x, and is centred in x and y.

    Families that need more data derive from this class. Their fields are hashable and have
    defaults.
    """

    family: str  # for example `sedan`
    variant: int  # number of the member; it seeds all random values of the member
    category: str  # a name of `isethdr_core.data.categories`
    size_m: tuple[float, float, float]  # length, width, height of the mesh, within 3 cm
    group: str = ""  # a key of `registry.GROUPS`, for example `car`
    paint: str = ""  # a name of `materials.PAINT`, if the family is painted
    # points where its rider touches it, for a two-wheeler of an asset pack
    riding: RidingPosition | None = None

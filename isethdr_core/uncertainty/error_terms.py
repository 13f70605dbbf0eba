"""Error terms: what a stated error acts on, on which part of the light, and which terms change a
pixel's electrons.

Code decides by the fields of a term (source, quantity, part, unit, how); its label `what` is for
people and may be reworded freely.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import xarray as xr

How = Literal["measured", "bound", "statistical"]  # a statistical value is one standard deviation


class Quantity(StrEnum):
    """The quantity that an error acts on."""

    UNSTATED = ""  # what the stage returns
    RADIANCE = "radiance"
    IRRADIANCE = "irradiance"  # light on the sensor plane, photocurrent included
    ELECTRONS = "electrons"
    PICTURE = "picture"
    SCORE = "score"
    POINT_SPREAD = (
        "point spread"  # shape of a point spread function: no pixel's error follows from it alone
    )
    ATTRIBUTES = "attributes"  # what the attributes of the data say: the data itself is right
    TARGET = "target"  # what a solver was asked for: its result is right


LIGHT = (Quantity.UNSTATED, Quantity.RADIANCE, Quantity.IRRADIANCE, Quantity.ELECTRONS)

DIRECT = "direct light"  # electrons that come straight from the tiles a pixel looks at
SPREAD = "spread light"  # all other electrons
UNITS_OF_SPREAD = ("relative per tile", "relative of spread light")  # these units name their part

KERNELS = "kernels"  # source of errors that a lens with `spread_errors` knows pixel by pixel
STORE_ROUNDING = "store rounding"  # source of the rounding of stored radiance


@dataclass(frozen=True)
class ErrorNote:
    """One stated error.

    `source` is a free key, unique within its stage: terms that share source, quantity, part, unit
    and `how` are alternatives, of
    which the largest counts. `part` is `DIRECT`, `SPREAD` or a name under which the stage declared
    the light (`ledger.light_part`);
    empty: all light.
    """

    value: float
    unit: str
    how: How
    what: str = ""
    source: str = ""
    quantity: Quantity = Quantity.UNSTATED
    part: str = ""


@dataclass(frozen=True, eq=False)
class LightPart:
    """A part of the light that a stage declares, for its error terms to act on."""

    light: xr.DataArray  # irradiance or photocurrent on the sensor plane
    # standard deviation of the light within each tile: acts on the tiles that a pixel divides
    within_tiles: bool = False


def part_of(note: ErrorNote) -> str:
    """Return the part of the light that a term acts on; empty: all light."""
    return note.part or (SPREAD if note.unit in UNITS_OF_SPREAD else "")


def largest_alternatives(notes: list[ErrorNote]) -> list[ErrorNote]:
    """Return the largest term of each source, quantity, part, unit and `how`; terms without a
    source are all kept.
    """
    largest: dict[tuple, ErrorNote] = {}
    for position, note in enumerate(notes):
        key = (note.source or position, note.quantity, part_of(note), note.unit, note.how)
        if key not in largest or note.value > largest[key].value:
            largest[key] = note
    return list(largest.values())

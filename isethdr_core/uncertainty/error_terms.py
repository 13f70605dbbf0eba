"""Error terms: stated errors as data. Code decides by their fields, never by their labels."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr

# a statistical value is one standard deviation; that of a score is half of its 95 % interval
How = Literal["measured", "bound", "statistical"]

RELATIVE = "relative"  # unit of a value that is a share of what the term acts on
SPELLINGS = {"e": "electrons"}  # {other spelling of a unit: the spelling of error terms}
ABSOLUTE = ("W m-2 nm-1", "electrons", "e", "cd/m2")  # units in which errors of a sum add up


class Quantity(StrEnum):
    """The quantity that an error acts on."""

    RADIANCE = "radiance"
    IRRADIANCE = "irradiance"
    PHOTOCURRENT = "photocurrent"
    ELECTRONS = "electrons"
    PICTURE = "picture"
    SCORE = "score"
    # An error of one of the following quantities changes no electrons, picture or score by itself.
    RAW = "raw"  # digital numbers: what a sensor reads out
    ATTRIBUTES = "attributes"  # statements in attributes of the data; the data itself is right
    TARGET = "target"  # a limit that was requested from a solver or a run; not an error of a result
    OTHER = "other"  # a quantity within the stage, which `part` names
    POINT_SPREAD = OTHER  # earlier name, accepted until version 1.0


LIGHT = (Quantity.RADIANCE, Quantity.IRRADIANCE, Quantity.PHOTOCURRENT, Quantity.ELECTRONS)

# quantity that a stage of each kind returns; `ledger.error` uses it if no quantity is given
RETURNED = {
    "plan": Quantity.TARGET,
    "scene": Quantity.RADIANCE,
    "renderer": Quantity.RADIANCE,
    "radiance": Quantity.RADIANCE,
    "store": Quantity.RADIANCE,
    "lighting": Quantity.RADIANCE,
    "lens": Quantity.IRRADIANCE,
    "flare": Quantity.IRRADIANCE,
    "sensor": Quantity.RAW,
    "isp": Quantity.PICTURE,
    "truth": Quantity.PICTURE,
    "metric": Quantity.SCORE,
    "draws": Quantity.SCORE,
    "scores": Quantity.SCORE,
}


@dataclass(frozen=True)
class Source:
    """Where an error comes from: the stage, by kind and name, and a free key within that stage.

    A term that a function returns holds the key alone. The ledger adds kind and name of the stage
    that records it.
    """

    kind: str = ""
    name: str = ""
    key: str = ""

    def __str__(self) -> str:
        stage = "/".join(filter(None, (self.kind, self.name)))
        return f"{stage}: {self.key}" if self.key else stage


@dataclass(frozen=True)
class ErrorTerm:
    """One stated error. Terms are equal if all fields except their labels are equal.

    Attributes
    ----------
    source : stage and key of the error. Terms with a key that agree in source, quantity, part, unit
        and `how` are alternatives, of which the largest counts. Terms without a key all count.
    acts_on : the quantity that is wrong.
    part : the part of that quantity, by the name under which a stage declared it: a part of the
        light (`ledger.light_part`), a light group, a capture, a score; for `Quantity.OTHER`, the
        name of the quantity. None: all of it.
    value : size of the error, in `unit`; 0 or more, infinite if it is not known.
    unit : `relative` is a share of what the term acts on; `e` is written as `electrons`.
    how : how the value is known.
    label : text for people only.
    """

    source: Source
    acts_on: Quantity
    part: str | None
    value: float
    unit: str
    how: How
    label: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        # one spelling, so that alternatives are found by their units
        object.__setattr__(self, "unit", SPELLINGS.get(self.unit, self.unit))

    def identity(self) -> tuple[Any, ...]:
        """Return all fields but the value and the label."""
        return (self.source, self.acts_on, self.part, self.unit, self.how)


def largest_alternatives(terms: Iterable[ErrorTerm]) -> list[ErrorTerm]:
    """Return the largest of the terms that are alternatives; terms without a key are all kept."""
    largest: dict[Any, ErrorTerm] = {}
    for position, term in enumerate(terms):
        key = term.identity() if term.source.key else position
        if key not in largest or term.value > largest[key].value:
            largest[key] = term
    return list(largest.values())


def of_sum(parts: Iterable[Iterable[ErrorTerm]]) -> list[ErrorTerm]:
    """Return the terms of a sum of light, from those of its parts.

    The k-th term of one identity in a part belongs to the k-th of that identity in every other
    part. A relative value of the sum is at most the largest relative value of the parts; absolute
    values add up.
    """
    together: dict[tuple[Any, ...], list[ErrorTerm]] = {}
    for terms in parts:
        positions: dict[tuple[Any, ...], int] = {}
        for term in terms:
            identity = term.identity()
            position = positions[identity] = positions.get(identity, -1) + 1
            together.setdefault((identity, position), []).append(term)
    return [
        replace(
            max(terms, key=lambda term: term.value), value=total((t.value for t in terms), unit)
        )
        for ((*_, unit, _), _), terms in together.items()
    ]


def total(values: Iterable[float], unit: str) -> float:
    """Return the error of a sum from the errors of its parts: see `of_sum`."""
    return sum(values) if unit in ABSOLUTE else max(values)


class Reading(StrEnum):
    """How the electrons of a declared part of the light are computed."""

    LIGHT = "light"  # mean over each pixel of the part, which is declared on the sensor plane
    DEVIATION = "deviation"  # standard deviation within each tile, where pixel borders cut tiles
    IMAGE = "image"  # no light is declared: the light of the tiles that a pixel looks at is used
    REST = "rest"  # no light is declared: all light except `IMAGE` is used


@dataclass(frozen=True, eq=False)
class LightPart:
    """A part of the light that a stage declares, for its error terms to act on."""

    light: xr.DataArray | None  # irradiance or photocurrent on the sensor plane
    reading: Reading = Reading.LIGHT


class ErrorMaps(NamedTuple):
    """Errors of the light on the sensor plane, tile by tile. They replace some terms of a lens."""

    deviation: np.ndarray  # standard deviation of statistical errors, (channel, y, x)
    bound: np.ndarray  # bound of all other errors, (channel, y, x)
    replaces: tuple[str, ...] = ()  # keys of the terms that the maps replace
    label: str = ""  # for people only

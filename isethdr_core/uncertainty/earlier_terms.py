"""Error terms in the spelling of earlier versions: stored ledgers, and plugins written for them.

In earlier versions, a term had the fields value, unit, how, what, source, quantity and part, and
some units named a part of the light. These terms are accepted until version 1.0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..errors import PluginError
from .error_terms import (
    RELATIVE,
    RETURNED,
    ErrorMaps,
    ErrorTerm,
    How,
    LightPart,
    Quantity,
    Reading,
    Source,
)

DIRECT = "direct light"
SPREAD = "spread light"
PARTS = {DIRECT: LightPart(None, Reading.IMAGE), SPREAD: LightPart(None, Reading.REST)}
UNITS = {  # {unit: part of the light that its value is a share of}
    "relative per tile": SPREAD,
    "relative of spread light": SPREAD,
    "share of a point's light": None,
}
INSIDE = "point spread"  # quantity of earlier versions, now a part of `Quantity.OTHER`
# keys of the terms that a lens's maps of deviation and bound replace
KERNELS = ("kernels", *(f"kernels, {unit}" for unit in UNITS))


@dataclass(frozen=True)
class ErrorNote:
    """One stated error in the earlier form, for `ledger.add_error`; the new form is `ErrorTerm`."""

    value: float
    unit: str
    how: How
    what: str = ""
    source: str = ""
    quantity: Quantity | str = ""
    part: str = ""


def term_of(note: ErrorNote, kind: str, name: str) -> ErrorTerm:
    """Return the term of an earlier note.

    Parameters
    ----------
    note : the term in its earlier form.
    kind, name : kind and name of the stage that stated the term.
    """
    unit, part = unit_and_part(note.unit, note.part or None)
    if note.quantity:
        acts_on, part = quantity_and_part(note.quantity, part)
    else:
        acts_on = RETURNED.get(kind, Quantity.OTHER)
    # The earlier unit goes into the key, because it distinguished errors that now share a unit.
    key = f"{note.source}, {note.unit}" if note.source and unit != note.unit else note.source
    return ErrorTerm(
        Source(kind, name, key),
        acts_on,
        part,
        float(note.value),
        unit,
        note.how,
        note.what,
    )


def unit_and_part(unit: str, part: str | None) -> tuple[str, str | None]:
    """Return a unit without the part of the light that it names, and that part."""
    if unit not in UNITS:
        return unit, part
    return RELATIVE, part or UNITS[unit]


def quantity_and_part(quantity: str, part: str | None) -> tuple[Quantity, str | None]:
    """Return the quantity of a stored or earlier term, and its part."""
    if quantity == INSIDE:
        return Quantity.OTHER, part or INSIDE
    return Quantity(quantity), part


def maps_of(errors: ErrorMaps | tuple[Any, Any] | None) -> ErrorMaps | None:
    """Return the error maps of a lens, also if the lens returned (deviation, bound).

    Raises
    ------
    PluginError : the lens returned something else.
    """
    if errors is None or isinstance(errors, ErrorMaps):
        return errors
    try:
        deviation, bound = errors  # two maps, also as one array (2, channel, y, x)
    except (TypeError, ValueError):
        raise PluginError(
            f"light_errors of the lens returned {type(errors).__name__}; expected"
            " isethdr_core.error_terms.ErrorMaps, or None where the errors are not known"
        ) from None
    return ErrorMaps(deviation, bound, replaces=KERNELS, label="kernels")

"""Rows of a ledger, as stages state them."""

from __future__ import annotations

from isethdr_core.ledger import Ledger, Row
from isethdr_core.uncertainty import ledger
from isethdr_core.uncertainty.error_terms import How


def said(value: float, unit: str, how: How, label: str = "", **fields) -> dict:
    """Return the arguments of `ledger.error`."""
    return {"value": value, "unit": unit, "how": how, "label": label, **fields}


def row(stage: str, *errors: dict, rest: str = "") -> Row:
    """Return the row of a stage that states `errors`.

    `rest` names the part of the light that the stage declares to be all light but the image.
    """
    with ledger.stage(Ledger(), stage) as stated:
        if rest:
            ledger.rest_part(rest)
        for error in errors:
            ledger.error(**error)
    return stated

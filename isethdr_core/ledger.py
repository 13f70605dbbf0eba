"""Public path of `uncertainty.ledger`."""

from .uncertainty.error_terms import How
from .uncertainty.ledger import (
    ABSOLUTE,
    Ledger,
    LeftOut,
    Row,
    add_error,
    error,
    left_out,
    light_part,
    parts_of_a_sum,
    records_errors,
    stage,
    stated,
)

__all__ = [
    "ABSOLUTE",
    "How",
    "Ledger",
    "LeftOut",
    "Row",
    "add_error",
    "error",
    "left_out",
    "light_part",
    "parts_of_a_sum",
    "records_errors",
    "stage",
    "stated",
]

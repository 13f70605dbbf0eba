"""Public path of `uncertainty.error_terms`, with the names of earlier versions."""

from .uncertainty.earlier_terms import DIRECT, SPREAD, ErrorNote
from .uncertainty.error_terms import ErrorMaps, ErrorTerm, How, Quantity, Source

__all__ = ["DIRECT", "SPREAD", "ErrorMaps", "ErrorNote", "ErrorTerm", "How", "Quantity", "Source"]

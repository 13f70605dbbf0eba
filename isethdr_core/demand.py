"""Public path of `pipeline.demand`."""

from .pipeline.demand import (
    Demand,
    Response,
)

__all__ = [
    "Demand",
    "Response",
]

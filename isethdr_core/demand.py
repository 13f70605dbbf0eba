"""Public path of `pipeline.demand`."""

from .pipeline.demand import (
    Demand,
    NoiseLimit,
    Response,
)

__all__ = ["Demand", "NoiseLimit", "Response"]

"""Public path of `data.temporal_modulation`."""

from .data.temporal_modulation import (
    DIM,
    components,
    each_component,
    stacked,
    time_mean,
    wrong,
)

__all__ = ["DIM", "components", "each_component", "stacked", "time_mean", "wrong"]

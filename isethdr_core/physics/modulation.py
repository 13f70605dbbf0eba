"""Public path of `physics.detector.temporal_modulation`."""

from .detector.temporal_modulation import (
    Modulation,
    constant,
    light_s,
    phase_at,
    relative_light,
    ripple_s,
    row_starts_s,
    square_wave_pieces,
    square_wave_s,
)

__all__ = [
    "Modulation",
    "constant",
    "light_s",
    "phase_at",
    "relative_light",
    "ripple_s",
    "row_starts_s",
    "square_wave_pieces",
    "square_wave_s",
]

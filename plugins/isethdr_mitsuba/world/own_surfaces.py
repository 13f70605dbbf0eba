"""The Mitsuba surfaces written in Python, in one module, because importing them imports Mitsuba."""

from __future__ import annotations

import mitsuba as mi

from .compensated_surface import compensated_surface as compensated_surface
from .compensated_surface import missing_light as missing_light
from .retro_surface import retro_surface as retro_surface


def variant() -> str:
    """Return the current variant of Mitsuba."""
    return str(mi.variant())

"""Omissions: what a lens spares, said in the plan before a run and again by the lens at work, in
the same words.

Each is exact but for rounding: forcing it in computes the same light in another way.
"""

from __future__ import annotations

from isethdr_core import ledger

ROUNDING = 1.2e-7  # relative, of light in float32
# relative: shares of places and cores are float32, tiles across the border of a core meet twice
SHARED = 3e-6


def no_distortion() -> None:
    """State that light is not moved along a distortion."""
    ledger.left_out("moving light along a distortion", "the lens has none", ROUNDING, "relative")


def no_lateral_colour() -> None:
    """State that bands are not moved along a lateral colour."""
    ledger.left_out(
        "moving light along a lateral colour", "the lens has none", ROUNDING, "relative"
    )


def one_point_spread() -> None:
    """State that point spreads are not computed off the axis."""
    ledger.left_out(
        "point spreads off the axis", "the lens has the same everywhere", SHARED, "relative"
    )


def planned(lens) -> None:
    """State what a lens is known to spare before it has any light."""
    if lens.distortion == "none":
        no_distortion()
    if not lens.lateral_colour_percent and lens.lateral_colour == "none":
        no_lateral_colour()
    if lens.blurs and not lens.field_varies:
        one_point_spread()

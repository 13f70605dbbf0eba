"""Omissions: steps that a lens leaves out. The outline before a run and the plan state them.

Leaving them out is exact except for rounding: computing them would give the same light.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from isethdr_core.ledger import LeftOut

if TYPE_CHECKING:
    from ..abilities import LensOptics

ROUNDING = 1.2e-7  # relative rounding error of light in float32
# relative rounding error of shared light: the shares of field points and the cores are float32, and
# light that crosses the border of a core is summed from two parts
SHARED = 3e-6

NO_DISTORTION = LeftOut("distortion of the image", "the lens has none", ROUNDING, "relative")
NO_LATERAL_COLOUR = LeftOut("lateral colour", "the lens has none", ROUNDING, "relative")
ONE_POINT_SPREAD = LeftOut(
    "variation of the point spread over the field",
    "the lens has the same one everywhere",
    SHARED,
    "relative",
)


def known_ahead(lens: LensOptics) -> list[LeftOut]:
    """Return the steps that a lens will leave out, as far as they are known before the light."""
    none = not lens.lateral_colour_percent and lens.lateral_colour == "none"
    notes = [
        (lens.distortion == "none", NO_DISTORTION),
        (none, NO_LATERAL_COLOUR),
        (lens.blurs and not lens.field_varies, ONE_POINT_SPREAD),
    ]
    return [omission for spared, omission in notes if spared]

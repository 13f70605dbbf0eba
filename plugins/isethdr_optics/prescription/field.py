"""Field of a prescription: whether its beam gets to the corners of the camera's field, told before
anything is computed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from isethdr_core import ledger
from isethdr_core.errors import ConfigError
from isethdr_core.physics.optics.projection import angle_rad

if TYPE_CHECKING:
    from ..abilities import PupilOptics
    from ..lenses.prescription_lens import PrescribedLens

DARK = 0.01  # of the area of the beam on the axis
MARGIN = 1.2  # times the camera's field: what renderers add around it has to be traced too


def check(lens: PrescribedLens, width: float, height: float, projection: str) -> None:
    """Raise ConfigError where rims leave next to nothing of the beam towards a corner of the field,
    or where rays miss a surface just beyond.

    Parameters
    ----------
    lens : `PrescribedLens`. `width`, `height` : of the camera's field, tangents, or radians where
        `projection` is equidistant.
    """
    corner = _corner(width, height, projection)
    if _remaining_share(lens, corner) < DARK:
        raise ConfigError(
            f"prescription {lens.real().name!r} sends no light to the corners of the camera's"
            f" field, {math.degrees(corner):.1f} degrees off the axis; expected a field within the"
            f" {lens.real().half_field_deg:g} degrees it is made for: type"
            f" scene.horizontal_field_deg={_fits(lens, width, height, projection):g}, or another"
            " lens.prescription"
        )
    widest = _corner(MARGIN * width, MARGIN * height, projection)
    lens.falloff_to(widest)
    if lens.field_varies:
        lens.wavefront_at(widest)


def state(lens: PupilOptics, width: float, height: float, projection: str) -> None:
    """State in the ledger the vignetting in the corners of a field wider than the design field.

    Parameters
    ----------
    lens : `Prescription`. `width`, `height` : of the field, in the units of `projection`.
    projection : as in `isethdr_core.physics.optics.projection`.
    """
    corner = _corner(width, height, projection)
    made_for = lens.real().half_field_deg
    if math.degrees(corner) > made_for * (1 + 1e-9):
        ledger.left_out(
            f"light towards the corners of the camera's field, {math.degrees(corner):.1f} degrees"
            " off the axis",
            f"rims stop it: the prescription is made for {made_for:g} degrees, which"
            f" scene.horizontal_field_deg={_fits(lens, width, height, projection):g} stays within",
            max(0.0, 1 - _remaining_share(lens, corner)),
            "of the beam on the axis",
        )


def _corner(width: float, height: float, projection: str) -> float:
    return float(angle_rad(width / 2, height / 2, projection))


def _remaining_share(lens: PrescribedLens, angle: float) -> float:
    """Return the area of the beam from an angle off the axis over that on it."""
    return lens.beam(math.tan(angle)) if angle < math.pi / 2 else 0.0


def _fits(lens: PrescribedLens, width: float, height: float, projection: str) -> float:
    """Return the horizontal field, degrees, of the same aspect whose corners are at the border of
    the design field.
    """
    made_for = math.radians(lens.real().half_field_deg)
    half = math.hypot(width, height) / 2
    if projection == "tangent":
        wide = 2 * math.degrees(math.atan(math.tan(made_for) * width / 2 / half))
    else:
        wide = math.degrees(made_for * width / half)
    return math.floor(10 * wide) / 10

"""Field of a prescription: checks that its beam reaches the corners of the camera's field, before
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

DARK = 0.01  # least area of the beam in the corners, over that on the axis
# extent of the field that must be traced, over the camera's field: renderers add overscan around it
MARGIN = 1.2


def check(lens: PrescribedLens, width: float, height: float, projection: str) -> None:
    """Refuse a field with corners that the lens cannot image.

    Parameters
    ----------
    lens : lens `prescription`.
    width, height : size of the camera's field, tangents; radians if `projection` is equidistant.
    projection : as in `isethdr_core.physics.optics.projection`.

    Raises
    ------
    ConfigError : rims stop nearly the whole beam towards a corner of the field, or rays just beyond
        the corner miss a surface.
    """
    corner = _corner(width, height, projection)
    if _remaining_share(lens, corner) < DARK:
        raise ConfigError(
            f"prescription {lens.real().name!r} sends no light to the corners of the camera's"
            f" field, {math.degrees(corner):.1f} degrees off the axis; expected a field within the"
            f" {lens.real().half_field_deg:g} degrees off the axis of its design; type"
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
    lens : lens `prescription`.
    width, height : size of the camera's field, tangents; radians if `projection` is equidistant.
    projection : as in `isethdr_core.physics.optics.projection`.
    """
    corner = _corner(width, height, projection)
    made_for = lens.real().half_field_deg
    if math.degrees(corner) > made_for * (1 + 1e-9):
        ledger.left_out(
            f"light towards the corners of the camera's field, {math.degrees(corner):.1f} degrees"
            " off the axis",
            f"lens rims block it: the design field ends {made_for:g} degrees off the axis; type"
            f" scene.horizontal_field_deg={_fits(lens, width, height, projection):g} to stay"
            " within it",
            max(0.0, 1 - _remaining_share(lens, corner)),
            "of the beam on the axis",
        )


def _corner(width: float, height: float, projection: str) -> float:
    return float(angle_rad(width / 2, height / 2, projection))


def _remaining_share(lens: PrescribedLens, angle: float) -> float:
    """Return the area of the beam from a field angle, rad, over that on the axis."""
    return lens.beam(math.tan(angle)) if angle < math.pi / 2 else 0.0


def _fits(lens: PrescribedLens, width: float, height: float, projection: str) -> float:
    """Return the horizontal field, degrees, of a field with the same aspect ratio and with corners
    at the border of the design field.
    """
    made_for = math.radians(lens.real().half_field_deg)
    half = math.hypot(width, height) / 2
    if projection == "tangent":
        wide = 2 * math.degrees(math.atan(math.tan(made_for) * width / 2 / half))
    else:
        wide = math.degrees(made_for * width / half)
    return math.floor(10 * wide) / 10

"""Field of view: whether the camera's field covers every sensor, found out before anything is
computed.

Three optional methods tell: `camera_field()` of a scene, `image_size_m(width, height, projection)`
of a lens and `check_field(width_m, height_m)` of a sensor. Where one is missing, the sensor finds
out when the light arrives. A lens may have a fourth, `state_field(width, height, projection)`: what
becomes of light at the border of the field, for the ledger of the plan.
"""

from __future__ import annotations

import math


def camera_field(
    horizontal_field_deg: float, aspect: float, projection: str = "tangent"
) -> tuple[float, float, str]:
    """Return (width, height, projection) of a camera's field: tangents, or radians where
    `projection` is equidistant.

    Parameters
    ----------
    horizontal_field_deg : full angle.
    aspect : width / height of the field, in the projection's unit.
    """
    half = math.radians(horizontal_field_deg) / 2
    width = 2 * (math.tan(half) if projection == "tangent" else half)
    return width, width / aspect, projection


def check_fields(scene, lens, sensors) -> None:
    """Raise ConfigError where a sensor is larger than the image of the camera's field; silent where
    that is not known yet.
    """
    known = getattr(scene, "camera_field", None), getattr(lens, "image_size_m", None)
    if not all(known):
        return
    field, image_size_m = known
    size_m = image_size_m(*field())
    for sensor in sensors:
        if check := getattr(sensor, "check_field", None):
            check(*size_m)


def check_rendered(scene, renderer) -> None:
    """Raise ConfigError where a renderer cannot put its tiles on the camera's field.

    Its optional method `check_field(width, height, projection)` says so.
    """
    known = getattr(scene, "camera_field", None), getattr(renderer, "check_field", None)
    if all(known):
        field, check = known
        check(*field())


def state_field(scene, lens) -> None:
    """Let a lens say in the ledger what becomes of light at the border of the camera's field."""
    known = getattr(scene, "camera_field", None), getattr(lens, "state_field", None)
    if all(known):
        field, state = known
        state(*field())

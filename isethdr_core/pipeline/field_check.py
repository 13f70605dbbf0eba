"""Field of view: whether the camera's field covers every sensor, checked before any computation.

The check needs the abilities `KnowsItsField`, `KnowsImageSize` and `ChecksImageSize` of scene, lens
and sensor. If one is missing, the sensor makes the check when the light arrives. A lens may state
in the ledger how it treats light at the border (`StatesFieldBorder`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from ..plugins.protocols import (
    ChecksCameraField,
    ChecksFocalLength,
    ChecksImageSize,
    KnowsImageSize,
    KnowsItsField,
    StatesFieldBorder,
)

if TYPE_CHECKING:
    from ..plugins.protocols import Lens, Renderer, Scene


def camera_field(
    horizontal_field_deg: float, aspect: float, projection: str = "tangent"
) -> tuple[float, float, str]:
    """Return (width, height, projection) of a camera's field: tangents, or radians where
    `projection` is equidistant.

    Parameters
    ----------
    horizontal_field_deg : full horizontal angle of the field, degrees.
    aspect : width / height of the field, in the projection's unit.
    projection : tangent or equidistant.
    """
    half = math.radians(horizontal_field_deg) / 2
    width = 2 * (math.tan(half) if projection == "tangent" else half)
    return width, width / aspect, projection


PARAXIAL_FIELD = 1e-6  # tangent of a field so narrow that no lens distorts it


def check_fields(scene: Scene, lens: Lens, sensors: Iterable[Any]) -> None:
    """Raise ConfigError if a sensor is larger than the image of the camera's field, or its settings
    do not fit the lens. Nothing is checked if the field is not known in advance.

    Parameters
    ----------
    scene : scene of the run.
    lens : lens of the run.
    sensors : sensors of all cameras.
    """
    if not (isinstance(scene, KnowsItsField) and isinstance(lens, KnowsImageSize)):
        return
    size_m = lens.image_size_m(*scene.camera_field())
    for sensor in sensors:
        if isinstance(sensor, ChecksImageSize):
            sensor.check_field(*size_m)
        if isinstance(sensor, ChecksFocalLength):
            narrow_m, _ = lens.image_size_m(PARAXIAL_FIELD, PARAXIAL_FIELD, "tangent")
            sensor.check_focal_length(narrow_m / PARAXIAL_FIELD)


def check_rendered(scene: Scene, renderer: Renderer | None) -> None:
    """Raise ConfigError where a renderer cannot put its tiles on the camera's field."""
    if isinstance(scene, KnowsItsField) and isinstance(renderer, ChecksCameraField):
        renderer.check_field(*scene.camera_field())


def state_field(scene: Scene, lens: Lens) -> None:
    """Let a lens state in the ledger how it treats light at the border of the camera's field."""
    if isinstance(scene, KnowsItsField) and isinstance(lens, StatesFieldBorder):
        lens.state_field(*scene.camera_field())

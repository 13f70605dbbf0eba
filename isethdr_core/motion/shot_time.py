"""Shot time: how long the shot of all cameras takes, and how many pixels a field unit has."""

from __future__ import annotations

from typing import Any, NamedTuple

from ..errors import ConfigError
from ..pipeline.field_check import PARAXIAL_FIELD
from ..plugins.protocols import HasPixelPitch, KnowsImageSize, KnowsItsField, TimesItsShot


class ShotTime(NamedTuple):
    """The time of a shot, and the size of its finest pixels."""

    seconds: float  # from the start of the first exposure to the end of the last
    pixels_per_field: float  # pixels per unit of the field coordinates, on the axis


def shot_time(scene: Any, lens: Any, cameras: dict[str, Any]) -> ShotTime:
    """Return the time of the longest shot of all cameras, and their finest pixels.

    Parameters
    ----------
    scene : scene of the run.
    lens : lens of the run.
    cameras : {name of a camera: its sensor}.

    Raises
    ------
    ConfigError : scene, lens or a sensor does not state the data that this needs.
    """
    if not (isinstance(scene, KnowsItsField) and isinstance(lens, KnowsImageSize)):
        which = lens if isinstance(scene, KnowsItsField) else scene
        raise ConfigError(
            f"motion.within_exposure is set, but {type(which).__name__} does not state the size of"
            " its image, so the rows of the sensor are not known; expected a scene with"
            " `camera_field` and a lens with `image_size_m`; type motion.within_exposure=false"
        )
    size_m = lens.image_size_m(*scene.camera_field())
    narrow_m, _ = lens.image_size_m(PARAXIAL_FIELD, PARAXIAL_FIELD, "tangent")
    longest_s = 0.0
    finest_m = float("inf")
    for name, sensor in cameras.items():
        if not (isinstance(sensor, TimesItsShot) and isinstance(sensor, HasPixelPitch)):
            raise ConfigError(
                f"motion.within_exposure is set, but the sensor of camera {name!r}"
                f" ({type(sensor).__name__}) does not state how long its shot takes; expected"
                " `shot_time_s` and `pitch_um`; type motion.within_exposure=false"
            )
        longest_s = max(longest_s, sensor.shot_time_s(*size_m))
        finest_m = min(finest_m, sensor.pitch_um * 1e-6)
    return ShotTime(longest_s, narrow_m / PARAXIAL_FIELD / finest_m)

"""Work: the work of a stage relative to that in a stored run."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ...plugins.protocols import CountsPixels, KnowsImageSize, KnowsItsField
from .stages import IN_BANDS, MOTION, OF_CAMERA, camera_of, kind_of

if TYPE_CHECKING:
    from ..chain import Chain

PIXELS = "pixel_bytes"  # attribute of a run: {camera: memory of its pixels}
PARTS = "sub_frames"  # key for the number of sub-frames of a run to come
# settings on which the time of a stage depends most, besides those of its camera
SETTINGS = {
    "scene": ("scene",),
    "motion": ("renderer", "motion"),
    "lens": ("lens", "flare"),
    "isp": ("isp",),
    "metric": ("metric",),
    "draws": ("isp", "metric"),
    "scores": ("isp", "metric"),
}
SIDES = ("height", "width")  # settings that state the number of tiles


def pixel_bytes(chain: Chain) -> dict[str, float]:
    """Return {camera: memory of its pixels, bytes}, to which the time of its stages is
    proportional. Cameras that do not state it are left out.
    """
    if not (isinstance(chain.scene, KnowsItsField) and isinstance(chain.lens, KnowsImageSize)):
        return {}
    size_m = chain.lens.image_size_m(*chain.scene.camera_field())
    return {
        name: sensor.pixel_need(*size_m).size_bytes
        for name, sensor in chain.cameras.items()
        if isinstance(sensor, CountsPixels)
    }


def work_ratio(now: dict, stored: dict, stage: str) -> float | None:
    """Return the work of a stage in a run to come, relative to that in a stored run.

    It is None if only one of the two states its number of tiles. A scene that is read from a
    picture has this number in its file, not in its settings.

    Parameters
    ----------
    now, stored : {"config": plain data, PIXELS: {camera: bytes}}; earlier versions stored no
        pixels.
    stage : name of the stage: its kind, and the name of the component or camera.
    """
    kind = kind_of(stage)
    camera = camera_of(stage)
    settings = now["config"], stored["config"]
    if kind == "plan":
        return 1.0
    of_one_only = _states_size(settings[0]) != _states_size(settings[1])
    if kind not in OF_CAMERA:
        if of_one_only:
            return None
        parts = sub_frames(now) / sub_frames(stored) if kind == "lens" else 1.0
        return parts * size(settings[0], kind) / size(settings[1], kind)
    both_bytes = [run.get(PIXELS, {}).get(camera) for run in (now, stored)]
    if all(map(is_positive, both_bytes)):
        ratio = both_bytes[0] / both_bytes[1]
    elif of_one_only:
        return None
    else:
        ratio = size(settings[0], kind) / size(settings[1], kind)
    if kind == "draws":  # the first one is the picture itself
        more_draws = [max(config.get("draws", 2) - 1, 1) for config in settings]
        ratio *= more_draws[0] / more_draws[1]
    return ratio


def has_equal_settings(one: dict, other: dict, stage: str) -> bool:
    """Return whether two configurations agree in the settings on which the time of a stage depends
    most.

    Parameters
    ----------
    one, other : composed configs as plain data.
    stage : name of the stage.
    """
    return _settings(one, stage) == _settings(other, stage)


def size(config: dict, kind: str) -> float:
    """Return the quantity that the work of a stage up to the lens is proportional to: tiles, or
    tiles times bands.

    Parameters
    ----------
    config : composed config as plain data.
    kind : kind of the stage.
    """
    source = config.get("renderer") or config["scene"]
    return tile_count(source) * (band_count(source) if kind in IN_BANDS else 1)


def sub_frames(run: Mapping[str, Any]) -> int:
    """Return the number of sub-frames that a run has, or will have as far as is known.

    Parameters
    ----------
    run : attributes of a stored run, or those of a run to come with `PARTS`.
    """
    if MOTION in run:
        return len(run[MOTION]["moments_s"])
    return run.get(PARTS) or 1


def tile_count(source: Mapping[str, Any]) -> float:
    """Return the number of tiles; 1 if the settings of a renderer or scene do not state it."""
    sides = source.get("width"), source.get("height")
    return math.prod(sides) if all(map(is_positive, sides)) else 1.0


def band_count(source: Mapping[str, Any]) -> float:
    """Return the number of bands; 1 if the fields of a plugin's component do not give it."""
    first, last, step = (source.get(key) for key in ("first_nm", "last_nm", "step_nm"))
    valid = all(map(is_positive, (first, last, step))) and last >= first
    return 1 + (last - first) / step if valid else 1.0


def is_positive(value: Any) -> bool:
    """Return whether a value is a finite number above 0."""
    return isinstance(value, (int, float)) and 0 < value < math.inf


def _settings(config: dict, stage: str) -> list[Any]:
    """Return the settings on which the time of a stage depends most."""
    kind = kind_of(stage)
    settings = [config.get(part) for part in SETTINGS.get(kind, ())]
    if kind in OF_CAMERA:
        cameras = config.get("cameras") or {}
        settings.append(cameras.get(camera_of(stage), config.get("sensor")))
    return settings


def _states_size(config: dict) -> bool:
    """Return whether the settings of a run hold the number of its tiles."""
    source = config.get("renderer") or config["scene"]
    return all(is_positive(source.get(side)) for side in SIDES)

"""Settings: the table `motion` of a config."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from ..errors import ConfigError, did_you_mean

NODE = "motion"
SWITCH = "within_exposure"
LONGEST_STEP_PX = 1000.0
MOST_SUB_FRAMES = 1000


@dataclass(frozen=True)
class MotionSettings:
    """How finely motion during a shot is sampled."""

    step_px: float = 1.0  # largest motion from one sub-frame to the next, in pixels
    sub_frames: int | None = None  # number of sub-frames; None: `step_px` decides
    most_sub_frames: int = 65  # largest number of sub-frames if `step_px` decides

    def __post_init__(self) -> None:
        if not (_is_number(self.step_px) and 0 < self.step_px <= LONGEST_STEP_PX):
            raise ConfigError(
                f"motion.step_px is {self.step_px!r}; expected pixels above 0, at most"
                f" {LONGEST_STEP_PX:g}; type for example motion.step_px=1"
            )
        for name in ("sub_frames", "most_sub_frames"):
            value = getattr(self, name)
            if value is None and name == "sub_frames":
                continue
            whole = isinstance(value, int) and not isinstance(value, bool)
            if not (whole and 2 <= value <= MOST_SUB_FRAMES):
                raise ConfigError(
                    f"motion.{name} is {value!r}; expected a whole number from 2 to"
                    f" {MOST_SUB_FRAMES}; type for example motion.{name}=9"
                )

    def count(self, motion_px: float) -> int:
        """Return the number of sub-frames for a shot during which a tile moves by up to
        `motion_px`, at least 2.
        """
        if self.sub_frames is not None:
            return self.sub_frames
        steps = -(-motion_px // self.step_px)
        return int(min(max(steps + 1, 2), self.most_sub_frames))


def motion_settings(config: Mapping[str, Any]) -> MotionSettings | None:
    """Return the settings of a composed config; None if nothing moves during a shot.

    Raises
    ------
    ConfigError : no table, an unknown key, or an impossible value.
    """
    table = config.get(NODE) or {}
    if not isinstance(table, Mapping):
        raise ConfigError(
            f"{NODE} is {table!r}; expected a table; type for example {NODE}.{SWITCH}=true"
        )
    known = [SWITCH, *(field.name for field in fields(MotionSettings))]
    for key in table:
        if key not in known:
            raise ConfigError(
                f"{NODE} has no key {key!r}{did_you_mean(str(key), known)}; expected one of"
                f" {', '.join(known)}"
            )
    if not isinstance(on := table.get(SWITCH, False), bool):
        raise ConfigError(
            f"{NODE}.{SWITCH} is {on!r}; expected true or false; type for example"
            f" {NODE}.{SWITCH}=true"
        )
    defaults = asdict(MotionSettings())
    settings = MotionSettings(**{key: table.get(key, value) for key, value in defaults.items()})
    return settings if on else None


def without_motion(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of a run that name it: without the table `motion` if it is off, so that
    the run has the name of a still scene.
    """
    table = settings.get(NODE) or {}
    return {k: v for k, v in settings.items() if k != NODE or table.get(SWITCH, False)}


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)

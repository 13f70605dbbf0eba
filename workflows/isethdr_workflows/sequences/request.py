"""Request: the checked settings of a sequence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.sequence.exposure_control import ExposureControl

MOST_FRAMES = 100_000
LEAST_FRAMES_PER_SECOND = 0.1  # this and the next are the range of scene.frames_per_s of a street
MOST_FRAMES_PER_SECOND = 10_000.0
CONTROL = "exposure."  # before the names of the fields of `ExposureControl`
NUMBERS: dict[str, Callable[[str], float]] = {
    "frames": int,
    "frames_per_second": float,
    f"{CONTROL}share_per_frame": float,
    f"{CONTROL}delay_frames": int,
    f"{CONTROL}most_stops_per_frame": float,
}
NAME = "name"
ADDED = "+~"  # signs of overrides that add or remove a key; no setting of a sequence has one


@dataclass(frozen=True)
class Request:
    """The settings of a sequence."""

    overrides: tuple[str, ...] = ()  # overrides of all frames
    frames: int = 10
    frames_per_second: float = 30.0
    control: ExposureControl = field(default_factory=ExposureControl)
    name: str = ""  # empty: derived from the settings

    def __post_init__(self) -> None:
        if not 1 <= self.frames <= MOST_FRAMES:
            raise ConfigError(
                f"frames is {self.frames!r}; expected a whole number from 1 to {MOST_FRAMES}; type"
                " for example frames=10"
            )
        if not LEAST_FRAMES_PER_SECOND <= self.frames_per_second <= MOST_FRAMES_PER_SECOND:
            raise ConfigError(
                f"frames_per_second is {self.frames_per_second!r}; expected"
                f" {LEAST_FRAMES_PER_SECOND:g} to {MOST_FRAMES_PER_SECOND:g}; type for example"
                " frames_per_second=30"
            )

    def typed(self) -> tuple[str, ...]:
        """Return all settings that determine the sequence, in the form in which they are typed."""
        control = {
            f"{CONTROL}share_per_frame": self.control.share_per_frame,
            f"{CONTROL}delay_frames": self.control.delay_frames,
            f"{CONTROL}most_stops_per_frame": self.control.most_stops_per_frame,
        }
        own = {"frames": self.frames, "frames_per_second": self.frames_per_second} | control
        return (*(f"{k}={v}" for k, v in own.items() if v != inf), *self.overrides)


def request_of(settings: Sequence[str]) -> Request:
    """Return the request of a command line.

    Parameters
    ----------
    settings : settings as typed, key=value: those of a sequence, and overrides of all frames.

    Raises
    ------
    ConfigError : a value is not a number or out of its range, or a setting is misspelt.
    """
    own: dict[str, Any] = {}
    overrides = []
    name = ""
    for text in settings:
        key, _, value = text.partition("=")
        if key == NAME:
            name = value
        elif key in NUMBERS:
            own[key] = _number(key, value)
        elif key.lstrip(ADDED).startswith(CONTROL) or key.lstrip(ADDED) in NUMBERS:
            raise ConfigError(
                f"a sequence has no setting {key!r}{did_you_mean(key, NUMBERS)}; expected one of"
                f" {', '.join(NUMBERS)}"
            )
        else:
            overrides.append(text)
    control = {k.removeprefix(CONTROL): v for k, v in own.items() if k.startswith(CONTROL)}
    rest = {k: v for k, v in own.items() if not k.startswith(CONTROL)}
    return Request(tuple(overrides), control=ExposureControl(**control), name=name, **rest)


def _number(key: str, value: str) -> float:
    try:
        return NUMBERS[key](value)
    except ValueError:
        whole = "a whole number" if NUMBERS[key] is int else "a number"
        raise ConfigError(
            f"{key} is {value!r}; expected {whole}; type for example {key}=1"
        ) from None

"""Clock: progress of a training in steps or minutes, counted over restarts."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field

from isethdr_core.cli.terminal import number_of
from isethdr_core.errors import ConfigError

WARM_UP_STEPS = 200  # number of first steps over which the learning rate rises
LAST_RATE = 0.02  # last learning rate over the largest one


@dataclass(frozen=True)
class Length:
    """Length of a training, in minutes of computing or in steps; the other one is 0."""

    minutes: float = 0.0
    steps: int = 0

    def __post_init__(self) -> None:
        """Refuse negative numbers, and a length that has both or neither of the two."""
        for name in ("minutes", "steps"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0):
                raise ConfigError(
                    f"{name} is {value!r}; expected a number above 0; type for example {name}=20"
                )
        if (self.minutes > 0) == (self.steps > 0):
            raise ConfigError(
                f"the length is minutes={self.minutes:g} steps={self.steps}; expected one of them;"
                " type for example minutes=30 or steps=5000"
            )

    def __str__(self) -> str:
        return f"{self.minutes:g} minutes" if self.minutes else number_of(self.steps, "step")


@dataclass
class Clock:
    """Progress of a training.

    Parameters
    ----------
    length : length of the whole training.
    step : number of steps done, over all starts.
    seconds_before : computing time of earlier starts, s.
    started : time of this start by the monotonic clock, s.
    """

    length: Length
    step: int = 0
    seconds_before: float = 0.0
    started: float = field(default_factory=time.monotonic)

    def seconds(self) -> float:
        """Return the computing time over all starts, s."""
        return self.seconds_before + time.monotonic() - self.started

    def share(self) -> float:
        """Return the share of the training that is done, 0 to 1."""
        if self.length.steps:
            return min(self.step / self.length.steps, 1.0)
        return min(self.seconds() / (60 * self.length.minutes), 1.0)

    def rate_factor(self) -> float:
        """Return the learning rate over the largest one: a linear rise, times half a cosine."""
        rise = min(1.0, (self.step + 1) / self.warm_up())
        return rise * (LAST_RATE + (1 - LAST_RATE) * math.cos(math.pi / 2 * self.share()) ** 2)

    def warm_up(self) -> float:
        """Return the number of steps over which the learning rate rises."""
        steps = self.length.steps
        return min(WARM_UP_STEPS, max(steps / 10, 1)) if steps else WARM_UP_STEPS

"""Error costs: the CPU time that a smaller error takes, and the division of an error budget at the
least cost.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

Key = TypeVar("Key")


@dataclass(frozen=True)
class Cost:
    """CPU seconds as a power law: seconds x value^-power. With `power` 0, each reduction of the
    value by a factor e costs `seconds`.

    Parameters
    ----------
    seconds : CPU seconds at the value 1, for a million values (tiles x bands). For a knob outside
        the budget only ratios count, so 1.0 is enough.
    power : above 0 if small values are expensive (an error), below 0 if large values are (samples).
    """

    seconds: float
    power: float = 0.0

    def of(self, value: float) -> float:
        """Return the seconds of a value above 0; for `power` 0, up to an additive constant."""
        return self.seconds * (value**-self.power if self.power else -math.log(value))


# CPU seconds of rounding stored radiance, for a million values; measured, see
# docs/explanation/budget.md.
STORE_COST = Cost(0.007)
# Share of this rounding in the error that a config allows, for light with the costs of the bundled
# lenses. Light without a declared cost gets the rest.
STORE = 0.10925760665975137
# Shares are computed for this fraction of the noise. They hardly depend on it.
USUAL = 0.1


def divided(allowed: float, costs: Mapping[Key, Cost]) -> dict[Key, float]:
    """Return the errors with the sum `allowed` that together cost least.

    At the least total cost, a small increase of any one error saves the same time (Lagrange):
    -cost'(e) = rate. So e = (seconds x power / rate)^(1 / (1 + power)), or seconds / rate for
    `power` 0. The sum of the errors decreases as the rate increases.
    """

    def errors(log_rate: float) -> dict[Key, float]:
        return {
            k: math.exp((math.log(c.seconds * (c.power or 1.0)) - log_rate) / (1 + c.power))
            for k, c in costs.items()
        }

    # by bisection: importing SciPy's root finders would add 0.2 s to every command that only plans
    low = -700.0
    high = 700.0
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if sum(errors(middle).values()) > allowed else (low, middle)
    return errors(high)

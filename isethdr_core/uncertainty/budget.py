"""Accuracy: what a run may be wrong by, as a share of the sensor's noise, and how the stages share
it at the least cost.

config node `accuracy`:
  noise_fraction_allowed  of the noise's standard deviation, per pixel: for everything after the
  stored radiance render_error_allowed    relative noise of each light group; null leaves it to the
  renderer's own fields
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..errors import ConfigError
from ..pipeline.demand import Demand
from . import ledger


@dataclass(frozen=True)
class Cost:
    """What an error costs: seconds x error^-power, or where `power` is 0 so many seconds for every
    factor e that it is less.
    """

    seconds: float
    power: float = 0.0

    def of(self, error: float) -> float:
        """Return the seconds of an error, but for a constant."""
        return self.seconds * (error**-self.power if self.power else -math.log(error))


def divided(allowed: float, costs: dict[str, Cost]) -> dict[str, float]:
    """Return the errors, `allowed` in all, that cost least.

    Lagrange: at the least total every stage gains as much from a little more error, -cost'(e) =
    rate, so that e = (seconds x power / rate)^(1 / (1 + power)), or seconds / rate. The sum falls
    with the rate.
    """

    def errors(log_rate: float) -> dict[str, float]:
        return {
            k: math.exp((math.log(c.seconds * (c.power or 1.0)) - log_rate) / (1 + c.power))
            for k, c in costs.items()
        }

    # by halving: SciPy's root finders would add 0.2 s to every command that only plans
    low, high = -700.0, 700.0
    for _ in range(80):
        middle = (low + high) / 2
        low, high = (middle, high) if sum(errors(middle).values()) > allowed else (low, middle)
    return errors(high)


# The rounding of stored radiance has this share of what a config allows; all after it has the rest.
# It costs the least together with the costs of the bundled lenses, which state their own division
# of the rest (`isethdr_optics.imaging.accuracy_shares`) and test this figure.
STORE = 0.10925760665975137


@dataclass(frozen=True)
class Allowed:
    """What the config node `accuracy` allows."""

    noise_fraction: float = 0.1
    render_error: float | None = None


def allowed(config: Mapping[str, Any]) -> Allowed:
    """Return what a composed config allows; ConfigError for a share that is no number above 0."""
    node = config.get("accuracy") or {}
    known = ("noise_fraction_allowed", "render_error_allowed")
    for key in node:
        if key not in known:
            raise ConfigError(f"accuracy has no key {key!r}; expected {' or '.join(known)}")
    fraction, render = node.get(known[0], Allowed.noise_fraction), node.get(known[1])
    _check(
        known[0],
        fraction,
        1.0,
        "a share of the sensor's noise above 0, at most 1: no error at all takes for ever",
        "0.1",
    )
    if render is not None:
        _check(known[1], render, 1.0, "a relative noise above 0 and at most 1, or null", "0.1")
    return Allowed(float(fraction), None if render is None else float(render))


def _check(name: str, value: object, most: float, expected: str, example: str) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= most:
        raise ConfigError(
            f"accuracy.{name} is {value!r}; expected {expected}; type accuracy.{name}={example}"
        )


def with_render_error(renderer: Any, given: Allowed) -> Any:
    """Return the renderer told to go on until its noise is allowed; ConfigError where it cannot be
    told, or is told otherwise.
    """
    if given.render_error is None:
        return renderer
    if renderer is None:
        raise ConfigError(
            "accuracy.render_error_allowed is set, but the run has no renderer; type"
            " accuracy.render_error_allowed=null"
        )
    if "error_allowed" not in {f.name for f in dataclasses.fields(renderer)}:
        raise ConfigError(
            f"accuracy.render_error_allowed is set, but {type(renderer).__name__} has no field"
            " error_allowed; choose another renderer, or type accuracy.render_error_allowed=null"
        )
    if renderer.error_allowed not in (None, given.render_error):
        raise ConfigError(
            f"renderer.error_allowed is {renderer.error_allowed!r}, accuracy.render_error_allowed"
            f" {given.render_error!r}; set one of them"
        )
    return replace(renderer, error_allowed=given.render_error)


def budgeted(demand: Demand, given: Allowed) -> Demand:
    """Return the demand with the error allowed of all light after the radiance, in the sensors'
    terms and relative.

    Sensors without noise put no response into the demand: nothing is small beside their noise, and
    light is asked for exactly.
    """
    if demand.response is None:
        return demand
    whole = replace(demand.response, noise_fraction_allowed=given.noise_fraction)
    ledger.error(
        whole.error_allowed,
        "relative",
        "bound",
        f"allowed of light after the radiance: {given.noise_fraction:g} of the noise at full scale",
    )
    response = replace(whole, noise_fraction_allowed=(1 - STORE) * given.noise_fraction)
    ledger.error(
        STORE * whole.error_allowed,
        "relative",
        "bound",
        f"of it for the store's rounding, {STORE * given.noise_fraction:.2g} of the noise",
    )
    ledger.error(
        response.error_allowed,
        "relative",
        "bound",
        f"of it for lens and flares, {response.noise_fraction_allowed:.2g} of the noise",
    )
    return replace(demand, response=response, error_allowed=response.error_allowed)


def stored_error(demand: Demand) -> float:
    """Return the relative error that a store's rounding may have, 0 where no sensor says what it
    can tell.
    """
    return demand.error_allowed * STORE / (1 - STORE)

"""Error budget: the error that a run may have, relative to the sensor's noise, and its division
over the stages at the least cost.

Config node `accuracy`:

noise_fraction_allowed : share of the standard deviation of the noise, per pixel, that all stages
    after the stored radiance may add.
render_error_allowed : relative noise of each light group; null: the fields of the renderer decide.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ..data.error_costs import STORE, STORE_COST, USUAL, Cost, divided
from ..errors import ConfigError
from ..pipeline.demand import Demand
from ..plugins.accuracy_knobs import ErrorShare, knobs_of
from . import ledger

# keys of the shares with costs that the core knows
STORE_KEY = "store"
LIGHT_KEY = "light"


@dataclass(frozen=True)
class Spending:
    """One error of a component that takes a share of the error allowed.

    Parameters
    ----------
    kind : kind of the component.
    who : kind and name of the component, for people.
    share : cost of an error, or the share that is reserved.
    field : field of the component that takes the share; "": the component divides the share itself.
    """

    kind: str
    who: str
    share: ErrorShare
    field: str = ""


@dataclass(frozen=True)
class Division:
    """Shares of the error allowed, 1 in all."""

    store: float  # rounding of stored radiance
    light: float  # share of lens and flares
    by_field: dict[tuple[str, str], float] = field(default_factory=dict)  # {(who, field): share}


def division(spending: Sequence[Spending] = ()) -> Division:
    """Return the division of the error allowed, over the store and `spending`, at the least cost.

    A lens that declares no cost gets the usual 89 %, and the store the rest.

    Raises
    ------
    ConfigError : components reserve all of the error allowed.
    """
    if not spending:
        return Division(STORE, 1 - STORE)
    costs: dict[Any, Cost] = {STORE_KEY: STORE_COST}
    if not any(spender.kind == "lens" for spender in spending):
        costs[LIGHT_KEY] = Cost(STORE_COST.seconds * (1 - STORE) / STORE)
    costs |= {
        k: spender.share.cost
        for k, spender in enumerate(spending)
        if spender.share.cost is not None
    }
    reserved = {
        k: spender.share.reserved
        for k, spender in enumerate(spending)
        if spender.share.cost is None
    }
    if sum(reserved.values()) >= 1:
        listed = ", ".join(f"{spending[k].who} {share:g}" for k, share in reserved.items())
        raise ConfigError(
            f"components reserve all of the error allowed ({listed}); leave one of them out"
        )
    bought = divided(USUAL * (1 - sum(reserved.values())), costs)
    shares = {key: error / USUAL for key, error in bought.items()} | reserved
    by_field = {
        (spender.who, spender.field): shares[k]
        for k, spender in enumerate(spending)
        if spender.field
    }
    light = sum(shares[k] for k, spender in enumerate(spending) if spender.kind == "lens")
    return Division(shares[STORE_KEY], shares.get(LIGHT_KEY, 0.0) + light, by_field)


@dataclass(frozen=True)
class Allowed:
    """What the config node `accuracy` allows."""

    noise_fraction: float = 0.1
    render_error: float | None = None


def allowed(config: Mapping[str, Any]) -> Allowed:
    """Return what a composed config allows; ConfigError for a share that is no number above 0."""
    node = config.get("accuracy") or {}
    names = ("noise_fraction_allowed", "render_error_allowed")
    if not isinstance(node, Mapping):
        raise ConfigError(
            f"accuracy is {node!r}; expected {' or '.join(names)} below it; type for example"
            f" accuracy.{names[0]}={Allowed.noise_fraction}"
        )
    for key in node:
        if key not in names:
            raise ConfigError(f"accuracy has no key {key!r}; expected {' or '.join(names)}")
    fraction = node.get(names[0], Allowed.noise_fraction)
    render = node.get(names[1])
    _check(
        names[0],
        fraction,
        1.0,
        "a share of the sensor's noise above 0, at most 1: no error at all takes for ever",
        "0.1",
    )
    if render is not None:
        _check(names[1], render, 1.0, "a relative noise above 0 and at most 1, or null", "0.1")
    return Allowed(float(fraction), None if render is None else float(render))


def _check(name: str, value: object, most: float, expected: str, example: str) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= most:
        raise ConfigError(
            f"accuracy.{name} is {value!r}; expected {expected}; type accuracy.{name}={example}"
        )


def renderer_with_error(renderer: Any, allowed: Allowed) -> Any:
    """Return the renderer with the error that a run allows.

    The error is set in the field that the renderer declares as a budgeted knob, or else in its
    field `error_allowed`.

    Raises
    ------
    ConfigError : the run has no renderer, the renderer has no such field, or the field has another
        value.
    """
    if allowed.render_error is None:
        return renderer
    if renderer is None:
        raise ConfigError(
            "accuracy.render_error_allowed is set, but the run has no renderer; type"
            " accuracy.render_error_allowed=null"
        )
    name = next((k.field for k in knobs_of(renderer) if k.budgeted), "error_allowed")
    if name not in {f.name for f in dataclasses.fields(renderer)}:
        raise ConfigError(
            f"accuracy.render_error_allowed is set, but {type(renderer).__name__} has no field"
            f" {name}; choose another renderer, or type accuracy.render_error_allowed=null"
        )
    now = getattr(renderer, name)
    if now not in (None, allowed.render_error):
        raise ConfigError(
            f"renderer.{name} is {now!r}, accuracy.render_error_allowed"
            f" {allowed.render_error!r}; set one of them"
        )
    return replace(renderer, **{name: allowed.render_error})


def budgeted(demand: Demand, allowed: Allowed, shares: Division | None = None) -> Demand:
    """Return the demand with the error allowed of all light after the radiance.

    The error is given as a share of the sensors' noise and as a relative error. Sensors without
    noise put no response into the demand; light is then computed exactly.

    Parameters
    ----------
    demand : demand with the response of the sensors.
    allowed : share of the sensors' noise that a config allows.
    shares : division of the error allowed; None: the usual share for the store, and the rest for
        the lens.
    """
    if demand.response is None:
        return demand
    shares = shares or division()
    full_response = replace(demand.response, noise_fraction_allowed=allowed.noise_fraction)
    ledger.error(
        full_response.error_allowed,
        "relative",
        "bound",
        f"error allowed after the radiance: {allowed.noise_fraction:g} of the noise at full scale",
    )
    response = replace(full_response, noise_fraction_allowed=shares.light * allowed.noise_fraction)
    stored = shares.store * full_response.error_allowed
    ledger.error(
        stored,
        "relative",
        "bound",
        f"share of the rounding of the store: {shares.store * allowed.noise_fraction:.2g} of the"
        " noise",
    )
    ledger.error(
        response.error_allowed,
        "relative",
        "bound",
        f"share of lens and flares: {response.noise_fraction_allowed:.2g} of the noise",
    )
    for (who, name), share in shares.by_field.items():
        label = f"share of {who}: {share * allowed.noise_fraction:.2g} of the noise, set as {name}"
        ledger.error(share * full_response.error_allowed, "relative", "bound", label)
    return replace(
        demand,
        response=response,
        error_allowed=response.error_allowed,
        stored_error_allowed=stored,
    )


def stored_error(demand: Demand) -> float:
    """Return the relative error allowed for the rounding of a store; 0 without sensor response."""
    return demand.stored_error_allowed

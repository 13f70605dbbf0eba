"""Accuracy: what a run may be wrong by, as a share of the sensor's noise, and how the stages share
it at the least cost.

config node `accuracy`:
  noise_fraction_allowed  of the noise's standard deviation, per pixel: for everything after the
  stored radiance render_error_allowed    relative noise of each light group; null leaves it to the
  renderer's own fields
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

STORE_KEY, LIGHT_KEY = "store", "light"  # whose costs the core knows


@dataclass(frozen=True)
class Spending:
    """What one component spends the error allowed on.

    Parameters
    ----------
    kind : of the component. `who` : its kind and name, for people.
    share : cost of an error, or the share that is reserved.
    field : of the component that takes the share; "": the component divides it by itself.
    """

    kind: str
    who: str
    share: ErrorShare
    field: str = ""


@dataclass(frozen=True)
class Division:
    """Shares of the error allowed, 1 in all."""

    store: float  # rounding of stored radiance
    light: float  # what the lens is told
    told: dict[tuple[str, str], float] = field(default_factory=dict)  # {(who, field): share}


def division(spending: Sequence[Spending] = ()) -> Division:
    """Return the cheapest division of the error allowed over the store and all that spend it.

    A lens that declares no cost is taken for one whose cost leaves it the usual 89 % beside the
    store.

    Raises
    ------
    ConfigError : components reserve all of the error allowed.
    """
    if not spending:
        return Division(STORE, 1 - STORE)
    costs: dict[Any, Cost] = {STORE_KEY: STORE_COST}
    if not any(one.kind == "lens" for one in spending):
        costs[LIGHT_KEY] = Cost(STORE_COST.seconds * (1 - STORE) / STORE)
    costs |= {k: one.share.cost for k, one in enumerate(spending) if one.share.cost is not None}
    reserved = {k: one.share.reserved for k, one in enumerate(spending) if one.share.cost is None}
    if sum(reserved.values()) >= 1:
        listed = ", ".join(f"{spending[k].who} {share:g}" for k, share in reserved.items())
        raise ConfigError(
            f"components reserve all of the error allowed ({listed}); leave one of them out"
        )
    bought = divided(USUAL * (1 - sum(reserved.values())), costs)
    shares = {key: error / USUAL for key, error in bought.items()} | reserved
    told = {(one.who, one.field): shares[k] for k, one in enumerate(spending) if one.field}
    light = sum(shares[k] for k, one in enumerate(spending) if one.kind == "lens")
    return Division(shares[STORE_KEY], shares.get(LIGHT_KEY, 0.0) + light, told)


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

    It is told in the field that it declares as a budgeted knob, else in one named `error_allowed`.
    """
    if given.render_error is None:
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
    if now not in (None, given.render_error):
        raise ConfigError(
            f"renderer.{name} is {now!r}, accuracy.render_error_allowed"
            f" {given.render_error!r}; set one of them"
        )
    return replace(renderer, **{name: given.render_error})


def budgeted(demand: Demand, allowed: Allowed, shares: Division | None = None) -> Demand:
    """Return the demand with the error allowed of all light after the radiance, in the sensors'
    terms and relative.

    Sensors without noise put no response into the demand: nothing is small beside their noise, and
    light is asked for exactly.

    Parameters
    ----------
    demand : with the response of the sensors.
    allowed : share of the sensors' noise that a config allows.
    shares : who has how much of it; None: the store its own, and the lens the rest.
    """
    if demand.response is None:
        return demand
    shares = shares or division()
    whole = replace(demand.response, noise_fraction_allowed=allowed.noise_fraction)
    ledger.error(
        whole.error_allowed,
        "relative",
        "bound",
        f"allowed of light after the radiance: {allowed.noise_fraction:g} of the noise at full"
        " scale",
    )
    response = replace(whole, noise_fraction_allowed=shares.light * allowed.noise_fraction)
    stored = shares.store * whole.error_allowed
    ledger.error(
        stored,
        "relative",
        "bound",
        f"of it for the store's rounding, {shares.store * allowed.noise_fraction:.2g} of the noise",
    )
    ledger.error(
        response.error_allowed,
        "relative",
        "bound",
        f"of it for lens and flares, {response.noise_fraction_allowed:.2g} of the noise",
    )
    for (who, name), share in shares.told.items():
        label = f"of it for {who}, {share * allowed.noise_fraction:.2g} of the noise, as {name}"
        ledger.error(share * whole.error_allowed, "relative", "bound", label)
    return replace(
        demand,
        response=response,
        error_allowed=response.error_allowed,
        stored_error_allowed=stored,
    )


def stored_error(demand: Demand) -> float:
    """Return the relative error that a store's rounding may have, 0 where no sensor says what it
    can tell.
    """
    return demand.stored_error_allowed

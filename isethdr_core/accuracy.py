"""Accuracy: what a run may be wrong by, as a share of the sensor's noise, and how the stages after the radiance share it.

config node `accuracy`:
  noise_fraction_allowed  of the noise's standard deviation, per pixel: for everything after the stored radiance
  render_error_allowed    relative noise of each light group; null leaves it to the renderer's own fields
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, replace

from . import ledger
from .demand import Demand
from .errors import ConfigError

# Shares of the fraction. Light goes through a lens in one of two ways, so that only stages of the same way share. Measured
# (docs/accuracy.md): on either way the seconds are the same from a hundredth of the noise to all of it, because the fewest
# functionals, and the plain transform, are already 1e3 times better than asked for. Nothing is to be had by a finer division:
# functionals get most, as they are what grows on scenes of many spectra; the rounding of transforms cannot be bought, only checked.
FUNCTIONALS, TRANSFORMS = 0.9, 0.1  # the short way: photocurrent
CONVOLUTION = 1.0                   # the long way: irradiance, band by band


@dataclass(frozen=True)
class Allowed:
    """What the config node `accuracy` allows."""

    noise_fraction: float = 0.1
    render_error: float | None = None


def allowed(config) -> Allowed:
    """Return what a composed config allows; ConfigError for a share that is no number above 0."""
    node = config.get("accuracy") or {}
    known = ("noise_fraction_allowed", "render_error_allowed")
    for key in node:
        if key not in known:
            raise ConfigError(f"accuracy has no key {key!r}; expected {' or '.join(known)}")
    fraction, render = node.get(known[0], Allowed.noise_fraction), node.get(known[1])
    _check(known[0], fraction, 1.0, "a share of the sensor's noise above 0, at most 1: no error at all takes for ever", "0.1")
    if render is not None:
        _check(known[1], render, 1.0, "a relative noise above 0 and at most 1, or null", "0.1")
    return Allowed(float(fraction), None if render is None else float(render))


def _check(name, value, most, expected, example):
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value <= most:
        raise ConfigError(f"accuracy.{name} is {value!r}; expected {expected}; type accuracy.{name}={example}")


def with_render_error(renderer, given: Allowed):
    """Return the renderer told to go on until its noise is allowed; ConfigError where it cannot be told, or is told otherwise."""
    if given.render_error is None:
        return renderer
    if renderer is None:
        raise ConfigError("accuracy.render_error_allowed is set, but the run has no renderer; type accuracy.render_error_allowed=null")
    if "error_allowed" not in {f.name for f in dataclasses.fields(renderer)}:
        raise ConfigError(f"accuracy.render_error_allowed is set, but {type(renderer).__name__} has no field error_allowed; "
                          "choose another renderer, or type accuracy.render_error_allowed=null")
    if renderer.error_allowed not in (None, given.render_error):
        raise ConfigError(f"renderer.error_allowed is {renderer.error_allowed!r}, accuracy.render_error_allowed {given.render_error!r}; "
                          "set one of them")
    return replace(renderer, error_allowed=given.render_error)


def budgeted(demand: Demand, given: Allowed) -> Demand:
    """Return the demand with the error allowed of all light after the radiance, in the sensors' terms and relative.

    Sensors without noise put no response into the demand: nothing is small beside their noise, and light is asked for exactly.
    """
    if demand.response is None:
        return demand
    response = replace(demand.response, noise_fraction_allowed=given.noise_fraction)
    ledger.error(response.error_allowed, "relative", "bound", f"allowed of light after the radiance: {given.noise_fraction:g} of the noise at full scale")
    return replace(demand, response=response, error_allowed=response.error_allowed)

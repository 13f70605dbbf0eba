"""The calls that each kind of component must have, and the abilities that it may have."""

from __future__ import annotations

from . import (
    any_kind,
    flares,
    isps,
    lens_plans,
    lenses,
    lightings,
    metrics,
    renderers,
    scenes,
    sensors,
)

REQUIRED: dict[str, type] = {  # a flare has at least one of `FLARES` instead
    "scene": scenes.Scene,
    "renderer": renderers.Renderer,
    "lighting": lightings.Lighting,
    "lens": lenses.Lens,
    "sensor": sensors.Sensor,
    "isp": isps.Isp,
    "metric": metrics.Metric,
}
FLARES = flares.ABILITIES
OF_ANY_KIND = any_kind.ABILITIES
OPTIONAL: dict[str, tuple[type, ...]] = {
    "scene": scenes.ABILITIES,
    "renderer": renderers.ABILITIES,
    "lighting": lightings.ABILITIES,
    "lens": lenses.ABILITIES,
    "flare": flares.ABILITIES,
    "sensor": sensors.ABILITIES,
    "isp": isps.ABILITIES,
    "metric": metrics.ABILITIES,
}
# abilities in the form of earlier versions, accepted until version 1.0
EARLIER: tuple[type, ...] = (lenses.CountsKernels, lens_plans.StatesSpreadErrors)


def required_of(kind: str) -> tuple[type, ...]:
    """Return the Protocols that every component of a kind follows."""
    return (REQUIRED[kind],) if kind in REQUIRED else ()


def abilities_of(kind: str) -> tuple[type, ...]:
    """Return the Protocols of all abilities that a component of a kind may have."""
    return (*OPTIONAL[kind], *OF_ANY_KIND)

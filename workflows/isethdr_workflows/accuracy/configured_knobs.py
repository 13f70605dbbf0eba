"""Configured knobs: what the components of one composed configuration declare, and the
configurations that a study measures.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from omegaconf import OmegaConf

from isethdr_core.config.composition import user_mistakes
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.pipeline.chain import Chain, chain
from isethdr_core.plugins.accuracy_knobs import AccuracyKnob, knobs_of, shares_of
from isethdr_core.uncertainty.error_terms import Quantity

# the run's own: what all components spend together
ALLOWED = AccuracyKnob("noise_fraction_allowed", (0.3, 0.1, 0.03, 0.01), Quantity.ELECTRONS)


@dataclass(frozen=True)
class Found:
    """A knob of one component of a configuration.

    Parameters
    ----------
    path : of the component in the config, for example `flare.dirt`.
    kind : of the component, whose stage is measured.
    knob : as declared, or with the values that a user named.
    now : the value that the configuration has; None where the component decides by itself.
    reference : {path in the config: value} of the configuration that the others are judged by.
    exact : the reference leaves nothing out.
    """

    path: str
    kind: str
    knob: AccuracyKnob
    now: Any = None
    reference: dict[str, Any] = field(default_factory=dict)
    exact: bool = False

    @property
    def name(self) -> str:
        """What a user types to set it."""
        return f"{self.path}.{self.knob.field}"

    def values(self) -> list[Any]:
        """Return the values to measure, from the cheapest to the finest, the present one among
        them.
        """
        found = list(self.knob.tried())
        if self.now is None or self.now in found:
            return found
        numbers = all(isinstance(v, int | float) for v in (*found, self.now))
        if not numbers:
            return [*found, self.now]
        return sorted([*found, self.now], reverse=found[0] > found[-1])


@dataclass(frozen=True, eq=False)
class Setting:
    """One configuration to measure."""

    config: Any
    parts: Chain


def components(config: Any, parts: Chain) -> Iterator[tuple[str, str, Any]]:
    """Yield (path in the config, kind, component) of a chain."""
    for kind in ("scene", "renderer", "lighting", "lens", "isp"):
        component = getattr(parts, kind)
        if component is not None:
            yield kind, kind, component
    for name, component in parts.flares.items():
        yield f"flare.{name}", "flare", component
    for name, component in parts.cameras.items():
        yield ("sensor" if config.get("sensor") else f"cameras.{name}"), "sensor", component
    for name, component in parts.metrics.items():
        yield f"metric.{name}", "metric", component


def find(config: Any, parts: Chain) -> list[Found]:
    """Return every knob of a configuration that changes something in it.

    Raises
    ------
    ConfigError : no component declares one.
    """
    found, silent = [], []
    for path, kind, component in components(config, parts):
        for knob in knobs_of(component):
            if knob.matters is None or knob.matters(component):
                reference = _below(path, {knob.field: knob.finest(), **knob.independent})
                now = getattr(component, knob.field)
                found.append(Found(path, kind, knob, now, reference))
        if not knobs_of(component):
            silent.append(f"{path}={type(component).__name__}")
    if not found:
        raise ConfigError(
            "no component of this configuration declares an accuracy knob that changes anything in"
            f" it ({', '.join(silent)}); expected `accuracy_knobs` on one of them"
            " (docs/how-to/plugins.md); type for example lens=diffraction_limited"
        )
    told = parts.shares is not None and parts.shares.told
    if shares_of(parts.lens) or told:
        finest: dict[str, Any] = {}
        for one in found:
            finest |= one.reference if one.kind in ("lens", "flare") else {}
        now = parts.allowed.noise_fraction
        found.append(Found("accuracy", "lens", ALLOWED, now, finest, exact=True))
    return found


def chosen(found: Sequence[Found], name: str, values: str) -> list[Found]:
    """Return the knob that a user names, with the values that the user names, or all knobs.

    Raises
    ------
    ConfigError : no such knob, or values without a knob.
    """
    if not name:
        if values:
            raise ConfigError(
                f"study accuracy has values={values} and no knob; type knob={found[0].name}"
            )
        return list(found)
    names = [one.name for one in found]
    if name not in names:
        raise ConfigError(f"study accuracy has no knob {name!r}{did_you_mean(name, names)}")
    one = found[names.index(name)]
    if not values:
        return [one]
    try:
        listed = tuple(OverridesParser.create().parse_override(f"values=[{values}]").value())
    except HydraException:
        listed = ()
    if not listed:
        raise ConfigError(
            f"values={values} cannot be read; expected values from the cheapest to the finest; type"
            f" for example values={','.join(map(str, one.knob.tried()))}"
        )
    return [replace(one, knob=replace(one.knob, values=listed))]


def setting(config: Any, one: Found, changes: dict[str, Any]) -> Setting:
    """Return the configuration with changed values, its components built and checked.

    Raises
    ------
    ConfigError : a component refuses a value.
    """
    changed = copy.deepcopy(config)
    try:
        with user_mistakes():
            for path, value in changes.items():
                OmegaConf.update(changed, path, value)
            return Setting(changed, chain(changed))
    except ConfigError as err:
        listed = " ".join(f"{path}={value}" for path, value in changes.items())
        raise ConfigError(
            f"the knob {one.name} cannot be set to {listed}: {err}; type"
            f" knob={one.name} values=... with values that it takes, from the cheapest to the"
            " finest"
        ) from None


def _below(path: str, fields: dict[str, Any]) -> dict[str, Any]:
    return {f"{path}.{name}": value for name, value in fields.items()}

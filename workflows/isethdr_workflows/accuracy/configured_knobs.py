"""Configured knobs: the knobs that the components of one composed configuration declare, and the
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

# the knob of the run itself: the error that all components together may cause
ALLOWED = AccuracyKnob("noise_fraction_allowed", (0.3, 0.1, 0.03, 0.01), Quantity.ELECTRONS)


@dataclass(frozen=True)
class ConfiguredKnob:
    """A knob of one component of a configuration.

    Parameters
    ----------
    path : path of the component in the config, for example `flare.dirt`.
    kind : kind of the component; the cost of its stage is measured.
    knob : the knob as declared, or with the values that a user typed.
    now : the value in the configuration; None if the component decides.
    reference : {path in the config: value} of the reference configuration.
    exact : whether the reference leaves nothing out.
    """

    path: str
    kind: str
    knob: AccuracyKnob
    now: Any = None
    reference: dict[str, Any] = field(default_factory=dict)
    exact: bool = False

    @property
    def name(self) -> str:
        """The text that a user types to set the knob."""
        return f"{self.path}.{self.knob.field}"

    def values(self) -> list[Any]:
        """Return the values to measure, from the cheapest to the finest, including the present
        value.
        """
        values = list(self.knob.tried())
        if self.now is None or self.now in values:
            return values
        numbers = all(isinstance(v, int | float) for v in (*values, self.now))
        if not numbers:
            return [*values, self.now]
        return sorted([*values, self.now], reverse=values[0] > values[-1])


@dataclass(frozen=True, eq=False)
class Setting:
    """One configuration to measure."""

    config: Any
    parts: Chain


def components(config: Any, chain: Chain) -> Iterator[tuple[str, str, Any]]:
    """Yield (path in the config, kind, component) of a chain."""
    for kind in ("scene", "renderer", "lighting", "lens", "isp"):
        component = getattr(chain, kind)
        if component is not None:
            yield kind, kind, component
    for name, component in chain.flares.items():
        yield f"flare.{name}", "flare", component
    for name, component in chain.cameras.items():
        yield ("sensor" if config.get("sensor") else f"cameras.{name}"), "sensor", component
    for name, component in chain.metrics.items():
        yield f"metric.{name}", "metric", component


def configured_knobs(config: Any, chain: Chain) -> list[ConfiguredKnob]:
    """Return every knob of a configuration that changes something in it.

    Parameters
    ----------
    config : composed config.
    chain : its components.

    Raises
    ------
    ConfigError : no component declares such a knob.
    """
    knobs = []
    silent = []
    for path, kind, component in components(config, chain):
        for knob in knobs_of(component):
            if knob.matters is None or knob.matters(component):
                reference = _below(path, {knob.field: knob.finest(), **knob.independent})
                now = getattr(component, knob.field)
                knobs.append(ConfiguredKnob(path, kind, knob, now, reference))
        if not knobs_of(component):
            silent.append(f"{path}={type(component).__name__}")
    if not knobs:
        raise ConfigError(
            "no component of this configuration declares an accuracy knob that changes anything in"
            f" it ({', '.join(silent)}); expected `accuracy_knobs` on one of them"
            " (docs/how-to/plugins.md); type for example lens=diffraction_limited"
        )
    told_fields = chain.shares is not None and chain.shares.by_field
    if shares_of(chain.lens) or told_fields:
        finest: dict[str, Any] = {}
        for shared_knob in knobs:
            finest |= shared_knob.reference if shared_knob.kind in ("lens", "flare") else {}
        now = chain.allowed.noise_fraction
        knobs.append(ConfiguredKnob("accuracy", "lens", ALLOWED, now, finest, exact=True))
    return knobs


def chosen(configured: Sequence[ConfiguredKnob], name: str, values: str) -> list[ConfiguredKnob]:
    """Return the knob that a user names, with the user's values; without a name, all knobs.

    Parameters
    ----------
    configured : all knobs of the configuration.
    name : name of the knob, as typed; empty: all knobs.
    values : values of the knob, as typed: separated by commas, from the cheapest to the finest;
        empty: the declared ones.

    Raises
    ------
    ConfigError : there is no such knob, or values are given without a knob.
    """
    if not name:
        if values:
            raise ConfigError(
                f"study accuracy has values={values} and no knob; type knob={configured[0].name}"
            )
        return list(configured)
    names = [known.name for known in configured]
    if name not in names:
        raise ConfigError(f"study accuracy has no knob {name!r}{did_you_mean(name, names)}")
    selected = configured[names.index(name)]
    if not values:
        return [selected]
    try:
        listed = tuple(OverridesParser.create().parse_override(f"values=[{values}]").value())
    except HydraException:
        listed = ()
    if not listed:
        raise ConfigError(
            f"values={values} cannot be read; expected values from the cheapest to the finest; type"
            f" for example values={','.join(map(str, selected.knob.tried()))}"
        )
    return [replace(selected, knob=replace(selected.knob, values=listed))]


def setting(config: Any, configured: ConfiguredKnob, changes: dict[str, Any]) -> Setting:
    """Return the configuration with changed values. Its components are built and checked.

    Parameters
    ----------
    config : composed config.
    configured : the knob that is set, for messages.
    changes : {path in the config: value}.

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
            f"the knob {configured.name} cannot be set to {listed}: {err}; type"
            f" knob={configured.name} values=... with values that it takes, from the cheapest to"
            " the"
            " finest"
        ) from None


def _below(path: str, fields: dict[str, Any]) -> dict[str, Any]:
    return {f"{path}.{name}": value for name, value in fields.items()}

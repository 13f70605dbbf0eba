"""How light groups vary in time: the config's table, checked, with phases drawn from their
ranges.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..data.temporal_modulation import wrong
from ..errors import ConfigError, did_you_mean
from ..physics.detector.temporal_modulation import Modulation
from .target import check_mapping, uniform

KEYS = ("frequency_hz", "duty", "depth", "phase")


def parse(table: dict[str, Any], seed: int) -> dict[str, Modulation]:
    """Return the modulation of each group of a config `{group: {frequency_hz, duty or depth,
    phase}}`.

    `phase` is a number of periods from 0 to 1, or a range [low, high] within them, drawn by (seed,
    group) alone.

    Raises
    ------
    ConfigError : an unknown or missing key, or an impossible value.
    """
    return {
        group: _parsed(group, entry, seed) for group, entry in table.items() if entry is not None
    }


def asked_for(table: Mapping[str, Any], weights: Mapping[str, float]) -> list[str]:
    """Return the groups that a scene must have because the config modulates them.

    A group of weight 0 by its own name is not asked for: a preset may name groups that only some
    scenes have. A group that no weight names is asked for, whatever the weight of others.

    Parameters
    ----------
    table : modulation of the config {group: entry}; an entry of None is left out.
    weights : weights of the groups that the config names {group: weight}.
    """
    return [name for name, entry in table.items() if entry is not None and weights.get(name) != 0]


def check_groups(names: Iterable[str], groups: Sequence[str]) -> None:
    """Raise ConfigError where a modulation names a group that the scene does not have.

    Parameters
    ----------
    names : groups that are modulated.
    groups : groups of the scene.
    """
    for name in names:
        if name not in groups:
            raise ConfigError(
                f"lighting.modulation names the light group {name!r}, which the scene does not have"
                f"{did_you_mean(name, groups)}; type ~lighting.modulation.{name} to leave it out"
            )


def _parsed(group: str, entry: Any, seed: int) -> Modulation:
    where = f"lighting.modulation.{group}"
    check_mapping(where, entry, "{frequency_hz: 90, duty: 0.1}")
    example = f"type for example '+{where}={{frequency_hz: 90, duty: 0.1, phase: 0.3}}'"
    for key in entry:
        if key not in KEYS:
            raise ConfigError(f"{where} has no key {key!r}{did_you_mean(key, KEYS)}")
    if "frequency_hz" not in entry or ("duty" in entry) == ("depth" in entry):
        raise ConfigError(
            f"{where} has {', '.join(entry) or 'no key'}; expected frequency_hz and either duty"
            f" (pulses) or depth (ripple); {example}"
        )
    phase = entry.get("phase", 0.0)
    low, high = phase if isinstance(phase, (list, tuple)) and len(phase) == 2 else (phase, phase)
    try:
        low, high, *numbers = (
            float(v)
            for v in (
                low,
                high,
                entry["frequency_hz"],
                entry.get("duty", 1.0),
                entry.get("depth", 0.0),
            )
        )
    except (TypeError, ValueError):
        raise ConfigError(
            f"{where} is {entry}; expected numbers, and phase a number or a range [low, high];"
            f" {example}"
        ) from None
    if not 0 <= low <= high <= 1:
        raise ConfigError(
            f"{where}.phase is {phase!r}; expected periods, 0 <= low <= high <= 1; {example}"
        )
    modulation = Modulation(
        *numbers, low + (high - low) * uniform(seed, f"phase/{group}") if high > low else low
    )
    problem = wrong(modulation) or (
        "frequency_hz is 0; expected above 0" if modulation.frequency_hz == 0 else ""
    )
    if problem:
        raise ConfigError(f"{where}: {problem}; {example}")
    return modulation

"""One photometric target: which statistic of a light group shall reach which luminance."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import ConfigError, did_you_mean

STATISTICS = ("lamp_axis", "max", "percentile", "mean")


@dataclass(frozen=True)
class Target:
    """`statistic` of `group` shall be `low`..`high`, in cd/m2, or in multiples of the luminance
    drawn for `relative_to`.

    lamp_axis: luminance of the brightest lamp of the group, from the scene's list of lamps: the
    largest in any direction for a lamp with a table of candela, that along the axis for other
    lamps. max, percentile, mean: of the group's luminance over the picture.
    """

    group: str
    statistic: str
    low: float
    high: float
    percentile: float = 50.0
    lamp_kind: str = ""
    relative_to: str = ""


def parse(targets: dict[str, Any]) -> tuple[Target, ...]:
    """Return the targets of a config `{group: {statistic, cd_m2 or relative_to and ratio,
    percentile, lamp_kind}}`.

    `cd_m2` and `ratio` are a number or a range [low, high]. Targets that others are relative to
    come first.

    Raises
    ------
    ConfigError : an unknown key, statistic or group to be relative to, or an impossible value.
    """
    parsed = [_parsed(group, entry) for group, entry in targets.items() if entry is not None]
    absolute = [t for t in parsed if not t.relative_to]
    for target in parsed:
        if target.relative_to and target.relative_to not in [t.group for t in absolute]:
            raise ConfigError(
                f"target of {target.group!r} is relative to {target.relative_to!r}, which has no"
                " target in cd/m2" + did_you_mean(target.relative_to, [t.group for t in absolute])
            )
    return (*absolute, *(t for t in parsed if t.relative_to))


def draw(targets: tuple[Target, ...], seed: int) -> dict[str, float]:
    """Return the wanted luminance of each group, cd/m2, uniform in its range.

    Each draw is keyed by (seed, group), so that adding a group never changes another draw.
    """
    luminance_cd_m2: dict[str, float] = {}
    for t in targets:
        value = t.low + (t.high - t.low) * uniform(seed, t.group)
        luminance_cd_m2[t.group] = (
            value * luminance_cd_m2[t.relative_to] if t.relative_to else value
        )
    return luminance_cd_m2


def uniform(seed: int, name: str) -> float:
    """Return a number in [0, 1) that depends on `seed` and `name` only."""
    word = hashlib.blake2b(f"lighting/{int(seed)}/{name}".encode(), digest_size=8).digest()
    return (int.from_bytes(word, "little") >> 11) * 2.0**-53


def check_mapping(where: str, entry: Any, example: str) -> None:
    """Raise ConfigError unless the entry of a table in the config is a mapping.

    Parameters
    ----------
    where : key of the entry in the config.
    entry : value of the entry.
    example : a valid mapping, for the message.
    """
    if not isinstance(entry, Mapping):
        raise ConfigError(
            f"{where} is {entry!r}; expected a mapping; type for example '+{where}={example}'"
        )


def _parsed(group: str, entry: Any) -> Target:
    where = f"lighting.targets.{group}"
    check_mapping(where, entry, "{statistic: max, cd_m2: 30000}")
    keys = ("statistic", "cd_m2", "relative_to", "ratio", "percentile", "lamp_kind")
    for key in entry:
        if key not in keys:
            raise ConfigError(f"{where} has no key {key!r}{did_you_mean(key, keys)}")
    statistic = entry.get("statistic", "mean")
    if statistic not in STATISTICS:
        raise ConfigError(
            f"{where}.statistic is {statistic!r}{did_you_mean(statistic, STATISTICS)}"
        )
    relative_to = entry.get("relative_to") or ""
    key, unused_key = ("ratio", "cd_m2") if relative_to else ("cd_m2", "ratio")
    if key not in entry or unused_key in entry:
        raise ConfigError(
            f"{where} needs either cd_m2, or relative_to and ratio; type for example "
            f"'lighting.targets.{group}={{statistic: max, cd_m2: 30000}}'"
        )
    value = entry[key]
    low, high = value if isinstance(value, (list, tuple)) and len(value) == 2 else (value, value)
    try:
        low = float(low)
        high = float(high)
        percentile = float(entry.get("percentile", 50.0))
    except (TypeError, ValueError):
        raise ConfigError(
            f"{where}.{key} is {value!r}; expected a number or a range [low, high]"
        ) from None
    if not 0 <= low <= high < math.inf:
        raise ConfigError(f"{where}.{key} is {value!r}; expected 0 <= low <= high, finite")
    if not 0 <= percentile <= 100:
        raise ConfigError(f"{where}.percentile is {percentile:g}; expected 0 to 100")
    for name in ("relative_to", "lamp_kind"):
        if not isinstance(entry.get(name) or "", str):
            raise ConfigError(f"{where}.{name} is {entry[name]!r}; expected a name")
    return Target(
        group, statistic, low, high, percentile, entry.get("lamp_kind") or "", relative_to
    )

"""Recipe: families of scenes and the distributions of their settings, read from a YAML file."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from isethdr_core.errors import ConfigError, did_you_mean

BUNDLED = Path(__file__).parent / "recipes"
KEYS = ("about", "overrides", "families", "splits")
KEYS_OF_FAMILY = ("share", "overrides", "draw")
DEFAULT_SPLITS = {"train": 0.7, "validation": 0.15, "test": 0.15}


@dataclass(frozen=True)
class Choice:
    """One of several values, each with its probability."""

    values: tuple[str, ...]  # as they are typed in an override
    shares: tuple[float, ...]  # probabilities of the values; their sum is 1

    def drawn(self, random: np.random.Generator) -> str:
        """Return one value."""
        return self.values[int(random.choice(len(self.values), p=self.shares))]

    def extremes(self) -> tuple[str, ...]:
        """Return the values that must all be valid."""
        return self.values


@dataclass(frozen=True)
class Uniform:
    """A number between two limits, all equally likely."""

    least: float
    most: float

    def drawn(self, random: np.random.Generator) -> str:
        """Return one value, with six significant digits."""
        return f"{random.uniform(self.least, self.most):.6g}"

    def extremes(self) -> tuple[str, ...]:
        """Return the values that must all be valid."""
        return f"{self.least:.6g}", f"{self.most:.6g}"


@dataclass(frozen=True)
class LogUniform:
    """A positive number between two limits, with a uniformly distributed logarithm."""

    least: float
    most: float

    def drawn(self, random: np.random.Generator) -> str:
        """Return one value, with six significant digits."""
        return f"{math.exp(random.uniform(math.log(self.least), math.log(self.most))):.6g}"

    def extremes(self) -> tuple[str, ...]:
        """Return the values that must all be valid."""
        return f"{self.least:.6g}", f"{self.most:.6g}"


Distribution = Choice | Uniform | LogUniform


@dataclass(frozen=True)
class Family:
    """Scenes of one kind."""

    name: str
    share: float  # share of all scenes; the shares of a recipe sum to 1
    overrides: tuple[str, ...]  # overrides that all its scenes share
    draw: Mapping[str, Distribution]  # {config key: its distribution}


@dataclass(frozen=True)
class Recipe:
    """The families and distributions that the scenes of a dataset are drawn from."""

    about: str
    families: tuple[Family, ...]
    splits: Mapping[str, float]  # {part: share of the roads}, sum 1
    text: str  # text of the file, which is recorded with the dataset


def read_recipe(name: str) -> Recipe:
    """Return a bundled recipe, or the recipe in a file.

    Parameters
    ----------
    name : name of a bundled recipe, for example `roads`, or a path that ends in .yaml.

    Raises
    ------
    ConfigError : there is no such recipe, or it has a mistake.
    """
    bundled = {path.stem: path for path in BUNDLED.glob("*.yaml")}
    path = bundled.get(name, Path(name))
    if path.suffix != ".yaml" or not path.is_file():
        raise ConfigError(
            f"there is no recipe {name!r}{did_you_mean(name, bundled)}; expected a bundled recipe"
            " or a file that ends in .yaml; type for example recipe=roads"
        )
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as err:
        raise ConfigError(f"recipe {name}: no text in UTF-8: {err}") from None
    return parsed(text, name)


def parsed(text: str, name: str) -> Recipe:
    """Return the recipe in a YAML text.

    Parameters
    ----------
    text : YAML text of the recipe.
    name : name of the recipe, for messages.

    Raises
    ------
    ConfigError : the recipe has a mistake.
    """
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as err:
        raise ConfigError(f"recipe {name}: no valid YAML: {' '.join(str(err).split())}") from None
    where = f"recipe {name}"
    content = _table(content, where, KEYS)
    families = _table(content.get("families"), f"{where}: families", None)
    shares = _shares(
        {
            key: _table(entry, f"{where}: family {key}", KEYS_OF_FAMILY).get("share", 1)
            for key, entry in families.items()
        },
        f"{where}: families",
    )
    of_all = _overrides(content, where)
    return Recipe(
        about=str(content.get("about", "")).strip(),
        families=tuple(
            _family(key, entry, share, of_all, f"{where}: family {key}")
            for (key, entry), share in zip(families.items(), shares.values(), strict=True)
        ),
        splits=_shares(content.get("splits", DEFAULT_SPLITS), f"{where}: splits"),
        text=text,
    )


def _overrides(entry: Mapping[str, Any], where: str) -> tuple[str, ...]:
    overrides = entry.get("overrides") or []
    if not isinstance(overrides, list) or not all(isinstance(o, str) for o in overrides):
        raise ConfigError(
            f"{where}: overrides are {overrides!r}; expected a list of overrides; type for example"
            " overrides: [scene=night_drive]"
        )
    return tuple(overrides)


def _family(
    name: str, entry: Mapping[str, Any], share: float, of_all: tuple[str, ...], where: str
) -> Family:
    """Return a family; `of_all` are the overrides of all families."""
    draw = _table(entry.get("draw") or {}, f"{where}: draw", None, empty=True)
    return Family(
        name,
        share,
        (*of_all, *_overrides(entry, where)),
        {key: _distribution(value, f"{where}: {key}") for key, value in draw.items()},
    )


def _distribution(value: Any, where: str) -> Distribution:
    if isinstance(value, dict) and len(value) == 1:
        ((kind, argument),) = value.items()
        weights = _weights(argument)
        if kind == "choice" and weights:
            shares = _shares(weights, where)
            return Choice(tuple(map(_typed, weights)), tuple(shares.values()))
        limits = _limits(argument)
        if limits is not None and kind == "uniform":
            return Uniform(*limits)
        if limits is not None and kind == "log_uniform" and limits[0] > 0:
            return LogUniform(*limits)
    raise ConfigError(
        f"{where} is {value!r}; expected {{choice: {{value: share}}}}, {{uniform: [least, most]}}"
        " or {log_uniform: [least, most]} with least above 0; type for example"
        " {uniform: [1.1, 1.6]}"
    )


def _weights(argument: Any) -> dict[Any, Any]:
    """Return {value: weight} of a table, or of a list of numbers, words and switches, in which each
    entry weighs the same; empty for anything else.
    """
    if isinstance(argument, dict):
        return argument
    if isinstance(argument, list) and all(
        value is None or isinstance(value, str | int | float) for value in argument
    ):
        return dict(Counter(argument))
    return {}


def _limits(argument: Any) -> tuple[float, float] | None:
    """Return (least, most); None unless the argument is a list of two finite numbers, the first at
    most as large as the second.
    """
    if not isinstance(argument, list) or len(argument) != 2:
        return None
    if not all(isinstance(v, int | float) and math.isfinite(v) for v in argument):
        return None
    least, most = map(float, argument)
    return (least, most) if least <= most else None


def _typed(value: Any) -> str:
    """Return a YAML value as it is typed in an override."""
    if isinstance(value, bool):
        return str(value).lower()
    return "null" if value is None else str(value)


def _shares(weights: Any, where: str) -> dict[str, float]:
    """Return positive weights divided by their sum."""
    sound = (
        isinstance(weights, dict)
        and weights
        and all(
            isinstance(w, int | float) and not isinstance(w, bool) and math.isfinite(w) and w > 0
            for w in weights.values()
        )
    )
    if not sound:
        raise ConfigError(
            f"{where}: the shares are {weights!r}; expected a positive number for each name"
        )
    total = float(sum(weights.values()))
    return {key: weight / total for key, weight in weights.items()}


def _table(
    value: Any, where: str, known: tuple[str, ...] | None, empty: bool = False
) -> dict[str, Any]:
    """Return a YAML table.

    Parameters
    ----------
    value : the YAML value.
    where : place of the table, for messages.
    known : allowed keys; None: any.
    empty : whether the table may have no entries.
    """
    if not isinstance(value, dict) or not (value or empty):
        raise ConfigError(f"{where}: {value!r} is no table of keys and values")
    for key in value:
        if known is not None and key not in known:
            raise ConfigError(
                f"{where} has no key {key!r}{did_you_mean(str(key), known)}; expected"
                f" {', '.join(known)}"
            )
    return value


def node_of(override: str) -> str:
    """Return the top node of the config that an override changes: `scene` for `scene.road=x`."""
    return override.lstrip("+~").partition("=")[0].partition(".")[0].partition("@")[0]

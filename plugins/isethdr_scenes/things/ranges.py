"""Ranges of families: files of the folder `data`, and the numbers drawn from them.

A value `a .. b` of a file stands for a random number, uniform between a and b. All other values are
taken as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any
from zlib import crc32

import numpy as np

from isethdr_core.plugins.yaml_text import read_yaml


@cache
def read(name: str) -> dict[str, Any]:
    """Return a file of the folder `data`. The result is cached; callers must not change it."""
    text = files(__package__).joinpath("data", name).read_text(encoding="utf-8")
    told: dict[str, Any] = read_yaml(text)
    return told


def generator(family: str, variant: int) -> np.random.Generator:
    """Return the random numbers of one member of a family."""
    return np.random.default_rng([crc32(family.encode()), variant])


def drawn(value: Any, rng: np.random.Generator) -> Any:
    """Return `value` with a number in place of each range, drawn in the order of the file.

    Lists become tuples, so that the result is hashable.
    """
    if isinstance(value, dict):
        return {key: drawn(inner, rng) for key, inner in value.items()}
    if isinstance(value, list):
        return tuple(drawn(inner, rng) for inner in value)
    if isinstance(value, str) and ".." in value:
        low, high = (float(end) for end in value.split(".."))
        return float(rng.uniform(low, high))
    return value


def one_of(shares: Mapping[str, float], rng: np.random.Generator) -> str:
    """Return a key of `shares`, drawn in proportion to its share; shares may have any scale."""
    share = np.array(list(shares.values()), float)
    return list(shares)[int(rng.choice(len(share), p=share / share.sum()))]

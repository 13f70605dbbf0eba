"""Drawn numbers of a kind of road: each from its own range, independent of all other ranges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from zlib import crc32

import numpy as np


@dataclass(frozen=True)
class Draw:
    """The ranges of one kind, and the seed that selects values in them.

    Each name has its own generator, so that an added range changes no other value.
    """

    kind: str
    seed: int
    ranges: dict[str, Any]

    def rng(self, name: str) -> np.random.Generator:
        """Return the random generator of a name."""
        return np.random.default_rng([self.seed, crc32(self.kind.encode()), crc32(name.encode())])

    def value(self, name: str, default: Any = 0.0) -> Any:
        """Return the value of a name: drawn from a range or a choice, or fixed."""
        return self.one(name, self.ranges.get(name, default))

    def number(self, name: str, default: float = 0.0) -> float:
        """Return the value of a name as a number."""
        return float(self.value(name, default))

    def one(self, name: str, told: Any) -> Any:
        """Return the value of a table entry, drawn with the generator of `name`.

        Parameters
        ----------
        name : name of the value.
        told : entry of the table: range [low, high], choice {"one_of": [...]}, or fixed value.
        """
        if isinstance(told, dict):
            choices: Sequence[Any] = told["one_of"]
            return choices[int(self.rng(name).integers(len(choices)))]
        if not isinstance(told, list):
            return told
        low, high = told
        if isinstance(low, int) and isinstance(high, int) and high - low < 10:
            return int(self.rng(name).integers(low, high + 1))
        return float(self.rng(name).uniform(low, high))

    def side(self, name: str) -> int:
        """Return 1 or -1, drawn with equal probability."""
        return 1 if self.rng(name).random() < 0.5 else -1

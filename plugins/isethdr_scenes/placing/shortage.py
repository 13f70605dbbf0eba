"""Shortage: the number of things that a density requires, and the number that could be placed."""

from __future__ import annotations

from typing import NamedTuple

from isethdr_core.errors import ConfigError


class Shortage(NamedTuple):
    """Number of things that a field of the scene requires, and the number that was placed."""

    field: str
    what: str
    wanted: int
    placed: int
    density: float

    def check(self, road: str) -> None:
        """Raise ConfigError if not all things were placed; `road` is the kind of road."""
        if self.placed == self.wanted:
            return
        possible = self.density * self.placed / self.wanted
        raise ConfigError(
            f"scene.{self.field} is {self.density:g}, but only {self.placed} of {self.wanted}"
            f" {self.what} could be placed on this {road}; expected fewer; type for example"
            f" scene.{self.field}={0.8 * possible:.3g}"
        )

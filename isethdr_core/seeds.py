"""Public path of `runs.seeds`."""

from .runs.seeds import (
    Generator,
    checked_seed,
    generator,
)

__all__ = ["Generator", "checked_seed", "generator"]

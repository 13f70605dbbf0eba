"""Public path of `physics.detector.random_words`."""

from .detector.random_words import (
    philox,
    tail,
    words,
)

__all__ = ["philox", "tail", "words"]

"""Random numbers with keys. Order of computation, chunks and number of processes do not change
them.

A `Generator` is an immutable key and has no state. `generator.stream(...)` names one stream, and
`isethdr_core.physics.detector.noise` turns a stream and the position of a pixel into one 64-bit
word.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from numbers import Integral

from ..errors import ConfigError
from ..plugins.ranges import LARGEST_SEED


@dataclass(frozen=True)
class Generator:
    """The key of all noise of a run: `seed` and `scene` name the shot, `device` the piece of
    silicon.
    """

    seed: int = 0
    device: str = "A"
    scene: str = ""

    def stream(self, *purpose: object) -> tuple[object, ...]:
        """Return the key of one shot-to-shot stream, e.g. `stream("LPHG", "read")`."""
        return ("shot", self.seed, self.device, self.scene, *purpose)

    def device_stream(self, *purpose: object) -> tuple[object, ...]:
        """Return the key of a map that belongs to the device and persists from shot to shot."""
        return ("device", self.device, *purpose)

    def child(self, scene: str) -> Generator:
        """Return the same key for another scene."""
        return replace(self, scene=scene)


def generator(seed: int = 0, device: str = "A", scene: str = "") -> Generator:
    """Return the key of all random numbers of one shot of a scene by a device.

    Parameters
    ----------
    seed : seed of the shot, 0 to 2^63 - 1.
    device : name of the device; it alone decides fixed-pattern noise.
    scene : name of the scene.

    Raises
    ------
    ConfigError : a seed that is not a whole number from 0 to 2^63 - 1.
    """
    return Generator(checked_seed(seed), str(device), str(scene))


def checked_seed(seed: int) -> int:
    """Return the seed as an int; raise ConfigError if it is not a valid seed."""
    is_integer = isinstance(seed, Integral) and not isinstance(seed, bool)
    if not (is_integer and 0 <= seed <= LARGEST_SEED):
        raise ConfigError(
            f"seed is {seed!r}; expected a whole number from 0 to 2^63 - 1; type for example seed=7"
        )
    return int(seed)

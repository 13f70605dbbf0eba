"""Frame seed: the renderer's random numbers of one frame of a sequence.

With one seed for all frames, the render noise would be a pattern that stands still in front of a
scene that moves. The seed of a frame therefore follows from the seed of the sequence, which is the
renderer's own, and from surfaces, camera and sky of the frame. Any motion gives another seed. If
nothing moves, frames keep their seed. This has two consequences. Frames with equal light stay
equal, so that they are rendered once. If only a lamp changes, a new rendering would give the light
of the other groups again, bit for bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

from ..storage.store import content_hash

SEED = "seed"  # name of a renderer's field
MARK = {"seed": "of the frame"}  # part of the name of radiance with a seed that is the frame's


def has_frame_seed(renderer: Any, exposures: Mapping[str, Any] | None) -> bool:
    """Return whether the renderer's random numbers follow from the frame: a renderer with a seed,
    in a sequence.

    Parameters
    ----------
    renderer : renderer of the run, or None.
    exposures : exposures carried into the frame; None: the run is no frame of a sequence.
    """
    if exposures is None or not is_dataclass(renderer):
        return False
    return any(field.name == SEED for field in fields(renderer))


def frame_seed(seed: int, lit: str) -> int:
    """Return the seed of a frame, from 0 to 2^63 - 1.

    Parameters
    ----------
    seed : seed of the sequence.
    lit : digest of everything in the frame that is lit.
    """
    return int(content_hash({"seed": seed, "lit": lit}), 16) >> 1


def with_frame_seed(renderer: Any, lit: str) -> Any:
    """Return the renderer with the seed of a frame; `lit` as of `frame_seed`."""
    return replace(renderer, seed=frame_seed(renderer.seed, lit))

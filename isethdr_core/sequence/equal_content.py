"""Equal content: the digest of a scene description, by which equal light is recognised.

Nothing moves while a car waits, and the frames of that time show the same light. The digest covers
everything that a renderer is given: equal digests give equal radiance from the same renderer.
Objects without parts are not seen, so their poses do not count.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from ..data.scene_description import SceneDescription

DIGEST_BYTES = 16


def content_of(description: SceneDescription) -> str | None:
    """Return the digest of a description; None if a plugin's part of it is no plain data."""
    try:
        return _Digest(description).whole()
    except TypeError:
        return None


class _Digest:
    """The digest of one description. Arrays that parts share are read once."""

    def __init__(self, description: SceneDescription) -> None:
        self.description = description
        self.arrays: dict[int, bytes] = {}
        self.seen = [
            (number, placed, description.models[placed.model])
            for number, placed in enumerate(description.objects, 1)
            if description.models[placed.model].parts
        ]

    def whole(self) -> str:
        """Return the digest of everything that radiance and labels follow from."""
        scene = self.description
        models = {placed.model: model for _, placed, model in self.seen}
        names = {name: k for k, name in enumerate(models)}  # numbered in their order
        made = hashlib.blake2b(digest_size=DIGEST_BYTES)
        self.feed(
            made,
            (
                scene.name,
                scene.camera,
                scene.fog,
                scene.sky,
                scene.materials,
                [(n, names[p.model], p.pose, p.name, p.category) for n, p, _ in self.seen],
                [model.parts for model in models.values()],
                self.next_frame(),
            ),
        )
        return made.hexdigest()

    def next_frame(self) -> Any:
        """Return where all that is seen will be in the next frame."""
        following = self.description.next_frame
        if following is None:
            return None
        poses = [following.poses[number - 1] for number, _, _ in self.seen]
        return following.after_s, following.camera, poses

    def feed(self, made: Any, value: Any) -> None:
        """Add a value to a digest, so that no two different values add the same bytes."""
        if isinstance(value, np.ndarray):
            made.update(self.of_array(value))
        elif is_dataclass(value) and not isinstance(value, type):
            made.update(f"<{type(value).__qualname__}".encode())
            self.feed(made, [(f.name, getattr(value, f.name)) for f in fields(value)])
        elif isinstance(value, Mapping):
            made.update(f"{{{len(value)}".encode())
            for key in value:  # the order of materials and groups is part of the content
                self.feed(made, (key, value[key]))
        elif isinstance(value, (tuple, list)):
            made.update(f"({len(value)}".encode())
            for one in value:
                self.feed(made, one)
        elif value is None or isinstance(value, (bool, int, float, str, np.number)):
            text = repr(value)
            made.update(f"{type(value).__name__}{len(text)}:{text}".encode())
        else:
            raise TypeError(f"{type(value).__qualname__} is no plain data")

    def of_array(self, array: np.ndarray) -> bytes:
        """Return the digest of an array."""
        if id(array) not in self.arrays:
            whole = np.ascontiguousarray(array)
            made = hashlib.blake2b(f"{whole.dtype.str}{whole.shape}".encode(), digest_size=16)
            made.update(whole.data)
            self.arrays[id(array)] = made.digest()
        return self.arrays[id(array)]

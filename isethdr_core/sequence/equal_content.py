"""Equal content: digests of a scene description by which light that does not change is recognised.

Nothing moves while a car waits, and the frames of that time show the same light. The digests cover
everything that a renderer is given: equal digests give equal radiance from the same renderer.
Objects without parts are not seen, so their poses do not count.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from ..data.scene_description import Model, SceneDescription

DIGEST_BYTES = 16


class Content(NamedTuple):
    """Digests of a scene description."""

    whole: str  # of everything, labels included
    groups: dict[str, str]  # by light group: of all surfaces, and of the lamps of that group


def content_of(description: SceneDescription) -> Content | None:
    """Return the digests of a description; None if a plugin's part of it is no plain data.

    Notes
    -----
    A lamp of another group counts as the surface that it is built from. A part with normals counts
    by whether it is a lamp, because renderers do not smooth lamps.
    """
    try:
        return _Digests(description).content()
    except TypeError:
        return None


class _Digests:
    """Digests of one description. Arrays that parts share are read once."""

    def __init__(self, description: SceneDescription) -> None:
        self.description = description
        self.arrays: dict[int, bytes] = {}
        self.seen = [
            (number, placed, description.models[placed.model])
            for number, placed in enumerate(description.objects, 1)
            if description.models[placed.model].parts
        ]

    def content(self) -> Content:
        """Return the digests."""
        scene = self.description
        models = {placed.model: model for _, placed, model in self.seen}
        names = {name: k for k, name in enumerate(models)}
        surfaces = self.digest(
            scene.camera,
            scene.fog,
            scene.sky,
            scene.materials,
            [(number, names[placed.model], placed.pose) for number, placed, _ in self.seen],
            [(names[name], self.surfaces(model)) for name, model in models.items()],
        )
        groups = {
            group: self.digest(surfaces, group, self.lamps(group)) for group in scene.light_groups()
        }
        named = [(placed.name, placed.category) for _, placed, _ in self.seen]
        parts = [(names[name], [part.name for part in m.parts]) for name, m in models.items()]
        return Content(
            self.digest(surfaces, groups, named, parts, scene.name, self.next_frame()), groups
        )

    def surfaces(self, model: Model) -> list[Any]:
        """Return the parts of a model, without what they emit."""
        return [
            (p.vertices, p.faces, p.normals, p.material, p.normals is not None and bool(p.lamp))
            for p in model.parts
        ]

    def lamps(self, group: str) -> list[Any]:
        """Return the lamps of a light group, by object and part."""
        mine = lambda part: part.lamp is not None and part.lamp.group == group
        return [
            (number, k, part.lamp)
            for number, _, model in self.seen
            for k, part in enumerate(model.parts)
            if mine(part)
        ]

    def next_frame(self) -> Any:
        """Return where all that is seen will be in the next frame."""
        following = self.description.next_frame
        if following is None:
            return None
        poses = [following.poses[number - 1] for number, _, _ in self.seen]
        return following.after_s, following.camera, poses

    def digest(self, *values: Any) -> str:
        """Return the digest of plain data, arrays and dataclasses."""
        made = hashlib.blake2b(digest_size=DIGEST_BYTES)
        self.feed(made, values)
        return made.hexdigest()

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

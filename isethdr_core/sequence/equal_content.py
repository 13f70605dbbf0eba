"""Equal content: digests of a scene description, by which equal light is recognised.

Nothing moves while a car waits, and the frames of that time show the same light. The digest of the
whole covers everything that a renderer receives: equal digests give equal radiance from the same
renderer. If only a lamp has changed, the light of the other groups is the same: the digest of a
group covers all surfaces, camera and sky, and only the lamps of that group. Objects without parts
are not visible, so their poses do not count.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, NamedTuple

import numpy as np

from ..data.scene_description import Model, Part, SceneDescription

DIGEST_BYTES = 16
FLAT = 1e-6  # 1 - cosine between a vertex normal and its face normal; less is rounding


class Contents(NamedTuple):
    """Digests of a scene description."""

    whole: str  # digest of everything, labels and the next frame included
    surfaces: str  # digest of everything that is lit: without lamps, without the next frame
    groups: dict[str, str]  # {light group: digest of `surfaces` and the lamps of that group}


def contents_of(description: SceneDescription) -> Contents | None:
    """Return the digests of a description; None if a plugin's part of it is no plain data.

    Notes
    -----
    A lamp of another group counts only as a surface. Renderers give lamps flat faces. A part with
    smooth normals therefore counts as another surface while it is a lamp.
    """
    try:
        return _Digest(description).contents()
    except TypeError:
        return None


def content_of(description: SceneDescription) -> str | None:
    """Return the digest of the whole description; None if a plugin's part of it is no plain
    data.
    """
    try:
        return _Digest(description).whole()
    except TypeError:
        return None


class _Digest:
    """The digests of one description. Arrays that parts share are read once."""

    def __init__(self, description: SceneDescription) -> None:
        self.description = description
        self.arrays: dict[int, bytes] = {}
        self.models: dict[int, str] = {}  # digests of their surfaces
        self.seen = [
            (number, placed, description.models[placed.model])
            for number, placed in enumerate(description.objects, 1)
            if description.models[placed.model].parts
        ]

    def whole(self) -> str:
        """Return the digest of everything from which radiance and labels follow."""
        scene = self.description
        models = {placed.model: model for _, placed, model in self.seen}
        names = {name: k for k, name in enumerate(models)}  # numbered in their order
        return self.digest(
            (
                scene.name,
                scene.camera,
                scene.fog,
                scene.sky,
                scene.materials,
                [(n, names[p.model], p.pose, p.name, p.category) for n, p, _ in self.seen],
                [model.parts for model in models.values()],
                self.next_frame(),
            )
        )

    def contents(self) -> Contents:
        """Return all digests."""
        scene = self.description
        placed = [
            (n, p.name, p.category, p.pose, self.surfaces(model)) for n, p, model in self.seen
        ]
        surfaces = self.digest((scene.camera, scene.fog, scene.sky, scene.materials, placed))
        groups = {
            group: self.digest((surfaces, group, self.lamps(group)))
            for group in scene.light_groups()
        }
        return Contents(self.whole(), surfaces, groups)

    def surfaces(self, model: Model) -> str:
        """Return the digest of the parts of a model, without what they emit."""
        if id(model) not in self.models:
            self.models[id(model)] = self.digest(
                [(p.vertices, p.faces, p.normals, p.material, _flattened(p)) for p in model.parts]
            )
        return self.models[id(model)]

    def lamps(self, group: str) -> list[Any]:
        """Return the lamps of a light group, by object and part."""
        return [
            (number, k, part.lamp)
            for number, _, model in self.seen
            for k, part in enumerate(model.parts)
            if part.lamp is not None and part.lamp.group == group
        ]

    def digest(self, value: Any) -> str:
        """Return the digest of plain data, arrays and dataclasses."""
        made = hashlib.blake2b(digest_size=DIGEST_BYTES)
        self.feed(made, value)
        return made.hexdigest()

    def next_frame(self) -> Any:
        """Return time, camera and poses of all visible objects in the next frame, or None."""
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


def _flattened(part: Part) -> bool:
    """Return whether a part has smooth normals that it loses because it is a lamp."""
    if part.lamp is None or part.normals is None:
        return False
    corners = np.asarray(part.vertices, float)[part.faces]
    face = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face /= np.maximum(np.linalg.norm(face, axis=1, keepdims=True), np.finfo(float).tiny)
    cosine = np.einsum("fkc,fc->fk", np.asarray(part.normals, float)[part.faces], face)
    return bool((1 - cosine > FLAT).any())

"""Parts, models and poses as a Mitsuba scene.

A model without lamps that is placed several times is stored once (shape group and instances). All
other parts are written out at each place. Scenes are always loaded without merging: Mitsuba's
loader would join shapes, lose labels, break emitters written in Python, and make two loads differ.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.scene import Part

from ..lamps.sky_discs import disc_mesh, discs_of

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Material, Model, SceneDescription


@dataclass(frozen=True, eq=False)
class Shape:
    """A Mitsuba shape and the object, material or lamp that it represents."""

    shape: mi.Shape
    # number of the object, from 1; 0 for shared parts of a model, whose instances have the number,
    # and for sun and moon
    label: int = 0
    material: int = 0  # index into the description's materials
    lamp: int | None = None  # index into the lamps
    pose: np.ndarray | None = None  # (4, 4) pose of an instance, which has no triangles of its own
    parts: tuple = ()  # shapes that an instance contains


@dataclass(frozen=True, eq=False)
class World:
    """A loaded scene and its shapes. The shapes stay alive while tables of their numbers are in
    use.
    """

    scene: mi.Scene
    shapes: list[Shape]

    def table(self, value_of: Callable[..., Any], default: int = 0) -> np.ndarray:
        """Return an array of `value_of(Shape)`, indexed by the number that Mitsuba gives a shape.
        Unused numbers, including 0, have the value `default`.
        """
        numbers = _numbers(s.shape for s in self.shapes)
        table = np.full(numbers.max(initial=0) + 1, default, np.uint32)
        table[numbers] = [value_of(s) for s in self.shapes]
        return table

    def instances(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return poses (n, 4, 4), positions of first parts (n,), and numbers of all parts.

        Poses and positions are indexed by the number that Mitsuba gives an instance; unused numbers
        have the identity as pose. A position is an index into the list of numbers of parts.
        """
        placed = [s for s in self.shapes if s.pose is not None]
        numbers = _numbers(s.shape for s in placed)
        poses = np.tile(np.eye(4), (numbers.max(initial=0) + 1, 1, 1))
        first = np.zeros(numbers.max(initial=0) + 1, np.uint32)
        parts = [0]
        index_of = {}
        for number, s in zip(numbers, placed, strict=True):
            poses[number] = s.pose
            if s.parts not in index_of:
                index_of[s.parts] = len(parts)
                parts.extend(_numbers(s.parts))
            first[number] = index_of[s.parts]
        return poses, first, np.array(parts, np.uint32)


def _numbers(shapes: Iterator[Any]) -> np.ndarray:
    return np.array([int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(s))[0]) for s in shapes], int)


def build_world(
    description: SceneDescription,
    surfaces: dict,
    emitter_of: Any = None,
    discs: bool = True,
    **extra: Any,
) -> World:
    """Return the Mitsuba scene of `description`.

    Parameters
    ----------
    description : scene.
    surfaces : {material: Mitsuba BSDF}.
    emitter_of : None, or a function from the index of a lamp to a Mitsuba emitter or None. The
        integrator of this plugin needs no emitters: it finds lamps by the shape that a ray hits.
    discs : whether to add sun and moon, as lamps after all others.
    extra : further entries of the scene dictionary.
    """
    times = Counter(o.model for o in description.objects)
    order = {name: k for k, name in enumerate(description.materials)}
    entries = {"type": "scene", **extra}
    shapes = []
    lamps = 0
    instances = {}
    parts = {}
    for number, placed in enumerate(description.objects, 1):
        model = description.models[placed.model]
        pose = np.asarray(placed.pose, float)
        shared = [p for p in model.parts if not p.lamp] if times[placed.model] > 1 else []
        if shared:
            group = _group_key(placed.model, description.models)
            if group not in entries:
                meshes = [
                    _mesh(f"{group}_{j}", p, np.eye(4), _surface(surfaces, p))
                    for j, p in enumerate(shared)
                ]
                parts[group] = tuple(meshes)
                entries[group] = {
                    "type": "shapegroup",
                    **{f"part{j}": m for j, m in enumerate(meshes)},
                }
                shapes += [
                    Shape(m, material=order[p.material])
                    for m, p in zip(meshes, shared, strict=True)
                ]
            entries[f"object{number}"] = {
                "type": "instance",
                "to_world": mi.ScalarTransform4f(pose),
                "model": {"type": "ref", "id": group},
            }
            instances[f"object{number}"] = {"label": number, "pose": pose, "parts": parts[group]}
        for j, part in enumerate(model.parts):
            if shared and not part.lamp:
                continue
            emitter = emitter_of(lamps) if emitter_of and part.lamp else None
            name = f"object{number}_part{j}"
            mesh = _mesh(name, part, pose, _surface(surfaces, part), emitter)
            shapes.append(Shape(mesh, number, order[part.material], lamps if part.lamp else None))
            lamps += bool(part.lamp)
            entries[name] = mesh
    for disc in discs_of(description) if discs else ():
        material = _darkest(description.materials)
        vertices, faces = disc_mesh(disc, description.camera.position_m)
        part = Part(disc.name, vertices, faces, material)
        mesh = _mesh(f"sky_{disc.name}", part, np.eye(4), _surface(surfaces, part))
        shapes.append(Shape(mesh, material=order[material], lamp=lamps))
        lamps += 1
        entries[f"sky_{disc.name}"] = mesh
    if not shapes:
        # compiled code needs at least one surface: add a tiny one that no ray meets
        entries["speck"] = {"type": "sphere", "radius": 1e-9, "center": [0.0, 0.0, -1e7]}
    scene = mi.load_dict(entries, optimize=False)
    return World(
        scene,
        shapes + [Shape(s, **instances[s.id()]) for s in scene.shapes() if s.id() in instances],
    )


def _group_key(model: str, models: dict[str, Model]) -> str:
    """Return the key of a shared model in the scene dictionary. Mitsuba refuses keys with a dot;
    models with a dot in their name are numbered instead.
    """
    return f"model{list(models).index(model)}" if "." in model else f"model_{model}"


def _darkest(materials: dict[str, Material]) -> str:
    """Return the name of the opaque material with the lowest reflectance. Sun and moon use it,
    because they should reflect next to nothing.

    Raises
    ------
    ConfigError : the scene has no material.
    """
    if not materials:
        raise ConfigError(
            "the scene has a sun or a moon and no material, from which their disc could be made;"
            " expected at least one material in `SceneDescription.materials`"
        )
    opaque = [n for n, m in materials.items() if m.kind != "thin_glass" and m.retro is None]
    return min(opaque or materials, key=lambda n: max(materials[n].reflectance.value))


def _surface(surfaces: dict[str, Any], part: Part) -> Any:
    if part.material not in surfaces:
        raise ConfigError(
            f"part {part.name!r} has the unknown material {part.material!r}"
            + did_you_mean(part.material, surfaces)
        )
    return surfaces[part.material]


def _mesh(name: str, part: Part, pose: np.ndarray, surface: Any, emitter: Any = None) -> Any:
    vertices = np.asarray(part.vertices, float) @ pose[:3, :3].T + pose[:3, 3]
    faces = np.asarray(part.faces)
    if np.linalg.det(pose[:3, :3]) < 0:
        faces = faces[:, ::-1]  # a mirroring pose reverses the winding
    # the pattern of a lamp follows its real faces, so its normals are not smoothed
    smooth = part.normals is not None and not part.lamp
    properties = mi.Properties()
    properties["surface"] = surface
    if emitter is not None:
        properties["emitter"] = emitter
    mesh = mi.Mesh(name, len(vertices), len(faces), properties, has_vertex_normals=smooth)
    fields = mi.traverse(mesh)
    fields["vertex_positions"] = np.ascontiguousarray(vertices, np.float32).ravel()
    fields["faces"] = np.ascontiguousarray(faces, np.uint32).ravel()
    if smooth:
        normals = np.asarray(part.normals, float) @ np.linalg.inv(pose[:3, :3])
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        fields["vertex_normals"] = np.ascontiguousarray(normals, np.float32).ravel()
    fields.update()
    return mesh

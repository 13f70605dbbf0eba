"""Parts and colours of a GLB, OBJ or PLY file, read by trimesh."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.extras import needed
from isethdr_core.physics.colour.colour_spaces import srgb_decode, srgb_encode

SUFFIXES = (".glb", ".obj", ".ply")
CODES = 255.0  # largest code
STEP = 8  # step to which colours of a texture are rounded, on a scale of 256


@dataclass(frozen=True, eq=False)
class FilePart:
    """A mesh of a file, in the file's units and axes.

    `names` are the names of its node, its mesh and its material. A mesh of several materials is one
    part for each of them; their names are then material, part, mesh and node. In an OBJ with
    materials they are part, material and object. `colours` (m, 4) are sRGB and
    opacity of each face, 0 to 255; None: the file states no colours.
    """

    names: tuple[str, ...]
    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray | None


def read_mesh(path: Path) -> list[FilePart]:
    """Return the parts of a file in the order of their names.

    Skins, animations and normals are not read. The colour of a face is that of the texture at the
    middle of the face. In a GLB, factors and colours of vertices are linear; they are encoded as
    sRGB. A factor multiplies the linear colours of its texture and of its vertices.

    Raises
    ------
    ConfigError : the file cannot be read or holds no triangles, a triangle names a vertex that the
        file does not have, or trimesh is not installed.
    """
    with needed("an asset pack", extra="assets"):
        trimesh = import_module("trimesh")
    try:
        scene = trimesh.load_scene(str(path), process=False, split_objects=True)
        key = lambda node: (_own_name(scene, node), scene.graph[node][1])
        nodes = sorted(scene.graph.nodes_geometry, key=key)
        meshes = [
            n for n in nodes if isinstance(scene.geometry[scene.graph[n][1]], trimesh.Trimesh)
        ]
        for node in meshes:
            _check_faces(scene, node)
        linear = path.suffix.lower() == ".glb"
        parts = [_part(scene, node, linear) for node in meshes]
    except ConfigError:
        raise
    except Exception as error:  # the readers of trimesh raise errors of all kinds
        raise ConfigError(
            f"cannot be read ({type(error).__name__}: {error}); expected a GLB without Draco"
            " compression, an OBJ or a PLY"
        ) from error
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise ConfigError("holds no triangles; expected a mesh")
    return parts


def _check_faces(scene: Any, node: str) -> None:
    """Raise ConfigError if a triangle of a node names a missing vertex; trimesh does not look."""
    mesh = scene.geometry[scene.graph[node][1]]
    faces = np.asarray(mesh.faces, np.int64)
    count = len(mesh.vertices)
    wrong = faces[(faces < 0) | (faces >= count)]
    if wrong.size:
        raise ConfigError(
            f"a triangle of the part {node!r} names the vertex {wrong[0]}, but the part has {count}"
            f" vertices; expected a number from 0 to {count - 1}; the file is damaged: export it"
            " again"
        )


def _part(scene: Any, node: str, linear: bool) -> FilePart:
    """Return a node's mesh in the axes of the file; `linear` says how its colours are coded."""
    matrix, name = scene.graph[node]
    mesh = scene.geometry[name]
    vertices = np.asarray(mesh.vertices, float) @ matrix[:3, :3].T + matrix[:3, 3]
    faces = np.asarray(mesh.faces, np.int64)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    material = ""
    if mesh.visual.kind == "texture":
        material = str(mesh.visual.material.name or "")
    names = tuple(dict.fromkeys(n for n in _names(scene, node, material) if n))
    return FilePart(names, vertices, faces, _colours(mesh, linear))


def _own_name(scene: Any, node: str) -> str:
    """Return the name of a node in its file.

    If its mesh has several primitives, trimesh gives each one a node with random digits behind the
    name.
    """
    parent = scene.graph.transforms.parents.get(node, "")
    mesh = scene.geometry[scene.graph[node][1]]
    is_primitive = mesh.metadata.get("from_gltf_primitive", False)
    random = is_primitive and re.fullmatch(f"{re.escape(parent)}_[0-9a-f]{{6}}", node)
    return parent if random else node


def _names(scene: Any, node: str, material: str) -> tuple[str, ...]:
    """Return the names of a part, the most special one first."""
    name = scene.graph[node][1]
    own = _own_name(scene, node)
    if own == node and material and name.endswith(f"_{material}"):  # an object of an OBJ
        return node, name, material, name.removesuffix(f"_{material}")
    if own == node:
        return node, name, material
    parents = scene.graph.transforms.parents
    beside = {
        scene.graph[other][1]
        for other in scene.graph.nodes_geometry
        if parents.get(other) == own and _own_name(scene, other) == own
    }
    first = next(geometry for geometry in scene.geometry if geometry in beside)
    return material, name, first, own


def _colours(mesh: Any, linear: bool) -> np.ndarray | None:
    """Return the colour of each face (m, 4), sRGB, or None.

    `linear` says whether colours of vertices and of materials are linear.
    """
    visual = mesh.visual
    if visual.kind in ("face", "vertex"):
        colours = np.asarray(visual.face_colors, np.uint8)
        return _encoded(colours / CODES) if linear else colours
    if visual.kind != "texture":
        return None
    factor = _factors(mesh) if linear else np.ones((len(mesh.faces), 4))
    if not linear:
        factor[:, 3] = _opacity(visual.material)
    image = _image(visual.material)
    if image is None or visual.uv is None:
        plain = np.asarray(visual.material.main_color, np.uint8)
        return _encoded(factor) if linear else np.round(plain * factor).astype(np.uint8)
    uv = np.asarray(visual.uv, float)[mesh.faces].mean(1) % 1.0
    height, width = image.shape[:2]
    row = np.minimum(((1 - uv[:, 1]) * height).astype(int), height - 1)
    column = np.minimum((uv[:, 0] * width).astype(int), width - 1)
    found = image[row, column].astype(int)
    if (factor != 1).any():
        light = np.concatenate([srgb_decode(found[:, :3] / CODES), found[:, 3:] / CODES], 1)
        found = _encoded(light * factor).astype(int)
    found[:, :3] = np.minimum(np.round(found[:, :3] / STEP) * STEP, 255)
    return found.astype(np.uint8)


def _factors(mesh: Any) -> np.ndarray:
    """Return the linear factors (m, 4) of the faces of a GLB: the factor of the material, which is
    white if it states none, times the mean colour of the vertices.
    """
    material = mesh.visual.material
    factor = material.baseColorFactor if _is_of_gltf(material) else material.main_color
    out = np.ones((len(mesh.faces), 4))
    if factor is not None:
        out *= np.asarray(factor, float) / CODES
    if "color" in mesh.visual.vertex_attributes:
        colours = np.asarray(mesh.visual.vertex_attributes["color"])
        most = np.iinfo(colours.dtype).max if colours.dtype.kind == "u" else 1.0
        out[:, : colours.shape[1]] *= (colours / most)[mesh.faces].mean(1)
    return out


def _opacity(material: Any) -> float:
    """Return the opacity of a material of an OBJ, 0 to 1: `d`, or 1 less `Tr`; 1 without both."""
    if _is_of_gltf(material):
        return 1.0
    for key, of_number in (("d", lambda value: value), ("tr", lambda value: 1 - value)):
        told = material.kwargs.get(key)
        if told:
            return float(np.clip(of_number(float(np.ravel(told)[-1])), 0.0, 1.0))
    return 1.0


def _encoded(linear: np.ndarray) -> np.ndarray:
    """Return linear colours (..., 4) of 0 to 1 as codes of sRGB; opacity stays linear."""
    colour = srgb_encode(linear[..., :3])
    codes = np.concatenate([colour, linear[..., 3:]], -1) * CODES
    return np.round(codes.clip(0, CODES)).astype(np.uint8)


def _is_of_gltf(material: Any) -> bool:
    """Return whether a material is that of a glTF file; materials of other files are simpler."""
    kinds = import_module("trimesh.visual.material")  # trimesh is an extra
    return isinstance(material, kinds.PBRMaterial)


def _image(material: Any) -> np.ndarray | None:
    """Return the texture of a material (y, x, 4), or None."""
    picture = material.baseColorTexture if _is_of_gltf(material) else material.image
    return None if picture is None else np.asarray(picture.convert("RGBA"))

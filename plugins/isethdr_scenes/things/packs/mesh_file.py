"""Parts and colours of a GLB, OBJ or PLY file, read by trimesh."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from isethdr_core.errors import ConfigError
from isethdr_core.extras import needed

SUFFIXES = (".glb", ".obj", ".ply")
STEP = 8  # step to which colours of a texture are rounded, on a scale of 256


@dataclass(frozen=True, eq=False)
class FilePart:
    """A mesh of a file, in the file's units and axes.

    `names` are the names of its node, its mesh and its material. `colours` (m, 4) are sRGB and
    opacity of each face, 0 to 255; None: the file states no colours.
    """

    names: tuple[str, ...]
    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray | None


def read_mesh(path: Path) -> list[FilePart]:
    """Return the parts of a file in the order of their names.

    Skins, animations and normals are not read. The colour of a face is that of the texture at the
    middle of the face.

    Raises
    ------
    ConfigError : the file cannot be read or holds no triangles, or trimesh is not installed.
    """
    with needed("an asset pack", extra="assets"):
        trimesh = import_module("trimesh")
    try:
        scene = trimesh.load_scene(str(path), process=False)
        nodes = sorted(scene.graph.nodes_geometry)
        meshes = [
            n for n in nodes if isinstance(scene.geometry[scene.graph[n][1]], trimesh.Trimesh)
        ]
        parts = [_part(scene, node) for node in meshes]
    except Exception as error:  # the readers of trimesh raise errors of all kinds
        raise ConfigError(
            f"cannot be read ({type(error).__name__}: {error}); expected a GLB without Draco"
            " compression, an OBJ or a PLY"
        ) from error
    parts = [part for part in parts if len(part.faces)]
    if not parts:
        raise ConfigError("holds no triangles; expected a mesh")
    return parts


def _part(scene: Any, node: str) -> FilePart:
    """Return a node's mesh in the axes of the file."""
    matrix, name = scene.graph[node]
    mesh = scene.geometry[name]
    vertices = np.asarray(mesh.vertices, float) @ matrix[:3, :3].T + matrix[:3, 3]
    faces = np.asarray(mesh.faces, np.int64)
    if np.linalg.det(matrix[:3, :3]) < 0:
        faces = faces[:, ::-1]
    material = ""
    if mesh.visual.kind == "texture":
        material = str(mesh.visual.material.name or "")
    names = tuple(dict.fromkeys(n for n in (node, name, material) if n))
    return FilePart(names, vertices, faces, _colours(mesh))


def _colours(mesh: Any) -> np.ndarray | None:
    """Return the colour of each face (m, 4), or None."""
    visual = mesh.visual
    if visual.kind in ("face", "vertex"):
        return np.asarray(visual.face_colors, np.uint8)
    if visual.kind != "texture":
        return None
    material = visual.material
    plain = np.asarray(material.main_color, np.uint8)
    image = _image(material)
    if image is None or visual.uv is None:
        return np.repeat(plain[None], len(mesh.faces), 0)
    uv = np.asarray(visual.uv, float)[mesh.faces].mean(1) % 1.0
    height, width = image.shape[:2]
    row = np.minimum(((1 - uv[:, 1]) * height).astype(int), height - 1)
    column = np.minimum((uv[:, 0] * width).astype(int), width - 1)
    found = image[row, column].astype(int)
    found[:, :3] = np.minimum(np.round(found[:, :3] / STEP) * STEP, 255)
    return found.astype(np.uint8)


def _image(material: Any) -> np.ndarray | None:
    """Return the texture of a material (y, x, 4), or None."""
    kind = type(material).__name__
    picture = material.baseColorTexture if kind == "PBRMaterial" else material.image
    return None if picture is None else np.asarray(picture.convert("RGBA"))

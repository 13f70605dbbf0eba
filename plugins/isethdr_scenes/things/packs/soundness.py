"""Mistakes of a mesh: NaN, faces without area, holes, faces inside out, sizes out of range."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

LEAST_FACE_M2 = 1e-10  # least area of a face
SAME_PLACE_M = 1e-5  # spacing of the grid to which vertices are rounded to find equal places


def mesh_mistakes(vertices: np.ndarray, faces: np.ndarray, is_open: bool) -> list[str]:
    """Return the mistakes of a mesh.

    Parameters
    ----------
    vertices : (n, 3) m.
    faces : (m, 3) indices of vertices.
    is_open : whether holes are intended.
    """
    found = []
    corners = vertices[faces]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat = int((np.linalg.norm(cross, axis=1) / 2 < LEAST_FACE_M2).sum())
    if flat:
        found.append(
            f"{flat} of {len(faces)} triangles have no area (below {LEAST_FACE_M2:g} m2); remove"
            " degenerate triangles"
        )
    if is_open:
        return found
    edges = open_edges(vertices, faces)
    volume = float((corners[:, 0] * cross).sum() / 6)
    if edges:
        found.append(
            f"the mesh has holes: {edges} edges without a second face; close them, or state"
            " open: true if they are meant"
        )
    elif volume < 0:
        found.append(f"its faces look inwards (volume {volume:.3g} m3); turn them around")
    return found


def number_mistakes(vertices: np.ndarray) -> list[str]:
    """Return a message if vertices (n, 3) are NaN or infinite."""
    bad = int((~np.isfinite(vertices)).any(1).sum())
    if not bad:
        return []
    return [f"{bad} of {len(vertices)} vertices are NaN or infinite; repair the mesh"]


def open_edges(vertices: np.ndarray, faces: np.ndarray) -> int:
    """Return the number of edges at which an odd number of faces meets.

    A closed surface has no such edge. Vertices at the same place count as one vertex.
    """
    places = np.round(vertices / SAME_PLACE_M).astype(np.int64)
    _, ids = np.unique(places, axis=0, return_inverse=True)
    corner = ids.reshape(-1)[faces]
    edges = np.sort(corner[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), 1)
    edges = edges[edges[:, 0] != edges[:, 1]]
    _, count = np.unique(edges, axis=0, return_counts=True)
    return int((count % 2).sum())


def size_mistakes(
    size_m: Sequence[float], ranges: Mapping[str, Sequence[float]], group: str
) -> list[str]:
    """Return a message for each of length, width and height that is out of range.

    Parameters
    ----------
    size_m : length, width and height of a thing, m.
    ranges : least and largest length, width and height, m, by name, in this order.
    group : group of the thing, for messages.
    """
    found = []
    for (name, (least, most)), value in zip(ranges.items(), size_m, strict=True):
        if not least <= value <= most:
            found.append(
                f"its {name} is {value:.3g} m; expected {least:g} to {most:g} m for the group"
                f" {group}; check scale and axes"
            )
    return found

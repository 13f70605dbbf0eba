"""Heights along a road: grades joined by parabolas, as roads are designed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ..profile import Cubic, Profile


class Vertex(NamedTuple):
    """Place where one grade changes into the next, on a parabola with a radius of curvature."""

    s_m: float
    radius_m: float


def grades(grade: Sequence[float], vertices: Sequence[Vertex], height_m: float = 0.0) -> Profile:
    """Return the heights with `grade[k]` before `vertices[k]` and `grade[-1]` after the last.

    Parameters
    ----------
    grade : slopes, m of height per m of way; one more than there are vertices.
    vertices : places where two slopes meet, with the radius of the parabola there, in order of s.
    height_m : height at s = 0, m.
    """
    pieces = [Cubic(-1000.0, height_m - 1000.0 * grade[0], grade[0])]
    for vertex, before, after in zip(vertices, grade, grade[1:]):
        half = vertex.radius_m * abs(after - before) / 2
        if half == 0:
            continue
        start = vertex.s_m - half
        end = vertex.s_m + half
        z = _at(pieces[-1], start)
        bend = (after - before) / (2 * (end - start))
        pieces.append(Cubic(start, z, before, bend))
        pieces.append(Cubic(end, _at(pieces[-1], end), after))
    return Profile(tuple(pieces))


def _at(piece: Cubic, s: float) -> float:
    ds = s - piece.start_m
    return piece.a + ds * (piece.b + ds * piece.c)

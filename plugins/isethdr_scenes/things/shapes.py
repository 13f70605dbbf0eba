"""Shapes of living things: limbs that melt together, lofts, rods, balls and blocks.

Every shape states its extent without a mesh, so that the size of a thing is known before it is
built. A shape can be built at three levels of detail.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from ..geometry.mesh.cutting import halves, inside_of
from ..geometry.mesh.implicit import Field, blend, cone, skin_of
from ..geometry.mesh.piece import Assembly, Piece, shift, unit
from ..geometry.mesh.primitives import ball, box, closed_tubes, grid, tube
from .detail import clean, extent_m
from .thing import Detail

DETAILS: tuple[Detail, ...] = ("near", "middle", "far")
MIDDLE_STEP = 2.2  # sampling step of a surface at middle detail, relative to near
SIDES: dict[Detail, int] = {"near": 10, "middle": 7, "far": 6}  # number of sides of tubes
LEAST_M = 1e-3  # least length of a limb as a tube; a shorter limb becomes an upright tube
# factor on the radii of tubes with 6 sides; their section is then about that of round tubes
FLAT = 1.06
Extent = tuple[np.ndarray, np.ndarray]  # least and greatest x, y, z, m
Values = Callable[[np.ndarray], np.ndarray]  # maps points (n, 3), m, to values, negative inside


class Shape(Protocol):
    """A shape of a figure."""

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates, m."""
        ...

    def pieces(self, detail: Detail) -> list[Piece]:
        """Return the meshes at a level of detail."""
        ...


@dataclass(frozen=True)
class Limb:
    """A capsule from `a` to `b`; `width` stretches its cross-section along y."""

    a: Sequence[float]
    b: Sequence[float]
    radius_a: float
    radius_b: float
    width: float = 1.0

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates, m."""
        reach = np.array([1.0, self.width, 1.0])
        a = np.asarray(self.a, float)
        b = np.asarray(self.b, float)
        low = np.minimum(a - self.radius_a * reach, b - self.radius_b * reach)
        return low, np.maximum(a + self.radius_a * reach, b + self.radius_b * reach)

    def field(self) -> Field:
        """Return the field for `geometry.mesh.implicit.blend`: distance, m, negative inside."""
        narrow = np.array([1.0, 1 / self.width, 1.0])
        round_limb = cone(
            np.asarray(self.a) * narrow, np.asarray(self.b) * narrow, self.radius_a, self.radius_b
        )
        if self.width == 1.0:
            return round_limb
        # the scale keeps the gradient of the field at most 1
        scale = min(1.0, self.width)

        def distance(points: np.ndarray) -> np.ndarray:
            return scale * round_limb(points * narrow)

        return Field(distance, *self.extent())


@dataclass(frozen=True)
class Patch:
    """The part of a surface where `inside` is negative, with a name and a material of its own."""

    name: str
    material: str
    inside: Values
    coarsest: Detail = "far"  # coarsest level that shows the patch


@dataclass(frozen=True)
class Mass:
    """Limbs that melt into one surface."""

    name: str
    material: str
    limbs: tuple[Limb, ...]
    blend_m: float = 0.03
    step_m: float = 0.016  # sampling step at near detail
    folds_m: float = 0.0
    seed: int = 0
    patches: tuple[Patch, ...] = ()
    trim: Values | None = None  # the surface is kept where this is negative
    coarsest: Detail = "far"  # coarsest level at which it is built

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates of the limbs, m."""
        ends = [limb.extent() for limb in self.limbs]
        return np.min([low for low, _ in ends], 0), np.max([high for _, high in ends], 0)

    def pieces(self, detail: Detail) -> list[Piece]:
        """Return the surface, and its patches as separate pieces."""
        if DETAILS.index(detail) > DETAILS.index(self.coarsest):
            return []
        level = DETAILS.index(detail)
        patches = [p for p in self.patches if DETAILS.index(p.coarsest) >= level]
        if detail == "far":
            # faces must be about as small as a patch that is cut out of them
            steps = 4 if patches else 1
            surface = tubes_of(self.limbs, steps).named(self.name, self.material)
            if self.trim is not None:
                surface = inside_of(surface, self.trim(surface.vertices))
        else:
            step = self.step_m * (MIDDLE_STEP if detail == "middle" else 1.0)
            surface = skin_of(self._field(), step, self.name, self.material)
        out = []
        for patch in patches:
            part, surface = halves(surface, patch.inside(surface.vertices))
            out.append(part.named(patch.name, patch.material))
        return [surface, *out]

    def _field(self) -> Field:
        whole = blend([limb.field() for limb in self.limbs], self.blend_m, self.folds_m, self.seed)
        return whole if self.trim is None else whole.within(self.trim)


@dataclass(frozen=True)
class Ring:
    """A cross-section of a loft: an ellipse parallel to the ground."""

    centre: Sequence[float]
    half_x: float
    half_y: float


@dataclass(frozen=True)
class Loft:
    """Cloth through rings from top to bottom, closed below, such as a skirt or a coat's tail."""

    name: str
    material: str
    rings: tuple[Ring, ...]
    pleats: int = 0
    pleat_m: float = 0.0

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates, m."""
        half = [np.array([r.half_x, r.half_y, 0.0]) for r in self.rings]
        centre = [np.asarray(r.centre, float) for r in self.rings]
        low = np.min([c - h for c, h in zip(centre, half, strict=True)], 0)
        return low, np.max([c + h for c, h in zip(centre, half, strict=True)], 0)

    def pieces(self, detail: Detail) -> list[Piece]:
        """Return the cloth with its underside."""
        sides = {"near": 60, "middle": 28, "far": 10}[detail]
        angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
        rows = []
        for k, ring in enumerate(self.rings):
            depth = self.pleat_m * k / max(len(self.rings) - 1, 1) if detail != "far" else 0.0
            wave = depth * (0.5 * np.cos(self.pleats * angle) - 0.5)
            x = (ring.half_x + wave) * np.cos(angle)
            y = (ring.half_y + wave) * np.sin(angle)
            rows.append(np.asarray(ring.centre) + np.stack([x, y, 0 * x], 1))
        last = self.rings[-1]
        inner = np.asarray(last.centre) + [0, 0, 0.01]
        rows.append(inner + 0.02 * (rows[-1] - np.asarray(last.centre)))
        points = np.stack(rows)
        # rings run downwards and angles to the left: outward is d/du x d/dv
        return [grid(points, self.name, self.material, close_v=True)]


@dataclass(frozen=True)
class Rod:
    """A tube along a path, with one radius per point, m."""

    name: str
    material: str
    path: tuple[Sequence[float], ...]
    radii: tuple[float, ...]
    coarsest: Detail = "far"

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates of the rings, m."""
        path = np.asarray(self.path, float)
        along = unit(np.gradient(path, axis=0))
        reach = np.asarray(self.radii)[:, None] * np.sqrt(np.maximum(1 - along**2, 0))
        return (path - reach).min(0), (path + reach).max(0)

    def pieces(self, detail: Detail) -> list[Piece]:
        """Return the tube."""
        if DETAILS.index(detail) > DETAILS.index(self.coarsest):
            return []
        return [tube(self.path, self.radii, self.name, self.material, SIDES[detail])]


@dataclass(frozen=True)
class Ball:
    """An ellipsoid along the axes."""

    name: str
    material: str
    centre: Sequence[float]
    radii: Sequence[float]
    coarsest: Detail = "far"

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates, m."""
        centre = np.asarray(self.centre, float)
        radii = np.asarray(self.radii, float)
        return centre - radii, centre + radii

    def pieces(self, detail: Detail) -> list[Piece]:
        """Return the ellipsoid."""
        if DETAILS.index(detail) > DETAILS.index(self.coarsest):
            return []
        rings = {"near": 8, "middle": 6, "far": 4}[detail]
        return [ball(self.centre, self.radii, self.name, self.material, rings)]


@dataclass(frozen=True)
class Block:
    """A box with rounded edges. The columns of `axes` are the directions of its sides."""

    name: str
    material: str
    centre: Sequence[float]
    size: Sequence[float]
    rounding_m: float = 0.03
    axes: np.ndarray = field(default_factory=lambda: np.eye(3))

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates, m."""
        inner = np.asarray(self.size, float) / 2 - self.rounding_m
        half = np.abs(self.axes) @ np.maximum(inner, 0) + self.rounding_m
        centre = np.asarray(self.centre, float)
        return centre - half, centre + half

    def pieces(self, detail: Detail) -> list[Piece]:
        """Return the box."""
        rounding = 0.0 if detail == "far" else self.rounding_m
        steps = 3 if detail == "near" else 1
        matrix = np.eye(4)
        matrix[:3, :3] = self.axes
        matrix[:3, 3] = self.centre
        made = box((0, 0, 0), self.size, self.name, self.material, rounding, steps)
        return [made.moved(matrix)]


def tubes_of(limbs: Sequence[Limb], steps: int = 1) -> Piece:
    """Return limbs as tubes with narrower ends and few faces.

    Parameters
    ----------
    limbs : the limbs.
    steps : number of faces along each limb, without the ends.
    """
    width = np.array([limb.width for limb in limbs])
    across = np.stack([np.ones_like(width), width, np.ones_like(width)], 1)
    a = np.array([limb.a for limb in limbs], float) * (1 / across)
    b = np.array([limb.b for limb in limbs], float) * (1 / across)
    radius_a = np.array([limb.radius_a for limb in limbs])[:, None]
    radius_b = np.array([limb.radius_b for limb in limbs])[:, None]
    length = np.array([np.linalg.norm(way) for way in b - a])[:, None]
    along = np.where(length > LEAST_M, (b - a) / np.maximum(length, LEAST_M), [0.0, 0.0, 1.0])
    b = a + along * np.maximum(length, LEAST_M)
    t = np.linspace(0, 1, steps + 1)
    shaft = a[:, None] + t[:, None] * (b - a)[:, None]
    first = a - 0.7 * along * radius_a
    last = b + 0.7 * along * radius_b
    paths = np.concatenate([first[:, None], shaft, last[:, None]], 1)
    radii = radius_a + t * (radius_b - radius_a)
    radii = np.concatenate([0.6 * radius_a, radii, 0.6 * radius_b], 1)
    made = closed_tubes(paths, FLAT * radii, SIDES["far"])
    across = np.repeat(across, len(made.vertices) // len(limbs), 0)
    # normals need the inverse scale, so that they stay perpendicular to the stretched surface
    normals = unit(made.normals * (1 / across))
    return replace(made, vertices=made.vertices * across, normals=normals)


@dataclass(frozen=True)
class Figure:
    """The shapes of one living thing, in coordinates of their own."""

    name: str
    shapes: tuple[Shape, ...]

    def extent(self) -> Extent:
        """Return the least and the greatest coordinates of all shapes, m."""
        ends = [shape.extent() for shape in self.shapes]
        return np.min([low for low, _ in ends], 0), np.max([high for _, high in ends], 0)

    def size_m(self) -> tuple[float, float, float]:
        """Return length, width and height, m."""
        low, high = self.extent()
        length, width, height = (round(float(v), 3) for v in high - low)
        return length, width, height

    def assembly(self, detail: Detail, standing: bool = True) -> Assembly:
        """Return the meshes, centred on z = 0 if `standing`, else in the shapes' coordinates."""
        out = Assembly(self.name)
        for shape in self.shapes:
            out.add(*shape.pieces(detail))
        out = clean(out)
        return stood(out) if standing else out


def stood(assembly: Assembly) -> Assembly:
    """Return the assembly centred in x and y, with its lowest point at z = 0."""
    low, high = extent_m(assembly)
    x, y = -(low + high)[:2] / 2
    return assembly.moved(shift(x, y, -low[2]))

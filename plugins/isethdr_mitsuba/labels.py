"""Labels from one ray through the centre of each tile. All labels of a tile belong to the same hit,
and are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from isethdr_core.data.categories import CATEGORIES
from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.physics.optics.projection import depth_m
from isethdr_core.quantities import LABELS, LARGEST_HALF_FIELD_DEG, MOTION
from isethdr_core.runs.processor import processors

from .illuminance import illuminances
from .lamps.visible_lamps import NEAR_M, cut
from .motion import motion_label
from .paths.device_memory import aligned
from .world.triangle_chords import straightened

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Model, SceneDescription

    from .world.geometry import World
    from .world.view import View

PAIRS = 1_000_000  # number of (triangle, tile) pairs tested at a time; limits memory
# Largest deviation of a curved edge from its chord on a grid of angles, as a share of a tile.
# Bounding boxes are enlarged by twice this deviation.
OFF = 0.25


def label_tiles(
    world: World,
    view: View,
    description: SceneDescription,
    label_names: frozenset[Any] | frozenset[str],
    normalise: str = "intensity",
) -> tuple[dict[Any, Any] | dict[str, np.ndarray], list[Any] | None]:
    """Return the requested labels, and the table of objects if `instance` is among them.

    depth : m along the optical axis, negative behind the camera; distance : m along the ray. Both
        are infinite where the centre of the tile shows sky.
    instance : uint32, position of the object in the description, counted from 1; 0 is the sky.
    category : uint16, a number of isethdr_core.data.categories.
    normal : unit vector of the smoothed surface in world axes, turned towards the camera; 0 for the
        sky.
    motion : added if the scene states its next frame (module `motion`).

    Parameters
    ----------
    world : scene with the shapes to label.
    view : tiles of the frame.
    description : scene description with objects and next frame.
    label_names : labels to return; if empty, the result is ({}, None).
    normalise : as `MitsubaRenderer.normalise`, for the illuminance of the objects.

    Raises
    ------
    ConfigError : an object has an unknown category.
    """
    if not label_names:
        return {}, None
    numbers = category_numbers(description)
    rows, columns = view.shape
    x, y = (a.ravel() for a in np.meshgrid(view.x, view.y))
    direction = view.to_world(view.rays(x, y))
    instance, distance, normal = (_first_hits if dr.is_jit_v(mi.Float) else _first_hits_scalar)(
        world, view.origin_m, direction
    )
    normal *= -np.sign(np.einsum("nk,nk->n", normal, direction))[:, None]
    labels = {
        "instance": instance.astype(np.uint32),
        "category": numbers[instance],
        "distance": distance.astype(np.float32),
        "depth": depth_m(distance, x, y, view.projection).astype(np.float32),
    }
    labels = {name: value.reshape(rows, columns) for name, value in labels.items()}
    labels["normal"] = normal.reshape(rows, columns, 3).astype(np.float32)
    objects = None
    if "instance" in label_names:
        lit = illuminances(world, view, description, labels, normalise)
        objects = object_table(description, view, labels, lit)
    asked_labels = {name: labels[name] for name in label_names if name != MOTION}
    return asked_labels | motion_label(description, view, labels), objects


def check_labels(label_names: frozenset[str], moves: bool) -> None:
    """Raise ConfigError if a label is unknown, or if `motion` is demanded of a scene that does not
    state its next frame. Of other scenes it is added to all demanded labels.

    Parameters
    ----------
    label_names : labels that are demanded.
    moves : whether the scene states its next frame.
    """
    if MOTION in label_names and not moves:
        raise ConfigError(
            "the label 'motion' is demanded, but the scene does not state its next frame; expected"
            " a scene with frames per second; type for example scene.frames_per_s=30"
        )
    for name in sorted(set(label_names) - {*LABELS, MOTION}):
        raise ConfigError(
            f"the label {name!r} is demanded, which this renderer does not know"
            + did_you_mean(name, (*LABELS, MOTION))
        )


def category_numbers(description: SceneDescription) -> np.ndarray:
    """Return the category (object + 1,), uint16, of the sky, 0, and of each object.

    Raises
    ------
    ConfigError : an object has an unknown category.
    """
    numbers = [0]
    for placed in description.objects:
        if placed.category not in CATEGORIES:
            raise ConfigError(
                f"object {placed.name!r} has the unknown category {placed.category!r}"
                + did_you_mean(placed.category, CATEGORIES)
            )
        numbers.append(CATEGORIES[placed.category])
    return np.array(numbers, np.uint16)


def instances(world: World, view: View) -> np.ndarray:
    """Return the number (row, column) of the object at the centre of each tile; 0 for the sky."""
    x, y = (a.ravel() for a in np.meshgrid(view.x, view.y))
    ray = _rays(view.origin_m, view.to_world(view.rays(x, y)))
    hits = world.scene.ray_intersect_preliminary(ray, coherent=True)
    valid = hits.is_valid()
    shape = _shape(hits)
    dr.eval(valid, shape)
    return _labels_of_hits(world, valid, shape)[0].reshape(view.shape)


def cut_labels(
    cut: tuple[int, int], labels: dict, objects: Sequence[dict[str, int | str]] | None
) -> tuple[dict[Any, Any] | dict[str, np.ndarray], list[Any] | None]:
    """Return labels and object table without the outermost `cut` (rows, columns). The boxes of
    objects refer to the remaining tiles.

    Parameters
    ----------
    cut : (rows, columns) to leave out on each side.
    labels : {name: (row, column) label}.
    objects : object table, or None.
    """
    rows, columns = (slice(c, -c or None) for c in cut)
    moved = objects and [
        {
            **o,
            **{k: [o[k][0] - cut[1], o[k][1] - cut[0], *o[k][2:]] for k in ("box", "box_full")},
        }
        for o in objects
    ]
    return {name: values[rows, columns] for name, values in labels.items()}, moved


def object_table(
    description: SceneDescription,
    view: View,
    labels: dict[str, np.ndarray],
    illuminance: dict[int, dict[str, float]],
) -> list[dict]:
    """Return the objects that are visible in at least one tile, as dictionaries of plain numbers
    and names.

    Parameters
    ----------
    description : scene.
    view : tiles of the frame.
    labels : {name: (row, column)} with `instance` and `distance`.
    illuminance : {object number: {light group: lx}} of `illuminances`.
    """
    instance = labels["instance"]
    shown = [n for n in np.unique(instance).tolist() if 0 < n <= len(description.objects)]
    objects = [description.objects[n - 1] for n in shown]
    whole_of = lambda placed: whole_object(description.models[placed.model], placed.pose, view)
    with ThreadPoolExecutor(processors()) as threads:
        wholes = list(threads.map(whole_of, objects))
    out = []
    for number, placed, whole in zip(shown, objects, wholes, strict=True):
        rows, columns = np.nonzero(instance == number)
        corner = int(columns.min()), int(rows.min())
        out.append(
            {
                "instance": number,
                "category": placed.category,
                "name": placed.name,
                "box": [
                    *corner,
                    int(columns.max()) + 1 - corner[0],
                    int(rows.max()) + 1 - corner[1],
                ],
                "box_full": whole.box,
                "truncation": truncation(whole.box, view),
                # exact for tile centres, like the labels; tiles of the margin count
                "visible_fraction": min(1.0, len(rows) / max(whole.tiles, len(rows))),
                "distance_m": float(labels["distance"][rows, columns].min()),
                "position_m": [float(v) for v in np.asarray(placed.pose, float)[:3, 3]],
                "illuminance_lx": illuminance[number],
            }
        )
    return out


class Whole(NamedTuple):
    """Extent of an object in the picture with nothing in front of it."""

    tiles: int  # number of tiles that it covers
    box: list[float]  # [x, y, width, height] in tiles, not cut at the frame


def whole_object(model: Model, pose: np.ndarray, view: View) -> Whole:
    """Return the number of tiles that an object would cover with nothing in front of it, and its
    bounding box. The triangles are rasterised.

    On a grid of tangents, the box excludes parts of the object behind the camera or more than 75
    degrees off the axis.

    Parameters
    ----------
    model : model of the object.
    pose : (4, 4) pose of the object in the world.
    view : tiles of the frame.
    """
    covered = np.zeros(view.shape, bool)
    triangles = []
    low = np.full(2, np.inf)
    high = np.full(2, -np.inf)
    for part in model.parts:
        world = (
            np.asarray(part.vertices, float) @ np.asarray(pose, float)[:3, :3].T
            + np.asarray(pose, float)[:3, 3]
        )
        corners = view.to_camera(world)
        faces = np.asarray(part.faces, int)
        if view.projection != "tangent":
            flat = view.coordinates(corners)
            low = np.minimum(low, flat.min(0))
            high = np.maximum(high, flat.max(0))
        elif (corners[:, 2] > NEAR_M).all():
            flat = view.coordinates(corners)
            low = np.minimum(low, flat.min(0))
            high = np.maximum(high, flat.max(0))
            faces = faces[_reach_centres(flat, faces, view)]
        else:
            first, last, useful = _boxes(corners[faces], view)
            if useful.any():
                low = np.minimum(low, first[useful].min(0))
                high = np.maximum(high, last[useful].max(0))
        triangles.append(corners[faces])
    if triangles:
        fill(covered, view, np.concatenate(triangles))
    if view.projection == "tangent":
        most = np.tan(np.radians(LARGEST_HALF_FIELD_DEG))
        low = np.clip(low, -most, most)
        high = np.clip(high, -most, most)
    pitch = np.array([view.pitch_x, view.pitch_y])
    first = (low - [view.x[0], view.y[0]]) / pitch + 0.5
    return Whole(int(covered.sum()), [*map(float, first), *map(float, (high - low) / pitch)])


def truncation(box: Sequence[float], view: View) -> float:
    """Return the share of the area of a box that lies outside the camera's field, 0..1."""
    rows, columns = view.in_field()
    inside = [
        max(min(start + size, side.stop) - max(start, side.start), 0.0)
        for start, size, side in zip(box[:2], box[2:], (columns, rows), strict=True)
    ]
    area = box[2] * box[3]
    return max(0.0, float(1 - inside[0] * inside[1] / area)) if area > 0 else 0.0


def _reach_centres(flat: np.ndarray, faces: np.ndarray, view: View) -> np.ndarray:
    """Return which `faces` have a bounding box that may contain the centre of a tile. Most
    triangles of a fine mesh lie between the centres.

    The test runs on the vertices of the mesh, not on the corners of each triangle, because a mesh
    has about six triangle corners per vertex. Integers of few bytes hold the tile centres on both
    sides of a vertex.
    """
    places = (flat - [view.x[0], view.y[0]]) / [view.pitch_x, view.pitch_y]
    some = np.ones(len(faces), bool)
    for place, count in zip(places.T, view.shape[::-1]):
        place = np.clip(place, -0.5, count - 0.5)  # beyond the first and the last centre
        # `fill` allows for 1e-9 of a tile
        after, upto = (
            np.floor(place + more).astype(np.int16 if count < 2**15 else int)
            for more in (-2e-9, 2e-9)
        )
        a, b, c = faces.T
        some &= np.maximum(np.maximum(upto[a], upto[b]), upto[c]) > np.minimum(
            np.minimum(after[a], after[b]), after[c]
        )
    return some


def fill(covered: np.ndarray, view: View, triangles: np.ndarray) -> None:
    """Set `covered` at the tiles whose centre ray meets one of the `triangles` (n, 3, 3), in camera
    axes.

    A centre ray meets a triangle if it lies on the same side of three planes: each contains the
    pinhole and one edge. The test also holds for triangles that extend behind the camera, as long
    as the intersection is in front.

    Parameters
    ----------
    covered : (row, column) booleans, changed in place.
    view : tiles of the frame.
    triangles : (n, 3, 3) corners in camera axes, m.
    """
    if view.projection != "tangent":
        triangles, _ = straightened(triangles, view, OFF * min(view.pitch_x, view.pitch_y))
    low, high, useful = _tile_boxes(triangles, view)
    triangles = triangles[useful]
    low = low[useful]
    high = high[useful]
    a, b, c = (triangles[:, k] for k in range(3))
    sides = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], 1)
    sides *= np.sign(np.einsum("nk,nk->n", a, sides[:, 0]))[:, None, None]
    wide, tall = (high - low + 1).T
    chunk = np.cumsum(wide * tall) // PAIRS
    for few in np.split(np.arange(len(sides)), np.flatnonzero(np.diff(chunk)) + 1):
        count = wide[few] * tall[few]
        which = np.repeat(few, count)
        place = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        column = low[which, 0] + place % wide[which]
        row = low[which, 1] + place // wide[which]
        ray = view.rays(view.x[column], view.y[row])
        height = np.einsum("nsk,nk->ns", sides[which], ray)
        met = (height >= 0).all(1) & (height.max(1) > 0)  # a triangle seen edge-on covers nothing
        covered[row[met], column[met]] = True


def _tile_boxes(triangles: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the first and last tile (column, row) of the bounding box of each triangle, and which
    triangles have one.
    """
    if view.projection == "tangent":
        low, high, useful = _boxes(triangles, view)
    else:
        flat = view.coordinates(triangles)
        more = 2 * OFF * min(view.pitch_x, view.pitch_y)
        low = flat.min(1) - more
        high = flat.max(1) + more
        useful = np.ones(len(flat), bool)
    low, high, some = _tiles_within(low, high, view)
    return low, high, useful & some


def _tiles_within(
    low: np.ndarray, high: np.ndarray, view: View
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the first and last tile (column, row) whose centre lies within low to high (n, 2), and
    where such a tile exists.
    """
    first = np.array([view.x[0], view.y[0]])
    pitch = np.array([view.pitch_x, view.pitch_y])
    last = np.array([len(view.x), len(view.y)]) - 1
    low = np.ceil((low - first) / pitch - 1e-9)
    high = np.floor((high - first) / pitch + 1e-9)
    low = np.clip(low, 0, last + 1).astype(int)
    high = np.clip(high, -1, last).astype(int)
    return low, high, (low <= high).all(1)


def _boxes(triangles: np.ndarray, view: View) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the lowest and highest tangents (n, 2) of each triangle, and which triangles lie in
    front of the camera.
    """
    z = triangles[..., 2]
    useful = (z > NEAR_M).any(1)
    low = np.zeros((len(z), 2))
    high = np.zeros((len(z), 2))
    for some in (useful & (z > NEAR_M).all(1), useful & ~(z > NEAR_M).all(1)):
        # triangles that extend behind the camera are cut there, because corners behind it have no
        # tangents
        polygon = triangles[some]
        if not (z[some] > NEAR_M).all():
            polygon = cut(polygon, np.broadcast_to([0.0, 0, 1], (len(polygon), 3)), NEAR_M)
        flat = view.coordinates(polygon)
        low[some], high[some] = flat.min(1), flat.max(1)
    return low, high, useful


def _rays(origin: np.ndarray, direction: np.ndarray) -> mi.Ray3f:
    """Return the rays from `origin` (3,) towards `direction` (n, 3). Their values are data in
    aligned memory, so that all cameras use the same compiled code.
    """
    return mi.Ray3f(
        mi.Point3f(*(dr.opaque(mi.Float, float(v)) for v in origin)),
        mi.Vector3f(*(mi.Float(aligned(d, np.float32)) for d in direction.T)),
    )


def _shape(hits: Any) -> mi.UInt32:
    """Return the number of the instance that each ray hits, or of the shape if it belongs to no
    instance. The shape inside an instance is shared by several objects; the instance identifies
    the object.
    """
    instance = dr.reinterpret_array(mi.UInt32, hits.instance)
    return dr.select(instance != 0, instance, dr.reinterpret_array(mi.UInt32, hits.shape))


def _labels_of_hits(
    world: World, valid: mi.Bool, shape: mi.UInt32
) -> tuple[np.ndarray, np.ndarray]:
    """Return the object number (n,) of hits, and which (n,) of them show an object."""
    valid = np.array(valid)
    number = world.table(lambda s: s.label)[np.where(valid, np.array(shape), 0)]
    valid &= number > 0  # sun and moon are sky
    return np.where(valid, number, 0), valid


def _first_hits(
    world: World, origin: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    ray = _rays(origin, direction)
    si = world.scene.ray_intersect_preliminary(ray, coherent=True).compute_surface_interaction(ray)
    hit = si.is_valid()
    shape = _shape(si)
    # evaluated in one kernel: separate kernels would each trace the rays again
    dr.eval(hit, shape, si.t, si.sh_frame.n)
    number, valid = _labels_of_hits(world, hit, shape)
    return (
        number,
        np.where(valid, np.array(si.t, float), np.inf),
        np.array(si.sh_frame.n, float).T * valid[:, None],
    )


def _first_hits_scalar(
    world: World, origin: np.ndarray, direction: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    number = np.zeros(len(direction), int)
    distance = np.full(len(direction), np.inf)
    normal = np.zeros((len(direction), 3))
    label = {s.shape.id(): s.label for s in world.shapes}
    for k, d in enumerate(direction):
        si = world.scene.ray_intersect(mi.Ray3f(origin, d))
        own = label[(si.instance or si.shape).id()] if si.is_valid() else 0
        if own:  # sun and moon are sky
            number[k], distance[k], normal[k] = (
                own,
                si.t,
                np.array(si.sh_frame.n),
            )
    return number, distance, normal

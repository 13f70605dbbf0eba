"""View: the camera as a grid of tiles in tangents or angles, with overscan, and its axes in the
world.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from isethdr_core.errors import ConfigError, did_you_mean
from isethdr_core.physics.optics import projection as projections
from isethdr_core.pipeline.field_check import camera_field
from isethdr_core.quantities import LARGEST_HALF_FIELD_DEG

if TYPE_CHECKING:
    from isethdr_core.data.scene_description import Camera

SQUARE = 1e-3  # largest relative difference between the sides of a tile that counts as square
UNITS = {"tangent": "tangents", "equidistant": "angles"}


@dataclass(frozen=True, eq=False)
class View:
    """The grid of tiles of a pinhole camera, and the pose of the camera in the world."""

    # (columns,) field coordinates of the tile centres to the right: tangents, or angles in radians
    # if `projection` is equidistant
    x: np.ndarray
    y: np.ndarray  # (rows,) field coordinates of the tile centres downwards
    pitch_x: float  # width of a tile, in the unit of x
    pitch_y: float  # height of a tile, in the unit of y
    field: tuple[float, float]  # nominal (width, height) in that unit, without margin
    origin_m: np.ndarray  # (3,) pinhole in the world
    right: np.ndarray  # (3,) unit vector in the world
    down: np.ndarray  # (3,) unit vector in the world
    forward: np.ndarray  # (3,) unit vector in the world
    projection: str = "tangent"
    cut: tuple[int, int] = (0, 0)  # rows and columns that were left out on each side

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return len(self.y), len(self.x)

    @property
    def whole(self) -> tuple[int, int]:
        """Rows and columns of the complete grid, including tiles that were left out. Tiles are
        numbered in this grid, so that the paths of a tile do not depend on which tiles are left
        out.
        """
        return self.shape[0] + 2 * self.cut[0], self.shape[1] + 2 * self.cut[1]

    def within_field(self) -> View:
        """Return the tiles of the camera's field alone."""
        rows, columns = self.in_field()
        return replace(self, y=self.y[rows], x=self.x[columns], cut=(rows.start, columns.start))

    def in_field(self) -> tuple[slice, slice]:
        """Return the slices of rows and columns that lie in the camera's field."""
        beyond = (
            round((n * p - side) / (2 * p))
            for n, p, side in zip(self.shape, (self.pitch_y, self.pitch_x), self.field[::-1])
        )
        return tuple(slice(c, n - c) for c, n in zip(beyond, self.shape))

    def of(self, camera: Camera) -> View:
        """Return the same grid of tiles with the pose of another camera."""
        right, down, forward = _axes(camera)
        origin = np.asarray(camera.position_m, float)
        return replace(self, origin_m=origin, right=right, down=down, forward=forward)

    def to_camera(self, points_m: np.ndarray) -> np.ndarray:
        """Return (n, 3) world points in camera axes (right, down, forward), m."""
        return (np.asarray(points_m, float) - self.origin_m) @ np.stack(
            [self.right, self.down, self.forward], 1
        )

    def to_world(self, directions: np.ndarray) -> np.ndarray:
        """Return (n, 3) camera directions (right, down, forward) in world axes."""
        return np.asarray(directions, float) @ np.stack([self.right, self.down, self.forward])

    def rays(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return (..., 3) unit vectors in camera axes towards field coordinates `x` and `y`, which
        are broadcast.
        """
        return np.moveaxis(projections.direction(x, y, self.projection), 0, -1)

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """Return (..., 2) field coordinates of points (..., 3) in camera axes. Tangents are valid
        only for points in front of the camera.
        """
        x, y, z = np.moveaxis(np.asarray(points, float), -1, 0)
        if self.projection == "tangent":
            return np.stack([x / z, y / z], -1)
        across = np.hypot(x, y)
        # angle / sine of it, which is 1 on the axis
        scale = np.divide(
            np.arctan2(across, z), across, out=1 / np.maximum(np.abs(z), 1e-300), where=across > 0
        )
        return np.stack([x * scale, y * scale], -1)


def view_of(camera: Camera, width: int, height: int, margin: float) -> View:
    """Return the view of `camera` with `width` x `height` tiles on its field, and overscan.

    Parameters
    ----------
    camera : position, direction and field of the camera.
    width : number of tiles across the field.
    height : number of tiles down the field.
    margin : overscan on every side, as a share of the field.

    Raises
    ------
    ConfigError : a value is outside its range, or the grid does not cover these directions.
    """
    for name, value in (("width", width), ("height", height)):
        if value < 1:
            raise ConfigError(
                f"renderer {name} is {value}; expected at least 1 tile; type renderer.{name}=360"
            )
    if not 0 <= margin <= 2:
        raise ConfigError(
            f"renderer margin is {margin:g}; expected 0 to 2 of the field on each side; type"
            " renderer.margin=0.1"
        )
    if camera.projection not in projections.PROJECTIONS:
        raise ConfigError(
            "the camera's projection is"
            f" {camera.projection!r}{did_you_mean(str(camera.projection), projections.PROJECTIONS)}"
        )
    degrees = camera.horizontal_field_deg
    widest = {"tangent": 2 * LARGEST_HALF_FIELD_DEG, "equidistant": 360}[camera.projection]
    if not 0 < degrees < widest:
        raise ConfigError(
            f"the camera's horizontal field is {degrees:g} degrees; expected above 0 and below"
            f" {widest:g} on a grid of {UNITS[camera.projection]}"
            + "; type scene.projection=equidistant for more"
            * (camera.projection == "tangent")
        )
    field_x, field_y, _ = camera_field(degrees, camera.aspect, camera.projection)
    right, down, forward = _axes(camera)
    pitch = field_x / width, field_y / height
    tiles = [np.arange(-round(n * margin), n + round(n * margin)) for n in (width, height)]
    view = View(
        x=(tiles[0] - (width - 1) / 2) * pitch[0],
        y=(tiles[1] - (height - 1) / 2) * pitch[1],
        pitch_x=pitch[0],
        pitch_y=pitch[1],
        field=(field_x, field_y),
        origin_m=np.asarray(camera.position_m, float),
        right=right,
        down=down,
        forward=forward,
        projection=camera.projection,
    )
    _check_reach(view, camera, margin)
    return view


def _axes(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the unit vectors (3,) right, down and forward of a camera in the world."""
    forward = np.subtract(camera.target_m, camera.position_m).astype(float)
    length = np.linalg.norm(forward)
    if length == 0:
        raise ConfigError(
            f"the camera looks at its own position {camera.position_m}; expected another target_m"
        )
    forward /= length
    # world z is up; a camera that looks straight up or down keeps world x (forward) as the top of
    # its picture
    up = np.array([0.0, 0, 1]) if abs(forward[2]) < 1 - 1e-9 else np.array([1.0, 0, 0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return right, np.cross(forward, right), forward


def check_square(width: int, height: int, aspect: float) -> None:
    """Raise ConfigError unless `width` x `height` tiles on a field of `aspect` are square.

    The message names the nearest numbers of tiles that make square tiles.

    Parameters
    ----------
    width : number of tiles across the field.
    height : number of tiles down the field.
    aspect : width / height of the field.
    """
    if _square(width, height, aspect):
        return
    good_width, good_height = nearest_square(width, aspect)
    raise ConfigError(
        f"variant scalar has {width} x {height} tiles on a field of aspect {aspect:.4g}; expected "
        f"square tiles; type renderer.width={good_width} renderer.height={good_height}, "
        "or renderer.variant=auto"
    )


def nearest_square(width: int, aspect: float) -> tuple[int, int]:
    """Return the width nearest to `width`, and its height, that make square tiles."""
    for step in count():
        for near in (width + step, width - step):
            height = round(near / aspect)
            if near > 0 and height > 0 and _square(near, height, aspect):
                return near, height
    raise AssertionError("unreachable: many tiles are always square enough")


def _square(width: int, height: int, aspect: float) -> bool:
    return abs(aspect * height / width - 1) <= SQUARE


def _check_reach(view: View, camera: Camera, margin: float) -> None:
    """Refuse, before rendering, tiles farther off the axis than the projection allows."""
    edge = [float(np.abs(c).max()) for c in (view.x, view.y)]
    reach = _reach_deg(view, edge)
    if view.projection == "tangent":
        most = LARGEST_HALF_FIELD_DEG
        where = "edge"
        instead = "scene.projection=equidistant"
    else:
        most = 180.0
        where = "corners"
        instead = (
            f"scene.horizontal_field_deg={np.floor(camera.horizontal_field_deg * 180 / reach):g}"
        )
    if reach > most:
        pitches = (view.pitch_x, view.pitch_y)
        field = [side / 2 - pitch / 2 for side, pitch in zip(view.field, pitches, strict=True)]
        narrow = _reach_deg(view, field) <= most
        raise ConfigError(
            f"the camera's field of {camera.horizontal_field_deg:g} degrees with a margin of"
            f" {margin:g} reaches {reach:.1f} degrees off the axis at its {where}; expected at most"
            f" {most:g} on a grid of {UNITS[view.projection]}; type {instead}"
            + ", or renderer.margin=0"
            * narrow
        )


def _reach_deg(view: View, edge: Sequence[float]) -> float:
    """Return the largest angle off the axis, degrees, of a grid whose outermost tile centres are
    `edge` (x, y) away from it.
    """
    if view.projection == "tangent":
        return float(np.degrees(np.arctan(max(edge))))
    return float(np.degrees(np.hypot(edge[0] + view.pitch_x / 2, edge[1] + view.pitch_y / 2)))

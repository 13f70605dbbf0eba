"""Sheets of roads from above: lanes coloured by type, markings, start of the camera's car."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from isethdr_core.errors import CatalogError

from ..kinds import BaseRoad, kind, names
from ..markings import patches
from ..profile import Floats
from ..road import Road
from ..stations import stations

COLOURS = {
    "driving": (96, 96, 100),
    "shoulder": (128, 124, 116),
    "sidewalk": (190, 186, 178),
    "biking": (150, 92, 84),
    "parking": (112, 116, 132),
    "border": (158, 150, 128),
    "median": (124, 150, 96),
    "curb": (200, 200, 200),
    "rail": (120, 104, 92),
    "none": (90, 84, 76),
}
LAND = (214, 222, 196)
PAINT = {"white": (255, 255, 255), "yellow": (250, 200, 0)}
BRIDGE = (40, 70, 200)
TUNNEL = (120, 60, 20)
CAR = (220, 20, 20)


class Canvas:
    """A picture of a square of the plan, x to the right and y up, drawn `FINER` times as finely."""

    FINER = 2

    def __init__(self, centre: Floats, size_m: float, pixels: int) -> None:
        pixels *= self.FINER
        self.image = Image.new("RGB", (pixels, pixels), LAND)
        self.draw = ImageDraw.Draw(self.image)
        self.centre = centre
        self.scale = pixels / size_m
        self.pixels = pixels

    def shown(self) -> Image.Image:
        """Return the picture at its own size."""
        side = self.pixels // self.FINER
        return self.image.resize((side, side), Image.Resampling.BOX)

    def at(self, points: Floats) -> list[tuple[float, float]]:
        """Return plan points as places in the finer picture."""
        aside = (points - self.centre) * self.scale * [1, -1] + self.pixels / 2
        return [(float(x), float(y)) for x, y in aside]

    def polygon(self, points: Floats, colour: tuple[int, int, int]) -> None:
        """Fill a polygon in plan."""
        self.draw.polygon(self.at(points), fill=colour)


def top_view(base: BaseRoad, size_m: float = 180.0, pixels: int = 480) -> Image.Image:
    """Return the square of `size_m` ahead of the camera's car, seen from above.

    Parameters
    ----------
    base : road and start of the camera's car.
    size_m : side of the square, m.
    pixels : side of the picture, pixels.
    """
    pose = base.pose()
    canvas = Canvas(pose[:2, 3] + 0.3 * size_m * pose[:2, 0], size_m, pixels)
    # roads with bridges or tunnels are drawn last, over the roads that they cross
    order = sorted(base.network.roads, key=lambda r: bool(r.structures))
    for road in order:
        draw_lanes(canvas, road)
    for road in order:
        for patch in patches(road):
            points = road.line.points(patch.st_m[..., 0], patch.st_m[..., 1])
            ring = np.concatenate([points[:, 0], points[::-1, 1]])
            canvas.polygon(ring, PAINT[patch.colour])
        draw_structures(canvas, road)
    car = np.array([[0.0, -0.9], [0, 0.9], [4.4, 0.9], [5.2, 0], [4.4, -0.9]])
    canvas.polygon(pose[:2, 3] + car @ pose[:2, :2].T, CAR)
    image = canvas.shown()
    ImageDraw.Draw(image).text((6, 4), f"{base.name} {base.seed}", fill=(0, 0, 0))
    return image


def draw_lanes(canvas: Canvas, road: Road) -> None:
    """Draw the lanes of a road in the colours of their types, driving lanes last."""
    for k, section in enumerate(road.sections):
        s = stations(road, *road.span(k))
        drawn = sorted(section.lanes, key=lambda lane: lane.type == "driving")
        borders = road.borders(k, s)
        for lane in drawn:
            inner, outer = (road.line.points(s, t) for t in borders[lane.number])
            canvas.polygon(np.concatenate([inner, outer[::-1]]), COLOURS[lane.type])


def draw_structures(canvas: Canvas, road: Road) -> None:
    """Draw the edges of bridges and tunnels."""
    for structure in road.structures:
        s = stations(road, structure.start_m, structure.end_m)
        for t in road.edges(s):
            colour = BRIDGE if structure.kind == "bridge" else TUNNEL
            canvas.draw.line(canvas.at(road.line.points(s, t)), fill=colour, width=2)


def sheet(folder: Path, seeds: Sequence[int], kinds: Sequence[str] = ()) -> list[Path]:
    """Write one picture per seed with all kinds from above, and return the paths.

    Parameters
    ----------
    folder : folder for the pictures; it is made if it is missing.
    seeds : seeds of the roads, one picture each.
    kinds : names of kinds of road; empty takes all.

    Raises
    ------
    CatalogError : the folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CatalogError(
            f"{folder} is no folder that can be written ({error.strerror}); expected a folder for"
            " the sheets of all kinds, or a road file that ends in .xodr"
        ) from None
    paths = []
    for seed in seeds:
        views = [top_view(kind(name, seed)) for name in kinds or names()]
        columns = min(5, len(views))
        rows = -(-len(views) // columns)
        side = views[0].width
        whole = Image.new("RGB", (columns * side, rows * side), LAND)
        for k, view in enumerate(views):
            whole.paste(view, (k % columns * side, k // columns * side))
        paths.append(folder / f"roads_{seed}.png")
        whole.save(paths[-1])
    return paths

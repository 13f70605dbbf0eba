"""Patches of labelled pictures with random changes, and the targets of the network for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from ...detectors.classes import CLASSES
from .pictures import LabelledPicture

STRIDE = 4  # distance between the places of the network's output, pixels of the picture
ZOOM = (0.7, 1.4)  # range of the zoom of a crop
GAIN = (0.75, 1.33)  # range of the factor on the displayed values
ON_OBJECT = 0.7  # share of the crops that are placed on an object
FLIPPED = 0.5  # share of the crops that are mirrored
LEAST_LEFT = 0.4  # share of an object's box within a crop, below which it has no target
SPREAD = 6.0  # width of a box over the standard deviation of the Gaussian at its centre
LEAST_SPREAD_PX = 2.0  # least standard deviation of this Gaussian
NEAR = 0.6  # value of the Gaussian above which a place has the sides of the box as target
LEAST_SIDE_PX = 0.5  # least distance to a side, so that its logarithm is finite


@dataclass(frozen=True, eq=False)
class Targets:
    """The targets of the network for a patch, at places `STRIDE` pixels apart.

    Parameters
    ----------
    heat : (classes, y, x) 1 at the centres of objects, falling around them.
    asked : (1, y, x) 0 where `heat` does not count, within objects that are too small or hidden.
    sides : (4, y, x) logarithms of the distances from the place to left, top, right and bottom, px.
    inside : (1, y, x) 1 where `sides` counts.
    """

    heat: np.ndarray
    asked: np.ndarray
    sides: np.ndarray
    inside: np.ndarray


def patch(
    picture: LabelledPicture, size: int, random: np.random.Generator
) -> tuple[np.ndarray, Targets]:
    """Return a patch (3, size, size), float32, 0 to 1, and its targets.

    Parameters
    ----------
    picture : picture from which the patch is cut; beyond its edges the patch is black.
    size : side of the patch, pixels.
    random : generator of place, zoom, flip and gain.
    """
    zoom = np.exp(random.uniform(*np.log(ZOOM)))
    side = size / zoom  # side of the patch in pixels of the picture
    height, width = picture.rgb.shape[:2]
    centre = random.uniform(0, [width, height])
    chosen = np.flatnonzero(picture.asked)
    if len(chosen) and random.random() < ON_OBJECT:
        box = picture.boxes[random.choice(chosen)]
        centre = (box[:2] + box[2:]) / 2 + random.uniform(-0.4, 0.4, 2) * side
    low = np.clip(centre - side / 2, 0, np.maximum([width - side, height - side], 0))
    area = (*low, *(low + side))
    crop = Image.fromarray(picture.rgb).transform(
        (size, size), Image.Transform.EXTENT, area, Image.Resampling.BILINEAR
    )
    rgb = np.asarray(crop, np.float32) / 255 * np.float32(np.exp(random.uniform(*np.log(GAIN))))
    boxes = (picture.boxes - np.tile(low, 2)) * zoom
    if random.random() < FLIPPED:
        rgb = rgb[:, ::-1]
        boxes = boxes[:, [2, 1, 0, 3]] * [-1, 1, -1, 1] + [size, 0, size, 0]
    targets = targets_of(boxes, picture.classes, picture.asked, size)
    return np.ascontiguousarray(np.moveaxis(np.clip(rgb, 0, 1), -1, 0)), targets


def targets_of(boxes: np.ndarray, classes: np.ndarray, asked: np.ndarray, size: int) -> Targets:
    """Return the targets of the network for a patch.

    Parameters
    ----------
    boxes : (n, 4) corners, px; parts outside the patch are cut off.
    classes : (n,) index of each class in `CLASSES`.
    asked : (n,) whether the detector should find the object.
    size : side of the patch, pixels.
    """
    cells = size // STRIDE
    middle = (np.arange(cells) + 0.5) * STRIDE
    x, y = np.meshgrid(middle, middle)
    heat = np.zeros((len(CLASSES), cells, cells), np.float32)
    asks = np.ones((1, cells, cells), np.float32)
    sides = np.zeros((4, cells, cells), np.float32)
    inside = np.zeros((1, cells, cells), np.float32)
    cut = np.clip(boxes, 0, size)
    whole = np.prod(boxes[:, 2:] - boxes[:, :2], axis=1)
    left = np.prod(cut[:, 2:] - cut[:, :2], axis=1) / np.maximum(whole, 1e-9)
    # largest boxes first, so that small objects overwrite the places of larger ones
    for k in np.argsort(-whole):
        x0, y0, x1, y1 = cut[k]
        if not left[k] > 0:
            continue
        within = (x >= x0) & (x < x1) & (y >= y0) & (y < y1)
        if not asked[k] or left[k] < LEAST_LEFT:
            asks[0, within] = 0
            continue
        j = min(int((y0 + y1) / 2 / STRIDE), cells - 1)
        i = min(int((x0 + x1) / 2 / STRIDE), cells - 1)
        spread_x = max((x1 - x0) / SPREAD, LEAST_SPREAD_PX)
        spread_y = max((y1 - y0) / SPREAD, LEAST_SPREAD_PX)
        distance = ((x - middle[i]) / spread_x) ** 2 + ((y - middle[j]) / spread_y) ** 2
        blob = np.exp(-distance / 2)
        heat[classes[k]] = np.maximum(heat[classes[k]], blob)
        states = within & (blob > NEAR)
        states[j, i] = True
        asks[0, states] = 1
        ends = np.stack([x - x0, y - y0, x1 - x, y1 - y])
        sides[:, states] = np.log(np.maximum(ends, LEAST_SIDE_PX))[:, states]
        inside[0, states] = 1
    return Targets(heat, asks, sides, inside)


def batch(
    pictures: Sequence[LabelledPicture], count: int, size: int, random: np.random.Generator
) -> tuple[np.ndarray, ...]:
    """Return patches (count, 3, size, size) and their targets, each with the patch as first axis.

    Parameters
    ----------
    pictures : pictures from which patches are drawn.
    count : number of patches.
    size : side of the patches, pixels.
    random : generator of all random numbers.
    """
    made = [patch(pictures[random.integers(len(pictures))], size, random) for _ in range(count)]
    rows = [(rgb, t.heat, t.asked, t.sides, t.inside) for rgb, t in made]
    return tuple(np.stack(column) for column in zip(*rows, strict=True))

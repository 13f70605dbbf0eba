"""The networks by name and size."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from ...torch_library import nn
from ..camera import TrainingCamera
from .linear_start import NEAR, start_reach_px
from .nafnet import GatedBlock
from .picture_network import START, WINDOWS, PictureNetwork
from .restormer import AttentionBlock
from .u_shape import LEVELS, UShape, reach
from .unet import REACH, PlainBlock


class Shape(NamedTuple):
    """A network of one size."""

    block: Callable[[int], nn.Module]  # function of the channels that makes a block
    width: int  # channels at the full resolution
    blocks: tuple[int, int, int, int, int]  # number of blocks down, down, lowest, up, up
    block_reach: float  # reach of one block, pixels of its own resolution; inf: the whole picture


SHAPES = {
    ("unet", "small"): Shape(PlainBlock, 28, (1, 1, 1, 1, 1), REACH),
    ("unet", "large"): Shape(PlainBlock, 64, (2, 2, 4, 2, 2), REACH),
    ("nafnet", "small"): Shape(GatedBlock, 24, (1, 1, 2, 1, 1), math.inf),
    ("nafnet", "large"): Shape(GatedBlock, 48, (2, 4, 8, 2, 2), math.inf),
    ("restormer", "small"): Shape(AttentionBlock, 16, (1, 1, 2, 1, 1), math.inf),
    ("restormer", "large"): Shape(AttentionBlock, 48, (2, 3, 4, 2, 2), math.inf),
}


def network_of(
    camera: TrainingCamera, name: str, size: str, start: str = "linear"
) -> PictureNetwork:
    """Return a network for a camera, with random weights.

    Parameters
    ----------
    camera : camera of the network, with its filters and captures.
    name, size : name and size of the network, a key of `SHAPES`.
    start : "linear", which is then to be fitted, or "learned".
    """
    shape = SHAPES[name, size]

    def body(planes: int, out: int) -> UShape:
        return UShape(planes, out, shape.width, shape.blocks, shape.block)

    linear = start == "linear"
    return PictureNetwork(camera.planes, len(camera.channels), camera.period, body, linear)


def multiple_px(camera: TrainingCamera) -> int:
    """Return the number of which rows and columns of a picture must be multiples."""
    return camera.period * 2**LEVELS


def reach_px(camera: TrainingCamera, name: str, size: str, start: str = "linear") -> float:
    """Return the distance over which an output can depend on samples, pixels; infinite: the whole
    picture.

    Parameters
    ----------
    camera : camera of the network.
    name : name of the network.
    size : size of the network.
    start : `linear` or `learned`, the estimate that the network corrects.
    """
    shape = SHAPES[name, size]
    if math.isinf(shape.block_reach):
        return math.inf
    # reach of the network in cells; it also reads means over windows around each cell
    cells = reach(shape.blocks, int(shape.block_reach)) + 1 + WINDOWS[-1] // 2
    if start == "linear":
        return cells * camera.period + start_reach_px(camera.planes, camera.period)
    return max(max(cells, START // 2 + 1) * camera.period, NEAR // 2)

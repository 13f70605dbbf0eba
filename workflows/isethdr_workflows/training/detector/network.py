"""The network: an anchor-free detector that finds the centres of objects, at places four pixels
apart.

It follows CenterNet (Zhou, Wang, Kraehenbuehl 2019, "Objects as Points") and FCOS (Tian et al.
2019): one map of centres for each class, and the distances to the four sides of the box. The norms
are group norms (Wu and He 2018), which do not need large batches.
"""

from __future__ import annotations

from ...detectors.classes import CLASSES
from ..torch_library import functional, nn, torch
from .patches import STRIDE
from .settings import STRIDE_PX

WIDTHS = {"small": 16, "large": 24}
GROUPS = 8
DEPTHS = (1, 1, 2, 2)  # number of residual blocks of each level
FACTORS = (1, 2, 4, 6)  # channels of each level over the width
# range of the logarithm of a distance in pixels; without limits, the gradient of the exponential
# could be 0 times infinity
LEAST_LOG = -3.0
MOST_LOG = 7.0
RARE = -4.0  # logit of a centre before training; it is low because few places have a centre
FIRST_LOG = 2.0  # logarithm of a distance before training


class Block(nn.Module):
    """A residual block: two convolutions with group norms, and the input added to their output."""

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(channels, channels, 3, padding=1, bias=False)
        self.norm = nn.GroupNorm(GROUPS, channels)
        self.second = nn.Conv2d(channels, channels, 3, padding=1, bias=False)
        self.norm2 = nn.GroupNorm(GROUPS, channels)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the sum after a ReLU."""
        inner = functional.relu(self.norm(self.first(x)))
        return functional.relu(x + self.norm2(self.second(inner)))


def level(before: int, after: int, depth: int) -> nn.Sequential:
    """Return one level of the network, which halves rows and columns.

    Parameters
    ----------
    before, after : number of channels of its input and output.
    depth : number of blocks.
    """
    down = nn.Conv2d(before, after, 3, 2, 1, bias=False)
    blocks = [Block(after) for _ in range(depth)]
    return nn.Sequential(down, nn.GroupNorm(GROUPS, after), nn.ReLU(), *blocks)


class DetectorNetwork(nn.Module):
    """Map a picture (n, 3, y, x), 0 to 1, to logits of centres (n, classes, y / 4, x / 4) and
    logarithms of the distances to left, top, right and bottom (n, 4, y / 4, x / 4), px. Rows and
    columns of the picture are multiples of 16.
    """

    def __init__(self, size: str) -> None:
        super().__init__()
        widths = [WIDTHS[size] * factor for factor in FACTORS]
        before = [3, *widths]
        self.levels = nn.ModuleList(map(level, before, widths, DEPTHS))
        self.up3 = nn.Conv2d(widths[3], widths[2], 1)
        self.join3 = Block(widths[2])
        self.up2 = nn.Conv2d(widths[2], widths[1], 1)
        self.join2 = Block(widths[1])
        self.heat = head(widths[1], len(CLASSES), RARE)
        self.sides = head(widths[1], 4, FIRST_LOG)

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return logits of centres, and logarithms of distances."""
        one = self.levels[0](x)
        two = self.levels[1](one)
        three = self.levels[2](two)
        four = self.levels[3](three)
        three = self.join3(three + twice(self.up3(four)))
        two = self.join2(two + twice(self.up2(three)))
        return self.heat(two), self.sides(two).clamp(LEAST_LOG, MOST_LOG)


def head(channels: int, outputs: int, bias: float) -> nn.Sequential:
    """Return two convolutions with a result that starts near a given value.

    Parameters
    ----------
    channels : channels of the input.
    outputs : channels of the result.
    bias : value of the result before training.
    """
    last = nn.Conv2d(channels, outputs, 3, padding=1)
    nn.init.normal_(last.weight, std=0.01)
    nn.init.constant_(last.bias, bias)
    first = nn.Conv2d(channels, channels, 3, padding=1, bias=False)
    return nn.Sequential(first, nn.GroupNorm(GROUPS, channels), nn.ReLU(), last)


def twice(x: torch.Tensor) -> torch.Tensor:
    """Return an array with twice the rows and columns, by repetition."""
    return functional.interpolate(x, scale_factor=2.0, mode="nearest")


class Boxes(nn.Module):
    """Map a picture to boxes (1, places, 4) given by corners, px, and scores (1, places, classes),
    which are 0 except at the peaks of each class.
    """

    def __init__(self, network: DetectorNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, picture: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        """Return boxes and scores."""
        logits, logs = self.network(picture)
        heat = torch.sigmoid(logits)
        peak = functional.max_pool2d(heat, 3, 1, 1)
        scores = torch.where(heat == peak, heat, torch.zeros_like(heat))
        rows = torch.arange(heat.shape[2], device=heat.device)
        columns = torch.arange(heat.shape[3], device=heat.device)
        y = (rows.to(heat.dtype) + 0.5)[:, None] * STRIDE
        x = (columns.to(heat.dtype) + 0.5)[None, :] * STRIDE
        left, top, right, bottom = logs.exp().unbind(1)
        boxes = torch.stack([x - left, y - top, x + right, y + bottom], -1)
        return boxes.flatten(1, 2), scores.permute(0, 2, 3, 1).flatten(1, 2)


def parameters_of(network: nn.Module) -> int:
    """Return the number of trained parameters."""
    return sum(value.numel() for value in network.parameters())


assert STRIDE_PX == 2 ** len(FACTORS), "each level halves the picture"

"""Block of NAFNet (Chen, Chu, Zhang, Sun 2022): gates in place of activation functions, and channel
attention from the mean of each channel over the picture.
"""

from __future__ import annotations

from ...torch_library import nn, torch


class ChannelNorm(nn.Module):
    """Layer norm over the channels of each pixel, with a learned scale and shift."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.scale = nn.Parameter(torch.ones(width, 1, 1))
        self.shift = nn.Parameter(torch.zeros(width, 1, 1))

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return planes of the same shape."""
        centred = x - x.mean(1, keepdim=True)
        variance = (centred * centred).mean(1, keepdim=True)
        return centred * torch.rsqrt(variance + 1e-6) * self.scale + self.shift


class GatedBlock(nn.Module):
    """Depthwise convolution, gate and channel attention, then a gated layer for each pixel."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.norm_space = ChannelNorm(width)
        self.widen = nn.Conv2d(width, 2 * width, 1)
        self.depthwise = nn.Conv2d(2 * width, 2 * width, 3, padding=1, groups=2 * width)
        self.attention = nn.Conv2d(width, width, 1)
        self.narrow = nn.Conv2d(width, width, 1)
        self.norm_pixel = ChannelNorm(width)
        self.widen_pixel = nn.Conv2d(width, 2 * width, 1)
        self.narrow_pixel = nn.Conv2d(width, width, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return planes of the same shape."""
        y = gated(self.depthwise(self.widen(self.norm_space(x))))
        y = y * self.attention(y.mean((2, 3), keepdim=True))
        x = x + self.narrow(y)
        return x + self.narrow_pixel(gated(self.widen_pixel(self.norm_pixel(x))))


def gated(x: torch.Tensor) -> torch.Tensor:
    """Return the product of the two halves of the channels."""
    first, second = x.chunk(2, 1)
    return first * second

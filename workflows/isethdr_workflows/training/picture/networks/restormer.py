"""Block of Restormer (Zamir et al. 2022): attention between channels, with a cost proportional to
the number of pixels and not to its square, and a gated feed-forward layer.
"""

from __future__ import annotations

from ...torch_library import functional, nn, torch
from .nafnet import ChannelNorm

HEAD_WIDTH = 16  # channels of one attention head
EXPANSION = 2  # inner channels of the feed-forward layer over the width


class AttentionBlock(nn.Module):
    """Attention between the channels of each head, then a gated feed-forward layer."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.heads = max(width // HEAD_WIDTH, 1)
        self.norm_attention = ChannelNorm(width)
        self.project = nn.Conv2d(width, 3 * width, 1)
        self.depthwise = nn.Conv2d(3 * width, 3 * width, 3, padding=1, groups=3 * width)
        self.temperature = nn.Parameter(torch.ones(self.heads, 1, 1))
        self.join = nn.Conv2d(width, width, 1)
        inner = EXPANSION * width
        self.norm_forward = ChannelNorm(width)
        self.widen = nn.Conv2d(width, 2 * inner, 1)
        self.depthwise_forward = nn.Conv2d(2 * inner, 2 * inner, 3, padding=1, groups=2 * inner)
        self.narrow = nn.Conv2d(inner, width, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return planes of the same shape."""
        x = x + self.join(self._attended(self.norm_attention(x)))
        first, second = self.depthwise_forward(self.widen(self.norm_forward(x))).chunk(2, 1)
        return x + self.narrow(functional.gelu(first) * second)

    def _attended(self, x: torch.Tensor) -> torch.Tensor:
        query, key, value = (
            part.unflatten(1, (self.heads, -1)).flatten(3)
            for part in self.depthwise(self.project(x)).chunk(3, 1)
        )
        query = functional.normalize(query, dim=-1)
        key = functional.normalize(key, dim=-1)
        weights = (query @ key.transpose(-2, -1) * self.temperature).softmax(-1)
        return (weights @ value).flatten(1, 2).unflatten(2, x.shape[2:])

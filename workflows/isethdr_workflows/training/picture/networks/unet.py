"""Block of plain convolutions. It gives the most steps per second if the processor multiplies
matrices fast.
"""

from __future__ import annotations

from ...torch_library import functional, nn, torch

REACH = 2  # reach of a block, pixels


class PlainBlock(nn.Module):
    """Two 3 x 3 convolutions with a ReLU between them, added to the input (He et al. 2016)."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(width, width, 3, padding=1)
        self.second = nn.Conv2d(width, width, 3, padding=1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return planes of the same shape."""
        return x + self.second(functional.relu(self.first(x)))

"""U shape: the same kind of block at three resolutions, with skip connections (Ronneberger et al.
2015).
"""

from __future__ import annotations

from collections.abc import Callable

from ...torch_library import nn, torch

LEVELS = 2  # how many times the resolution is halved


class UShape(nn.Module):
    """Map planes (N, planes, y, x) to planes (N, out, y, x). Rows and columns are multiples of 4.

    Parameters
    ----------
    planes, out : number of planes of input and output.
    width : number of channels at the full resolution; it doubles at each lower one.
    blocks : number of blocks down, down, lowest, up, up.
    block : function of a number of channels that makes a block.
    """

    def __init__(
        self,
        planes: int,
        out: int,
        width: int,
        blocks: tuple[int, int, int, int, int],
        block: Callable[[int], nn.Module],
    ) -> None:
        super().__init__()

        def stack(level: int, count: int) -> nn.Sequential:
            return nn.Sequential(*(block(width << level) for _ in range(count)))

        levels = range(LEVELS)
        self.head = nn.Conv2d(planes, width, 3, padding=1)
        self.down = nn.ModuleList(stack(k, blocks[k]) for k in levels)
        self.shrink = nn.ModuleList(nn.Conv2d(width << k, width << (k + 1), 2, 2) for k in levels)
        self.lowest = stack(LEVELS, blocks[LEVELS])
        self.grow = nn.ModuleList(
            nn.Sequential(nn.Conv2d(width << (k + 1), 4 * (width << k), 1), nn.PixelShuffle(2))
            for k in reversed(levels)
        )
        self.up = nn.ModuleList(
            stack(k, count) for k, count in zip(reversed(levels), blocks[LEVELS + 1 :])
        )
        self.tail = nn.Conv2d(width, out, 3, padding=1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Return the output planes."""
        x = self.head(x)
        skips = []
        for stack, shrink in zip(self.down, self.shrink):
            x = stack(x)
            skips.append(x)
            x = shrink(x)
        x = self.lowest(x)
        for grow, stack in zip(self.grow, self.up):
            x = stack(grow(x) + skips.pop())
        return self.tail(x)


def reach(blocks: tuple[int, int, int, int, int], block_reach: int) -> int:
    """Return the distance over which an output can depend on inputs, pixels of the input planes.

    Parameters
    ----------
    blocks : number of blocks down, down, lowest, up, up, as in `UShape`.
    block_reach : reach of one block, pixels of its own resolution.
    """
    sizes = (1, 2, 4, 2, 1)
    of_blocks = sum(count * block_reach * size for count, size in zip(blocks, sizes))
    halving = sum(2**k for k in range(LEVELS))  # position of a pixel within the larger pixels
    return 2 + of_blocks + halving  # head and tail reach one pixel each

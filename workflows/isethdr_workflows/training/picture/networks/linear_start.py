"""Linear start: the estimate of XYZ that is linear in the raw samples and has the least squared
error, for each level of signal over noise. `linear_fit` solves its weights, and the training keeps
them.

This is the learned linear demosaic of the classical development (Jiang et al. 2017, L3), with one
filter for each position in the cell. It keeps the mean luminance, so that the network only has to
correct details.
"""

from __future__ import annotations

from ...torch_library import functional, nn, torch

LEVELS = tuple(1.4 * k - 1.0 for k in range(7))  # log of signal^2 over variance, evenly spaced
NEAR = 9  # side of the window of the local mean, pixels
LEAST_SIGNAL_E2 = 0.01  # added to the square of the local mean, so that its logarithm is finite
WINDOW_PX = 10  # least side of the window of the filters
XYZ = 3


class LinearStart(nn.Module):
    """Map raw, noise and valid (N, plane, y, x) to XYZ (N, 3 * cell, rows, columns of cells).

    Parameters
    ----------
    planes : number of planes of raw samples; several planes are first merged to one.
    period : number of pixels after which the filter array repeats.
    """

    weight: torch.Tensor  # (level * 3 * cell, cell, tap, tap)
    levels: torch.Tensor

    def __init__(self, planes: int, period: int) -> None:
        super().__init__()
        self.planes = planes
        self.period = period
        self.taps = taps(period)
        cell = period**2
        shape = len(LEVELS) * XYZ * cell, cell, self.taps, self.taps
        mean = torch.zeros(shape)  # until the weights are solved, they give the mean of the cell
        mean[..., self.taps // 2, self.taps // 2] = 1 / cell
        self.register_buffer("weight", mean)
        self.register_buffer("levels", torch.tensor(LEVELS))

    def forward(self, raw: torch.Tensor, noise: torch.Tensor, valid: torch.Tensor) -> torch.Tensor:
        """Return X, Y, Z of every pixel of the cells, electrons of the unit channel.

        Parameters
        ----------
        raw : (N, plane, y, x) samples, electrons of light.
        noise : (N, plane, y, x) noise besides shot noise, electrons rms.
        valid : (N, plane, y, x) 1 where the sample was measured, else 0.
        """
        if self.planes > 1:
            raw, noise = merged(raw, noise, valid)
        packed = functional.pixel_unshuffle(raw, self.period)
        around = functional.pad(packed, (self.taps // 2,) * 4, mode="replicate")
        every = functional.conv2d(around, self.weight).unflatten(1, (len(LEVELS), -1))
        return (every * self.shares(raw, noise)[:, :, None]).sum(1)

    def shares(self, raw: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
        """Return the share (N, level, rows, columns) of each level's filters in a cell."""
        return shares(raw, noise, self.levels, self.period)


def taps(period: int) -> int:
    """Return the number of taps of a filter along an axis, in cells, which is odd."""
    return max(3, WINDOW_PX // period // 2 * 2 + 1)


def start_reach_px(planes: int, period: int) -> int:
    """Return the distance over which the start can depend on samples, pixels.

    Parameters
    ----------
    planes : number of planes of raw samples.
    period : number of pixels after which the filter array repeats.
    """
    means = 3 if planes > 1 else 1  # number of nested local means; merged captures need more
    return (taps(period) // 2 + 1) * period + means * (NEAR // 2)


def shares(
    raw: torch.Tensor, noise: torch.Tensor, levels: torch.Tensor, period: int
) -> torch.Tensor:
    """Return the share (N, level, rows, columns) of each level in a cell. It is linear between two
    neighbouring levels, and the sum is 1.

    Parameters
    ----------
    raw : (N, 1, y, x) samples, electrons of light.
    noise : (N, 1, y, x) noise besides shot noise, electrons rms.
    levels : (level,) logarithms of signal^2 over variance, evenly spaced.
    period : side of a cell of the filter array, pixels.
    """
    signal = local_mean(raw)
    ratio = torch.log((signal**2 + LEAST_SIGNAL_E2) / (signal + noise**2 + 1))
    ratio = functional.avg_pool2d(ratio, period)
    step = LEVELS[1] - LEVELS[0]
    within = torch.clamp(ratio, LEVELS[0], LEVELS[-1])
    return torch.clamp(1 - (within - levels[:, None, None]).abs() / step, min=0.0)


def merged(
    raw: torch.Tensor, noise: torch.Tensor, valid: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor]:
    """Return the mean of several captures, weighted by the inverse of their variance, and its noise
    besides shot noise.

    Parameters
    ----------
    raw : (N, plane, y, x) samples, electrons of light.
    noise : (N, plane, y, x) noise besides shot noise, electrons rms.
    valid : (N, plane, y, x) 1 where the sample was measured, else 0.
    """
    signal = local_mean(raw)
    weights = (valid + 1e-6) / (signal + noise**2 + 1)
    total = weights.sum(1, keepdim=True)
    mean = (weights * raw).sum(1, keepdim=True) / total
    extra = torch.clamp(1 / total - local_mean(mean) - 1, min=0.0)
    return mean, torch.sqrt(extra)


def local_mean(raw: torch.Tensor) -> torch.Tensor:
    """Return the mean of the samples in a window around each pixel, at least 0."""
    near = functional.avg_pool2d(raw, NEAR, 1, NEAR // 2, count_include_pad=False)
    return torch.clamp(near, min=0.0)

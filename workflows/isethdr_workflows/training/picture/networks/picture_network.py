"""Picture network: raw samples of any filter array to XYZ and its variance.

Inputs and outputs are those of a model file of `isp=network` (docs/how-to/network_isp.md).
Internally, samples are square roots. Their noise is then nearly the same from one electron to the
full well (Anscombe 1948), so one network is enough for all levels. A constant is added before the
root, so that the noise stays the same in the dark, too: 3/8 and the variance of the read noise, the
floor. The input `noise` is more than the read noise where a less sensitive capture is scaled to the
most sensitive one, by s: its square is then about (s - 1) times the signal. Such a floor is many
times the signal, and a small error of the root is a large error of the light. The floor is
therefore limited to the noise of a capture in the dark (`floor_limit`). In bright light, where the
limit matters, the signal is far above it, so the root needs no larger floor.

The U-shaped network adds a correction to the root of a start. The start is the best linear
estimate, or a filter of the roots that is learned, too. Besides a free correction, the network
returns, for three sizes of window, how far each pixel moves towards the mean around it, in
luminance and in colour. For an even surface, one number is then enough, without a filter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext

from ...torch_library import functional, nn, torch
from .linear_start import NEAR, LinearStart

ANSCOMBE = 0.375  # added before the square root, electrons
# largest noise^2 in the floor over that of the training's samples in the dark; in a run, exposures
# may be longer and sensors warmer
FLOOR_MARGIN = 4.0
LEAST_ROOT = 0.05  # least value before the square root, electrons, so that its slope is finite
SCALE = 4.0  # divisor of the roots, which then have a noise of about 1 / 8 at any level
START = 5  # number of taps of the learned start along each axis, cells
WINDOWS = (3, 9, 27)  # sides of the windows of the means around a pixel, cells
LOG_LIMIT = 8.0  # limit of the correction of the variance's logarithm, so that exp is finite
XYZ = 3
LUMINANCE = slice(1, 2)  # index of Y in X, Y, Z


class PictureNetwork(nn.Module):
    """Map raw, noise, masks and valid (N, plane, y, x) to XYZ and variance (N, 3, y, x).

    Parameters
    ----------
    planes : number of planes of raw samples.
    channels : number of filters.
    period : number of pixels after which the filter array repeats; the pixels of a cell are packed
        into channels.
    make_body : function(planes in, planes out) that makes the network between packed planes.
    linear : whether the start is the best linear estimate, which `linear_fit` solves; otherwise it
        is a filter of the roots, which is learned with the network.
    """

    # whether the body computes in bfloat16, in training only; the start never does, because 8 bits
    # are too few for a signal
    half_precision = False

    def __init__(
        self,
        planes: int,
        channels: int,
        period: int,
        make_body: Callable[[int, int], nn.Module],
        linear: bool = True,
    ) -> None:
        super().__init__()
        self.period = period
        cell = period**2
        samples = planes * cell
        self.start = LinearStart(planes, period) if linear else learned_start(samples, cell)
        start_planes = XYZ * cell if linear else 0
        seen = 3 * samples + channels * cell + start_planes + XYZ * len(WINDOWS)
        self.outputs = [XYZ * cell, XYZ * cell, *[cell] * (2 * len(WINDOWS))]
        self.body = make_body(seen, sum(self.outputs))
        nn.init.zeros_(self.body.tail.weight)
        nn.init.zeros_(self.body.tail.bias)
        # correction of the variance's logarithm, linear between levels; it is set after training
        self.register_buffer("calibration_levels", torch.tensor([0.0, 1.0]))
        self.register_buffer("calibration_logs", torch.tensor([0.0, 0.0]))
        # largest noise^2 in the floor of each plane, electrons squared; `limit_floor` sets it
        self.register_buffer("floor_limit", torch.full((planes, 1, 1), torch.inf))

    @torch.no_grad()
    def limit_floor(self, dark_noise_e2: Sequence[float]) -> None:
        """Limit the floor of the square roots to the noise of samples in the dark.

        Parameters
        ----------
        dark_noise_e2 : (plane,) variance of a sample besides shot noise in the dark, electrons
            squared.
        """
        limits = FLOOR_MARGIN * torch.tensor(dark_noise_e2, dtype=torch.float32)
        self.floor_limit.copy_(limits[:, None, None])

    def forward(
        self, raw: torch.Tensor, noise: torch.Tensor, masks: torch.Tensor, valid: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return XYZ in electrons of the unit channel, and its variance.

        Parameters
        ----------
        raw : (N, plane, y, x) samples, electrons of light.
        noise : (N, plane, y, x) noise besides shot noise, electrons rms.
        masks : (1, channel, y, x) 1 where a pixel has the filter, else 0.
        valid : (N, plane, y, x) 1 where the sample was measured, else 0.
        """
        floor = ANSCOMBE + torch.minimum(noise * noise, self.floor_limit)
        roots = functional.pixel_unshuffle(raw + floor, self.period)
        roots = torch.sqrt(torch.clamp(roots, min=LEAST_ROOT)) / SCALE
        seen = [
            roots,
            torch.log(functional.pixel_unshuffle(ANSCOMBE + noise * noise, self.period)) / SCALE,
            functional.pixel_unshuffle(valid, self.period),
            functional.pixel_unshuffle(masks, self.period).expand(len(raw), -1, -1, -1),
        ]
        if isinstance(self.start, LinearStart):
            own_floor = floor.amin(1, keepdim=True)  # the best capture has most of the weight
            packed_floor = functional.pixel_unshuffle(own_floor, self.period)
            linear = self.start(raw, noise, valid) + packed_floor.repeat(1, XYZ, 1, 1)
            root = torch.sqrt(torch.clamp(linear, min=LEAST_ROOT)) / SCALE
            seen.append(root)
        else:
            own_floor = floor.mean(1, keepdim=True)  # at first, all captures have the same weight
            root = self.start(roots)
        means = local_means(root.unflatten(1, (XYZ, -1)).mean(2))
        half = torch.autocast(raw.device.type, torch.bfloat16)
        with half if self.half_precision else nullcontext():
            answer = self.body(torch.cat([*seen, *means], 1))
        change, log_ratio, *shares = answer.float().split(self.outputs, 1)
        root = root + change + moved(root.unflatten(1, (XYZ, -1)), means, shares).flatten(1, 2)
        xyz = functional.pixel_shuffle(SCALE**2 * root * root.abs(), self.period)
        return xyz - own_floor, self._variance(
            functional.pixel_shuffle(log_ratio, self.period), raw, noise
        )

    def _variance(
        self, log_ratio: torch.Tensor, raw: torch.Tensor, noise: torch.Tensor
    ) -> torch.Tensor:
        """Return the variance: the local variance of a sample, times the factor from the network,
        times the calibration.
        """
        level = torch.log(sample_variance(raw, noise))
        logs = torch.clamp(log_ratio, -LOG_LIMIT, LOG_LIMIT) + level
        return torch.exp(logs + interpolated(level, self.calibration_levels, self.calibration_logs))


def local_means(planes: torch.Tensor) -> list[torch.Tensor]:
    """Return the local means of planes (N, plane, y, x) over each of `WINDOWS`."""
    found = []
    for size in WINDOWS:
        rows = functional.avg_pool2d(planes, (size, 1), 1, (size // 2, 0), count_include_pad=False)
        found.append(
            functional.avg_pool2d(rows, (1, size), 1, (0, size // 2), count_include_pad=False)
        )
    return found


def moved(
    root: torch.Tensor, means: Sequence[torch.Tensor], shares: Sequence[torch.Tensor]
) -> torch.Tensor:
    """Return the change (N, 3, place, y, x) that moves pixels towards the means around them.

    Parameters
    ----------
    root : (N, 3, place, y, x) roots of X, Y, Z at each place of a cell.
    means : (N, 3, y, x) means over each window.
    shares : (N, place, y, x) shares of the way, for luminance and for colour of each window.
    """
    total = torch.zeros_like(root)
    for mean, of_luminance, of_colour in zip(means, shares[::2], shares[1::2], strict=True):
        way = mean[:, :, None] - root
        luminance = way[:, LUMINANCE]
        total = total + of_luminance[:, None] * luminance + of_colour[:, None] * (way - luminance)
    return total


def learned_start(samples: int, cell: int) -> nn.Conv2d:
    """Return a filter of the packed roots. Before training, it gives the mean of the samples of the
    cell for each of X, Y, Z.

    Parameters
    ----------
    samples : number of packed planes of samples.
    cell : number of pixels of a cell.
    """
    start = nn.Conv2d(samples, XYZ * cell, START, padding=START // 2)
    nn.init.normal_(start.weight, std=1e-3)
    nn.init.zeros_(start.bias)
    with torch.no_grad():
        start.weight[:, :, START // 2, START // 2] += 1 / samples
    return start


def sample_variance(raw: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
    """Return the variance (N, 1, y, x) of a sample at the local mean of the raw, electrons squared.
    It is at least 1.

    Parameters
    ----------
    raw : (N, plane, y, x) samples, electrons of light.
    noise : (N, plane, y, x) noise besides shot noise, electrons rms.
    """
    near = functional.avg_pool2d(raw, NEAR, 1, NEAR // 2, count_include_pad=False)
    return torch.clamp(near, min=0).mean(1, keepdim=True) + (noise**2).mean(1, keepdim=True) + 1


def interpolated(x: torch.Tensor, places: torch.Tensor, values: torch.Tensor) -> torch.Tensor:
    """Return the values of a function that is linear between its nodes and constant beyond them.

    Parameters
    ----------
    x : positions, any shape.
    places : (node,) positions of the nodes, increasing.
    values : (node,) values at the nodes.
    """
    steps = torch.clamp((x[..., None] - places[:-1]) / (places[1:] - places[:-1]), min=0.0, max=1.0)
    return values[0] + (steps * (values[1:] - values[:-1])).sum(-1)


def parameters(network: nn.Module) -> int:
    """Return the number of trained parameters."""
    return sum(p.numel() for p in network.parameters())

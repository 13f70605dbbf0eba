"""Loss: squared error in units of the samples' noise, so that electrons stay absolute.

The weight follows the raw alone, never the truth: then the mean of all pictures that fit a raw is
the best answer, and the mean luminance stays. The logarithm is taken block by block: edges, and the
lamps beside them, are wrong by many deviations of their noise, and would otherwise take all of the
training, while what is left of the noise on an even road would count for nothing.
"""

from __future__ import annotations

from typing import NamedTuple

from ..torch_library import functional, torch
from .networks.picture_network import NEAR

RELATIVE = 1e-3  # of the local mean's square: where there is little noise, signal counts
BLOCK = 8  # pixels, side of a block
LEAST_ERROR = 1e-2  # of a block under the logarithm: a tenth of a standard deviation is enough
MEAN_WEIGHT = 3.0  # of the error of a picture's mean
VARIANCE_WEIGHT = 0.1  # of the stated variance's likelihood
FREEDOM = 3.0  # degrees of freedom of Student's t
VIEW_EXPONENT = 1 / 2.4  # of a display
VIEW_TOE = 2e-3


class Batch(NamedTuple):
    """Patches for one step, (N, plane, y, x)."""

    raw: torch.Tensor
    noise: torch.Tensor
    valid: torch.Tensor
    truth: torch.Tensor  # X, Y, Z in electrons of the unit channel


def loss_of(kind: str, xyz: torch.Tensor, variance: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return the loss of a step.

    Parameters
    ----------
    kind : "electrons", or "view", the absolute error as a display shows it, which moves the mean
        luminance in the dark.
    xyz, variance : answers of the network: (N, 3, y, x) picture in electrons of the unit channel,
        and its variance.
    batch : samples and truth of the step.
    """
    measured = batch.valid.amax(1, keepdim=True)
    error = (xyz - batch.truth) * measured
    picture = view_loss(xyz, batch, measured) if kind == "view" else noise_loss(error, batch)
    if kind != "view":
        picture = picture + MEAN_WEIGHT * mean_loss(error, batch)
    squared = error.detach() ** 2  # the variance does not move the picture's answer
    stated = variance_loss(squared, variance) * measured
    return picture + VARIANCE_WEIGHT * stated.mean()


def variance_loss(squared: torch.Tensor, variance: torch.Tensor) -> torch.Tensor:
    """Return the negative logarithm of the likelihood of a squared error, up to a constant, for
    Student's t: a few very wrong pixels pull a normal likelihood away from all others.
    """
    power = (FREEDOM + 1) / 2
    return torch.log(variance) / 2 + power * torch.log1p(squared / (FREEDOM * variance))


def noise_loss(error: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return the mean over blocks of the logarithm of the weighted squared error."""
    weighted = (weight(batch) * error**2).mean(1, keepdim=True)
    return torch.log(functional.avg_pool2d(weighted, BLOCK) + LEAST_ERROR).mean()


def log_weight(weighted: torch.Tensor, pixels: int) -> torch.Tensor:
    """Return the weight with which least squares count an error as `noise_loss` does.

    Parameters
    ----------
    weighted : (N, plane, y, x) squared errors over the variance.
    pixels : side of what one value stands for.
    """
    side = BLOCK // pixels // 2 * 2 + 1
    near = functional.avg_pool2d(weighted, side, 1, side // 2, count_include_pad=False)
    return 1 / (near.mean(1, keepdim=True) + LEAST_ERROR)


def mean_loss(error: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return log(1 + e^2) of the relative error e of the mean of each picture, X, Y and Z: the
    square where it is small, and no more than a lamp beside a road is worth where it is large.
    """
    level = batch.raw.mean((1, 2, 3)).clamp(min=0) + batch.noise.mean((1, 2, 3)) + 1
    return torch.log1p((error.mean((2, 3)) / level[:, None]) ** 2).mean()


def weight(batch: Batch) -> torch.Tensor:
    """Return 1 / (variance of a sample + a share of the signal's square), from the raw."""
    raw = batch.raw.mean(1, keepdim=True)
    near = functional.avg_pool2d(raw, NEAR, 1, NEAR // 2, count_include_pad=False).clamp(min=0)
    noise = (batch.noise**2).mean(1, keepdim=True)
    return 1 / (near + noise + 1 + RELATIVE * near**2)


def view_loss(xyz: torch.Tensor, batch: Batch, measured: torch.Tensor) -> torch.Tensor:
    """Return the mean absolute error of what a display shows, with the truth's white.

    Parameters
    ----------
    xyz : (N, 3, y, x) picture of the network, electrons of the unit channel.
    batch : samples and truth of the step.
    measured : (N, 1, y, x) 1 where a sample was measured, else 0.
    """
    white = torch.quantile(batch.truth[:, 1].flatten(1), 0.99, dim=1)[:, None, None, None] + 1
    return ((shown(xyz / white) - shown(batch.truth / white)) * measured).abs().mean()


def shown(xyz: torch.Tensor) -> torch.Tensor:
    """Return a display's value of each of X, Y, Z, without clipping: a slope everywhere."""
    toe = VIEW_TOE**VIEW_EXPONENT
    return torch.sign(xyz) * ((xyz.abs() + VIEW_TOE) ** VIEW_EXPONENT - toe)

"""Loss: squared error in units of the samples' noise, so that electrons stay absolute.

The weight depends on the raw samples alone, never on the reference. The loss is then least for the
mean of all pictures that are possible for these samples, and the mean luminance is kept. The
logarithm is taken block by block. Edges and lamps have errors of many standard deviations of their
noise. Without the logarithm they would dominate the training, and the remaining noise on an even
road would not count.
"""

from __future__ import annotations

from typing import NamedTuple

from ..torch_library import functional, torch
from .networks.picture_network import NEAR

# share of the square of the local mean that is added to the variance, so that errors are relative
# to the signal where there is little noise
RELATIVE = 1e-3
BLOCK = 8  # side of a block, pixels
LEAST_ERROR = 1e-2  # added to a block's error: a tenth of a standard deviation is small enough
MEAN_WEIGHT = 3.0  # weight of the error of a picture's mean
VARIANCE_WEIGHT = 0.1  # weight of the likelihood of the stated variance
FREEDOM = 3.0  # degrees of freedom of Student's t
VIEW_EXPONENT = 1 / 2.4  # exponent of a display's curve
VIEW_TOE = 2e-3  # added before the exponent, so that the slope at 0 is finite


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
    kind : "electrons"; or "view", the absolute error of displayed values, which shifts the mean
        luminance in the dark.
    xyz, variance : outputs of the network: (N, 3, y, x) picture in electrons of the unit channel,
        and its variance.
    batch : samples and truth of the step.
    """
    measured = batch.valid.amax(1, keepdim=True)
    error = (xyz - batch.truth) * measured
    picture = view_loss(xyz, batch, measured) if kind == "view" else noise_loss(error, batch)
    if kind != "view":
        picture = picture + MEAN_WEIGHT * mean_loss(error, batch)
    squared = error.detach() ** 2  # the variance loss must not change the picture
    stated = variance_loss(squared, variance) * measured
    return picture + VARIANCE_WEIGHT * stated.mean()


def variance_loss(squared: torch.Tensor, variance: torch.Tensor) -> torch.Tensor:
    """Return the negative logarithm of the likelihood of a squared error for Student's t, up to a
    constant. With a normal likelihood, a few very wrong pixels would dominate.

    Parameters
    ----------
    squared : squared errors.
    variance : stated variance, same shape and unit.
    """
    power = (FREEDOM + 1) / 2
    return torch.log(variance) / 2 + power * torch.log1p(squared / (FREEDOM * variance))


def noise_loss(error: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return the mean over blocks of the logarithm of the weighted squared error.

    Parameters
    ----------
    error : (N, 3, y, x) error of the picture, electrons.
    batch : samples of the step.
    """
    weighted = (weight(batch) * error**2).mean(1, keepdim=True)
    return torch.log(functional.avg_pool2d(weighted, BLOCK) + LEAST_ERROR).mean()


def log_weight(weighted: torch.Tensor, pixels: int) -> torch.Tensor:
    """Return the weight with which least squares approximate `noise_loss`.

    Parameters
    ----------
    weighted : (N, plane, y, x) weighted squared errors.
    pixels : side of the area that one value stands for, pixels.
    """
    side = BLOCK // pixels // 2 * 2 + 1
    near = functional.avg_pool2d(weighted, side, 1, side // 2, count_include_pad=False)
    return 1 / (near.mean(1, keepdim=True) + LEAST_ERROR)


def mean_loss(error: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return the mean of log(1 + e^2), with e the relative error of the mean of each picture, in X,
    Y and Z. For a small e this is the square. For a large e, as of a lamp next to a road, the
    logarithm limits it.

    Parameters
    ----------
    error : (N, 3, y, x) error of the picture, electrons.
    batch : samples of the step.
    """
    level = batch.raw.mean((1, 2, 3)).clamp(min=0) + batch.noise.mean((1, 2, 3)) + 1
    return torch.log1p((error.mean((2, 3)) / level[:, None]) ** 2).mean()


def weight(batch: Batch) -> torch.Tensor:
    """Return 1 / (variance of a sample + a share of the signal's square), from the raw alone."""
    raw = batch.raw.mean(1, keepdim=True)
    near = functional.avg_pool2d(raw, NEAR, 1, NEAR // 2, count_include_pad=False).clamp(min=0)
    noise = (batch.noise**2).mean(1, keepdim=True)
    return 1 / (near + noise + 1 + RELATIVE * near**2)


def view_loss(xyz: torch.Tensor, batch: Batch, measured: torch.Tensor) -> torch.Tensor:
    """Return the mean absolute error of displayed values, with the white of the truth.

    Parameters
    ----------
    xyz : (N, 3, y, x) picture of the network, electrons of the unit channel.
    batch : samples and truth of the step.
    measured : (N, 1, y, x) 1 where a sample was measured, else 0.
    """
    white = torch.quantile(batch.truth[:, 1].flatten(1), 0.99, dim=1)[:, None, None, None] + 1
    return ((shown(xyz / white) - shown(batch.truth / white)) * measured).abs().mean()


def shown(xyz: torch.Tensor) -> torch.Tensor:
    """Return the displayed values of X, Y and Z, without clipping, so that the slope is never 0."""
    toe = VIEW_TOE**VIEW_EXPONENT
    return torch.sign(xyz) * ((xyz.abs() + VIEW_TOE) ** VIEW_EXPONENT - toe)

"""Expected picture: mean and variance of each pixel over noise realisations of a camera."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from isethdr_core.data.derived_once import once

from ..luminance.noise_line import noise_line
from ..regions import luminance_variance, luminances
from .photon_counts import Signal

if TYPE_CHECKING:
    import xarray as xr

    from .pixel_pairs import Pairs

# side of the window over which the difference between picture and reference picture is averaged,
# pixels
SMOOTH = 7
SMEARED_E = 0.3  # smallest read noise that is assumed for a picture, in steps


class Expected(NamedTuple):
    """Mean and variance of the luminance of each pixel (y, x), cd/m2."""

    true: np.ndarray  # luminance of the reference picture
    mean: np.ndarray
    variance: np.ndarray  # (cd/m2)^2
    step: np.ndarray  # luminance of one electron
    valid: np.ndarray  # bool

    def signals(self, pairs: Pairs) -> tuple[Signal, Signal]:
        """Return the signals of the brighter and of the darker pixel of each pair."""
        of_pixels = (self.mean.ravel(), self.variance.ravel(), self.step.ravel())
        bright, dark = (
            Signal(*(values[at] for values in of_pixels)) for at in (pairs.bright, pairs.dark)
        )
        return bright, dark

    def both_valid(self, pairs: Pairs) -> np.ndarray:
        """Return for which pairs (bool) both pixels are valid."""
        valid = self.valid.ravel()
        return valid[pairs.first] & valid[pairs.second]


def expected(picture: xr.Dataset, truth: xr.Dataset) -> Expected:
    """Return the estimated mean and variance of each pixel over noise realisations.

    Parameters
    ----------
    picture, truth : picture before denoising, and reference picture, on one grid (y, x).

    Notes
    -----
    Flare adds light, and losses multiply it; both vary slowly over the picture. If the local mean
    of the picture is above that of the reference picture, the mean is the true luminance plus the
    difference. If it is below, the mean is the true luminance times the ratio. The variance is the
    shot noise of the mean plus the local mean of the other noise.
    """
    return once("contrast model", (picture, truth), lambda: _expected(picture, truth))


def _expected(picture: xr.Dataset, truth: xr.Dataset) -> Expected:
    from scipy.ndimage import uniform_filter

    y, true, valid = luminances(picture, truth)
    share = uniform_filter(valid.astype(float), SMOOTH, mode="nearest")

    def local(values: np.ndarray) -> np.ndarray:
        total = uniform_filter(np.where(valid, values, 0.0), SMOOTH, mode="nearest")
        return np.where(share > 1e-9, total / np.maximum(share, 1e-9), values)

    local_y = local(y)
    local_true = once(("local", valid.tobytes()), (truth,), lambda: local(true))
    loss = np.divide(local_y, local_true, out=np.ones_like(y), where=local_true > 0)
    mean = true * np.clip(loss, 0.0, 1.0) + np.maximum(local_y - local_true, 0.0)
    variance = luminance_variance(picture)
    # The line is fitted to local means of variance over local means of true luminance. The true
    # luminance has no noise, which would make the slope too small. The mean of the variances has no
    # bias at few electrons, unlike their median.
    shot_noise = local(picture["variance"].values[..., 1])
    _, step = noise_line(local_true[valid], shot_noise[valid])
    local_variance = local(variance)
    other = local_variance - step * local_y
    # a value of a picture is a weighted sum of several counts, so it has no gaps between the levels
    # of a single count
    read = max(float(np.median(other[valid])) if valid.any() else 0.0, (SMEARED_E * step) ** 2)
    variance = np.maximum(np.where(other >= 0, step * mean + other, local_variance), 0.0)
    shot = np.divide(variance - read, mean, out=np.zeros_like(y), where=mean > 0)
    return Expected(true, mean, variance, np.clip(shot, 0.0, step), valid)

"""Expected picture: what a camera makes of each pixel, apart from one noise realisation."""

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

# pixels: a window over which the picture's difference from the truth is taken as its mean
SMOOTH = 7
SMEARED_E = 0.3  # read noise that every picture is taken to have at least, in steps


class Expected(NamedTuple):
    """Mean and variance of the luminance of each pixel (y, x), cd/m2."""

    true: np.ndarray
    mean: np.ndarray
    variance: np.ndarray
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
        """Return the pairs (bool) of which both pixels are valid."""
        valid = self.valid.ravel()
        return valid[pairs.first] & valid[pairs.second]


def expected(picture: xr.Dataset, truth: xr.Dataset) -> Expected:
    """Return what the camera makes of each pixel, apart from this one noise realisation.

    Parameters
    ----------
    picture, truth : picture before denoising, and reference picture, on one grid (y, x).

    Notes
    -----
    Flare adds light and a loss multiplies it, both smoothly. The mean is therefore the true
    luminance plus the local surplus of the picture, or the true luminance times the local ratio
    where the picture is darker. The variance is the shot noise of that mean plus the local mean of
    the other noise.
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
    # Local means on both sides. The true luminance is free of noise, which would flatten the
    # line. The mean of the variances has no bias where electrons are few; their median has.
    shot_noise = local(picture["variance"].values[..., 1])
    _, step = noise_line(local_true[valid], shot_noise[valid])
    local_variance = local(variance)
    other = local_variance - step * local_y
    # a picture is a sum of several counts, which never leaves the gaps of a single one
    read = max(float(np.median(other[valid])) if valid.any() else 0.0, (SMEARED_E * step) ** 2)
    variance = np.maximum(np.where(other >= 0, step * mean + other, local_variance), 0.0)
    shot = np.divide(variance - read, mean, out=np.zeros_like(y), where=mean > 0)
    return Expected(true, mean, variance, np.clip(shot, 0.0, step), valid)

"""HDR white, for comparison with ISETCam: nearly saturated pixels are blended to white, so that
clipped colours do not show.
"""

from __future__ import annotations

import numpy as np

from isethdr_core.errors import ConfigError


def hdr_white(
    displayed: np.ndarray, filled: np.ndarray, start: float = 0.95, blur_px: float = 1.0
) -> np.ndarray:
    """Return displayed linear RGB blended to white where the mosaic is nearly full.

    Parameters
    ----------
    displayed : (y, x, 3) linear display RGB, 0 to 1.
    filled : (y, x) values of the mosaic of all filters, as shares of their full scale.
    start : share of the full scale at which the blend begins, below 1; it is complete at 1.
    blur_px : standard deviation of the 5 x 5 Gaussian that smooths the weight, pixels.

    Returns
    -------
    (y, x, 3) blended RGB as in ISETCam's ipHDRWhite: (1 - w) displayed + w, where w is
    clip((filled - start) / (1 - start), 0, 1), smoothed. At the border, only existing pixels are
    used for smoothing.

    Raises
    ------
    ConfigError : `start` is not a share below 1, `blur_px` is not above 0, or the shapes do not
        match.

    Notes
    -----
    The result is for display only. The picture itself remains scene-referred, with its variance and
    its mask of valid pixels.
    """
    from scipy.ndimage import correlate1d

    displayed = np.asarray(displayed, float)
    filled = np.asarray(filled, float)
    if not 0 <= start < 1:
        raise ConfigError(
            f"start is {start!r}; expected a share of the full scale, 0 or more and below 1; type"
            " start=0.95"
        )
    if not blur_px > 0:
        raise ConfigError(
            f"blur_px is {blur_px!r}; expected a standard deviation above 0 pixels; type blur_px=1"
        )
    if displayed.shape != (*filled.shape, 3):
        raise ConfigError(
            f"displayed has shape {displayed.shape}, filled {filled.shape}; expected (y, x, 3) and"
            " (y, x) of one mosaic"
        )
    kernel = np.exp(-0.5 * (np.arange(-2, 3) / blur_px) ** 2)

    def smooth(values: np.ndarray) -> np.ndarray:
        return correlate1d(
            correlate1d(values, kernel, axis=0, mode="constant"), kernel, axis=1, mode="constant"
        )

    weight = smooth(np.clip((filled - start) / (1 - start), 0, 1)) / smooth(np.ones(filled.shape))
    return (1 - weight[..., None]) * displayed + weight[..., None]

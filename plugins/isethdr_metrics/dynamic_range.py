"""Dynamic range: from the luminance that just shows (SNR = 1) to the brightest one measured."""

from __future__ import annotations

from dataclasses import dataclass

GROUPS = 20  # of dark pixels; two unknowns need a few, and each group enough pixels for a median


@dataclass(frozen=True)
class DynamicRange:
    """Largest valid luminance over the luminance where SNR = 1, in dB, from the picture's reported variance."""

    darkest_share: float = 0.2  # share of the pixels, from the dark end, whose variance gives the noise in the dark

    def __call__(self, picture, truth, labels=None):
        """Return the range in dB and its two ends in cd/m2.

        The variance of the darkest pixels is fitted by a + b Y (read noise and shot noise, a and b not negative), through the
        medians of groups of equal luminance, so that the few dark pixels that flare has reached do not stand for all of
        them; SNR = 1 is where Y^2 = a + b Y. A scene without a pixel that is not valid does not reach the sensor's top:
        the range is then a lower bound, and has no upper confidence limit.
        """
        import numpy as np
        from scipy.optimize import nnls

        from isethdr_core import ledger
        from isethdr_core.errors import ConfigError
        from isethdr_core.scores import Score

        from .regions import NAN, luminances

        if not 0 < self.darkest_share <= 1:
            raise ConfigError(f"metric darkest_share is {self.darkest_share!r}; expected a share above 0, at most 1")
        y, true, valid = luminances(picture, truth)
        if not valid.any():
            return [Score("dynamic_range", NAN, "dB")]
        variance = picture["variance"].values[..., 1][valid]
        true, top = true[valid], float(y[valid].max())
        dark = true <= np.quantile(true, self.darkest_share)
        groups = np.array_split(np.argsort(true[dark], kind="stable"), min(GROUPS, int(dark.sum())))
        light, noise = (np.array([np.median(values[dark][g]) for g in groups]) for values in (true, variance))
        scale, level = noise.max() or 1.0, light.mean() or 1.0
        (a, b), _ = nnls(np.stack([np.ones(len(groups)), light / level], 1), noise / scale)
        a, b = a * scale, b * scale / level
        bottom = (b + np.sqrt(b * b + 4 * a)) / 2
        spread = np.ptp(true[dark]) / level
        if spread < 0.1:
            ledger.left_out("shot noise in the dark", "the darkest pixels are all alike, so a + b Y is one number", NAN, "dB")
        value = float(20 * np.log10(top / bottom)) if bottom > 0 and top > 0 else NAN
        reached = not valid.all()
        return [Score("dynamic_range", value, "dB", "", value, value if reached else NAN),
                Score("dynamic_range_top", top, "cd m-2"), Score("dynamic_range_bottom", float(bottom), "cd m-2")]

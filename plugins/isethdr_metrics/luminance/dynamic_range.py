"""Dynamic range: from the lowest detectable luminance to the brightest one measured, by several
definitions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.special import ndtri

from isethdr_core import ledger
from isethdr_core.data.derived_once import intervals_wanted
from isethdr_core.data.saturation import saturated
from isethdr_core.data.scores import Score
from isethdr_core.plugins.ranges import check_ranges

from ..limits import Darkest
from ..regions import NAN, luminance_variance, luminances, undenoised, variance_stated
from .noise_line import dark_medians, line_through

if TYPE_CHECKING:
    import xarray as xr

# probability that noise alone counts as a signal in a picture without signal
FALSE_ALARM = 1e-3


@dataclass(frozen=True)
class DynamicRange:
    """Dynamic range in dB: largest valid luminance over that at SNR = 1 (EMVA 1288), at dark noise,
    and at SNR = 10 dB.
    """

    THREAD_SAFE: ClassVar[bool] = True

    # share of the pixels, from the darkest on, with a variance that counts as the noise in the dark
    darkest_share: Darkest = 0.2

    def __post_init__(self) -> None:
        check_ranges(self)

    def __call__(
        self, picture: xr.Dataset, truth: xr.Dataset, labels: xr.Dataset | None = None
    ) -> list[Any]:
        """Return the range in dB by three definitions, and its ends in cd/m2.

        | score                      | lower end                                           |
        |----------------------------|-----------------------------------------------------|
        | `dynamic_range`            | SNR = 1: absolute sensitivity threshold, EMVA 1288  |
        | `dynamic_range_dark_noise` | rms noise without light: ignores shot noise         |
        | `dynamic_range_snr_10db`   | SNR = 10 dB, rms: objects can be recognised         |

        The variance is fitted by a + b Y (read noise and shot noise, a and b not negative), up to
        12 times the noise in the dark. The fit is a relative least-squares fit to the medians of
        groups of pixels with similar luminance, so that a few dark pixels with flare do not change
        it. SNR = s is where Y^2 = s^2 (a + b Y). If no pixel is saturated, the scene does not reach
        the top of the sensor. The range is then a lower bound and has no upper confidence limit.
        The interval of a range follows from a jackknife over the groups of dark pixels, and from
        the noise of the brightest pixel.
        """
        picture = undenoised(picture)
        y, true, valid = luminances(picture, truth)
        if not variance_stated(picture, "dynamic_range", "dB"):
            return []
        if not valid.any():
            ledger.left_out("dynamic_range", "no pixel is valid", NAN, "dB")
            return []
        brightest = np.unravel_index(np.argmax(np.where(valid, y, -np.inf)), y.shape)
        variance = luminance_variance(picture)
        # a pixel with a nonlinear response may be valid beyond the end of its linear part
        reached = bool((saturated(picture) & ~valid).any())
        top = float(y[brightest])
        top_noise = float(np.sqrt(variance[brightest]))
        if not top > highest_of_noise(top_noise, int(valid.sum())):
            why = (
                f"no pixel stands out of the noise: the brightest of {valid.sum()} has "
                f"{top:.3g} cd/m2, its noise is {top_noise:.3g} cd/m2"
            )
            ledger.left_out("dynamic_range", why, NAN, "dB")
            return []
        light, noise = dark_medians(true[valid], variance[valid], self.darkest_share)
        if np.ptp(light) < 0.1 * (light.mean() or 1.0):
            ledger.left_out(
                "shot noise in the dark",
                "the darkest pixels have nearly one luminance, so the fit a + b Y is a constant",
                NAN,
                "dB",
            )
        ends = lower_ends(light, noise)
        without = [
            lower_ends(np.delete(light, k), np.delete(noise, k))
            for k in range(len(light))
            if len(light) > 2 and intervals_wanted()
        ]
        scores = []
        for name, bottom in ends.items():
            if not bottom > 0:
                ledger.left_out(f"dynamic_range{name}", "no noise in the dark", NAN, "dB")
                continue
            value = float(20 * np.log10(top / bottom))
            bottom_sd = jackknife_sd([w[name] for w in without])
            half = 1.96 * 20 / np.log(10) * np.hypot(top_noise / top, bottom_sd)
            scores += [
                Score(
                    f"dynamic_range{name}",
                    value,
                    "dB",
                    "",
                    value - half,
                    value + half if reached else NAN,
                ),
                Score(f"dynamic_range{name}_bottom", float(bottom), "cd m-2"),
            ]
        scores.append(Score("dynamic_range_top", top, "cd m-2"))
        return sorted(scores, key=lambda s: s.metric != "dynamic_range")  # the main score first


def highest_of_noise(noise: float, pixels: int) -> float:
    """Return the level that the brightest of many pixels without signal exceeds with the
    probability `FALSE_ALARM`.

    Parameters
    ----------
    noise : standard deviation of a pixel, any unit.
    pixels : number of pixels.
    """
    return float(-ndtri(FALSE_ALARM / pixels) * noise)


def lower_ends(light: np.ndarray, noise: np.ndarray) -> dict[str, float]:
    """Return the lower end of the range by each definition, cd/m2, from the line through the
    variances.

    Parameters
    ----------
    light : (group,) luminance, cd/m2.
    noise : (group,) variance of luminance, (cd/m2)^2.
    """
    a, b = line_through(light, noise)
    return {
        "": (b + np.sqrt(b * b + 4 * a)) / 2,
        "_dark_noise": np.sqrt(a),
        "_snr_10db": (10 * b + np.sqrt(100 * b * b + 40 * a)) / 2,
    }


def jackknife_sd(ends: Sequence[Any]) -> float:
    """Return the standard deviation of the logarithm of a lower end by the jackknife (Efron 1982,
    eq. 3.1). `ends` are its values with one group left out each.
    """
    if len(ends) < 2 or min(ends) <= 0:
        return float("nan")
    logs = np.log(ends)
    return float(np.sqrt((len(logs) - 1) / len(logs) * np.sum((logs - logs.mean()) ** 2)))

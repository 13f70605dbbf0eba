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
from ..regions import (
    NAN,
    luminance_variance,
    luminances,
    noise_of_blocks,
    undenoised,
    variance_stated,
)
from .noise_line import NoiseLine, dark_medians, line_through

if TYPE_CHECKING:
    import xarray as xr

# probability that noise alone counts as a signal in a picture without signal
FALSE_ALARM = 1e-3
# largest ratio of the darkest luminance that was measured and a lower end. In simulated pictures of
# cameras with 0 to 10 e read noise, the rms error of the ends at SNR = 1 and 10 dB is up to 0.5 dB
# at ratios of 1 to 3, 3 dB at 10 and 9 dB at 30.
FARTHEST = 3.0
# smallest share of the noise without light in the variance of the darkest pixels. With 1 e read
# noise and a share of about this size, its rms error is 0.4 dB in these pictures. With much smaller
# shares the fit often gives 0.
VISIBLE = 0.2


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
        it. Luminance and variance are means over cells of the colour filter array, so that all
        filters count equally; pixels with another luminance than their cell do not count. If all
        dark pixels have nearly one luminance, b is 0. SNR = s is where Y^2 = s^2 (a + b Y).

        A lower end, and the range above it, is left out if it lies below a third of the luminance
        of the darkest group, or below that luminance if all dark pixels have nearly one. The noise
        without light must also be at least a fifth of the variance of the darkest group.

        If no pixel is saturated, the scene does not reach the top of the sensor. The range is then
        a lower bound and has no upper confidence limit. The interval of a range follows from a
        jackknife over the groups of dark pixels, and from the noise of the brightest pixel; that of
        the upper end follows from this noise alone.
        """
        picture = undenoised(picture)
        y, _, valid = luminances(picture, truth)
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
        blocks = noise_of_blocks(picture, truth)
        # without pixels like their cell, means of uneven cells are the best that there is
        use = blocks.even if blocks.even.any() else valid
        light, noise = dark_medians(blocks.light[use], blocks.noise[use], self.darkest_share)
        farthest = FARTHEST
        darkest = float(light.min())
        if np.ptp(light) < 0.1 * (light.mean() or 1.0):
            # read noise and shot noise cannot be told apart here, so all noise counts as read noise
            light = np.zeros_like(light)
            farthest = 1.0
            ledger.left_out(
                "shot noise in the dark",
                "the darkest pixels have nearly one luminance, so the fit a + b Y is a constant",
                NAN,
                "dB",
            )
        line = line_through(light, noise)
        without = [
            lower_ends(line_through(np.delete(light, k), np.delete(noise, k)))
            for k in range(len(light))
            if len(light) > 2 and intervals_wanted()
        ]
        scores = []
        for name, bottom in lower_ends(line).items():
            if why := why_unmeasured(name, bottom, line, darkest, farthest):
                ledger.left_out(f"dynamic_range{name}", why, NAN, "dB")
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
        half = 1.96 * top_noise
        scores.append(
            Score(
                "dynamic_range_top",
                top,
                "cd m-2",
                "",
                top - half,
                top + half if reached else NAN,
            )
        )
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


def lower_ends(line: NoiseLine) -> dict[str, float]:
    """Return the lower end of the range by each definition, cd/m2, from the line through the
    variances.
    """
    a, b = line
    return {
        "": (b + np.sqrt(b * b + 4 * a)) / 2,
        "_dark_noise": np.sqrt(a),
        "_snr_10db": (10 * b + np.sqrt(100 * b * b + 40 * a)) / 2,
    }


def why_unmeasured(
    name: str, end: float, line: NoiseLine, darkest_cd_m2: float, farthest: float
) -> str:
    """Return why the dark pixels do not determine a lower end; "" if they do.

    Parameters
    ----------
    name : definition of the end, a key of `lower_ends`.
    end : the lower end, cd/m2.
    line : line through the variances of the dark pixels.
    darkest_cd_m2 : median luminance of the darkest group of pixels, cd/m2.
    farthest : largest ratio of that luminance and a lower end.

    Notes
    -----
    A lower end far below the darkest pixels is an extrapolation. It depends on one of the terms of
    a + b Y that adds little to any of the variances. The noise without light, a, must be visible in
    the variance of the darkest pixels even if they are dark enough, because a camera that counts
    single photons has shot noise below the luminance of one electron, too.
    """
    darkest_variance = line.read + line.step * darkest_cd_m2
    if not darkest_variance > 0 and not end > 0:
        return "no noise in the dark"
    if name == "_dark_noise" and line.read < VISIBLE * darkest_variance:
        return (
            f"the noise without light is less than {VISIBLE:g} of the variance of the darkest "
            f"pixels, which have {darkest_cd_m2:.3g} cd/m2; the scene needs darker pixels, unless "
            "the camera has no such noise"
        )
    if end < darkest_cd_m2 / farthest:
        times = f"{farthest:g} times " if farthest > 1 else ""
        return (
            f"the darkest pixels have {darkest_cd_m2:.3g} cd/m2, more than {times}the lower end; "
            "the scene needs darker pixels, for example those of scene=luminance_ramp"
        )
    return ""


def jackknife_sd(ends: Sequence[Any]) -> float:
    """Return the standard deviation of the logarithm of a lower end by the jackknife (Efron 1982,
    eq. 3.1). `ends` are its values with one group left out each.
    """
    if len(ends) < 2 or min(ends) <= 0:
        return float("nan")
    logs = np.log(ends)
    return float(np.sqrt((len(logs) - 1) / len(logs) * np.sum((logs - logs.mean()) ** 2)))

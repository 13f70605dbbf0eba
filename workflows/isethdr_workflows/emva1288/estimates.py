"""The estimates of EMVA 1288 (release 4.0, linear model) from pictures alone, each with its
standard error.

The standard does not define errors of its estimates. The standard errors here follow from the
scatter of variances. They make it possible to compare an estimate with the known camera.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, pi, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr

from .camera import Pair, Stack

if TYPE_CHECKING:
    from collections.abc import Sequence


ROUNDING = 1 / 12  # variance of rounding, DN^2, section 2.7
RESOLVED_DN2 = 0.24  # dark variance below which rounding hides the noise, section 6.6
TRANSFER_END = 0.7  # end of the range of the photon transfer fit, share of saturation, section 6.6
# nodes and weights of averages over pixels with normally distributed responses
NODES, NODE_SHARE = np.polynomial.hermite_e.hermegauss(15)
NODE_SHARE = NODE_SHARE / NODE_SHARE.sum()


@dataclass(frozen=True)
class Estimate:
    """One measured figure with its standard error.

    A figure that is the root of a difference of variances keeps that difference as `square`,
    because near 0 only the error of the difference is normal.
    """

    value: float
    error: float
    bound: bool = False  # whether the standard only states an upper limit, which is `value`
    square: float | None = None  # the difference of variances, which may be negative
    square_error: float | None = None  # standard error of `square`

    def off(self, true: float) -> float:
        """Return the measured figure minus the true one, in standard errors; 0 for a bound."""
        if self.bound:
            return 0.0
        estimate, true, error = (
            (self.value, true, self.error)
            if self.square is None
            else (self.square, true**2, self.square_error)
        )
        return (
            (estimate - true) / error
            if error
            else float("inf") * (estimate - true)
            if estimate != true
            else 0.0
        )


def rounding_dn2(digital: bool) -> float:
    """Return the variance of rounding; 0 for a camera without a converter."""
    return ROUNDING if digital else 0.0


def gain_and_responsivity(
    pairs: list[Pair], dark: Pair, digital: bool
) -> tuple[Estimate, Estimate]:
    """Return the system gain K (DN/e) and the responsivity R (DN/photon), both as slopes over the
    lower 70 % of the range (section 6.6).

    Parameters
    ----------
    pairs : pairs of pictures at levels up to saturation.
    dark : pair of pictures without light.
    digital : whether codes are rounded to whole numbers.
    """
    lit = [
        p
        for p in pairs
        if p.photons <= TRANSFER_END * saturation(pairs).photons
        and (not digital or p.variance_dn2 > RESOLVED_DN2)
    ]
    mean = np.array([p.mean_dn - dark.mean_dn for p in lit])
    variance = np.array([p.variance_dn2 for p in lit])
    pixels = np.array([p.pixels for p in lit])
    # weights come from a first fit, because weights from the measured variances would favour
    # variances that are too small by chance
    first = np.polyfit(mean, variance, 1)
    weight = pixels / (2 * np.maximum(np.polyval(first, mean), variance.min()) ** 2)
    if resolved(dark, digital):
        slope = np.sum(weight * mean * (variance - dark.variance_dn2)) / np.sum(weight * mean**2)
        # the error of the dark variance is common to all levels
        shared = np.sum(weight * mean) / np.sum(weight * mean**2)
        error = sqrt(
            1 / np.sum(weight * mean**2) + shared**2 * 2 * dark.variance_dn2**2 / dark.pixels
        )
    # rounding hides the dark noise, so its variance cannot be subtracted; the offset of the line is
    # fitted instead
    else:
        deviation = mean - np.average(mean, weights=weight)
        slope = np.sum(weight * deviation * variance) / np.sum(weight * deviation**2)
        error = sqrt(1 / np.sum(weight * deviation**2))
    photons = np.array([p.photons for p in lit])
    mean_error = variance / np.array([p.pixels for p in lit]) / 2
    per_photon = np.sum(photons * mean / mean_error) / np.sum(photons**2 / mean_error)
    return Estimate(slope, error), Estimate(per_photon, sqrt(1 / np.sum(photons**2 / mean_error)))


def quantum_efficiency(gain: Estimate, responsivity: Estimate) -> Estimate:
    """Return the quantum efficiency R / K, electrons per photon.

    Parameters
    ----------
    gain : system gain K, DN per electron.
    responsivity : responsivity R, DN per photon.
    """
    value = responsivity.value / gain.value
    return Estimate(
        value,
        value
        * sqrt((gain.error / gain.value) ** 2 + (responsivity.error / responsivity.value) ** 2),
    )


def resolved(dark: Pair, digital: bool) -> bool:
    """Return whether the dark noise is large enough to be measured in spite of rounding."""
    return not digital or dark.variance_dn2 >= RESOLVED_DN2


def dark_noise_e(dark: Pair, gain: Estimate, digital: bool) -> Estimate:
    """Return the temporal dark noise, electrons, or its upper limit of 0.40 DN if rounding hides
    it (section 6.6).

    Parameters
    ----------
    dark : pair of pictures without light.
    gain : system gain, DN per electron.
    digital : whether codes are rounded to whole numbers.
    """
    if not resolved(dark, digital):
        return Estimate(0.40 / gain.value, 0.0, bound=True)
    variance = dark.variance_dn2 - rounding_dn2(digital)
    # rounding adds 1/12 only on average over positions within a step; further terms of its series
    # (Widrow 1961) are at most this
    rounding = (4 * variance + 1 / pi**2) * exp(-2 * pi**2 * variance) if digital else 0.0
    of_variance = sqrt(2 * dark.variance_dn2**2 / dark.pixels + rounding**2)
    noise = sqrt(variance) / gain.value
    return Estimate(
        noise, noise * sqrt((of_variance / (2 * variance)) ** 2 + (gain.error / gain.value) ** 2)
    )


def saturation(pairs: list[Pair]) -> Pair:
    """Return the level with the largest temporal variance (section 6.6). Above it, clipping reduces
    the noise.
    """
    return max(pairs, key=lambda p: p.variance_dn2)


def full_well_e(blinded: Pair, dark: Pair, gain: Estimate, dark_noise: Estimate) -> Estimate:
    """Return the full well, electrons: the mean of pictures far beyond saturation.

    Parameters
    ----------
    blinded : pair of pictures far beyond saturation.
    dark : pair of pictures without light.
    gain : system gain, DN per electron.
    dark_noise : temporal dark noise, electrons.
    """
    value = (blinded.mean_dn - dark.mean_dn) / gain.value
    # at the top code only the lower half of the read noise remains, with a mean of -0.4 of its rms
    clipped = 0.4 * dark_noise.value
    return Estimate(
        value, sqrt((value * gain.error / gain.value) ** 2 + clipped**2 + (0.5 / gain.value) ** 2)
    )


def saturation_photons(
    pairs: list[Pair], dark: Pair, gain: Estimate, responsivity: Estimate, prnu_percent: float
) -> Estimate:
    """Return the photons at which the mean charge reaches the end of the scale, from the loss of
    temporal noise by clipping.

    The standard takes the level of largest variance, which is only known to a few percent, because
    the variance is flat below the end. Here the decrease itself is fitted. At the end, the variance
    of one pixel is 0.34 of the transfer line, for every gain.

    Parameters
    ----------
    pairs : pairs of pictures at levels, some of them within a few shot noises of the end.
    dark : pair of pictures without light.
    gain, responsivity : system gain, DN per electron, and responsivity, DN per photon.
    prnu_percent : spread of the pixels' response, so that each reaches the end at another level.
    """
    top = saturation(pairs).photons
    near = [p for p in pairs if p.photons > 0.9 * top]
    photons = np.array([p.photons for p in near])
    pixels = np.array([p.pixels for p in near])
    line = dark.variance_dn2 + gain.value * responsivity.value * photons
    ratio = np.array([p.variance_dn2 for p in near]) / line

    def fall(end: int) -> Any:
        spread = np.sqrt(line) / responsivity.value  # temporal noise of one pixel, photons
        return np.sum(
            NODE_SHARE
            * clipped_variance(
                (end - photons[:, None] * (1 + prnu_percent / 100 * NODES)) / spread[:, None]
            ),
            1,
        )

    def residual(end: Sequence[float]) -> Any:
        return (ratio - fall(end[0])) / np.sqrt(2 / pixels)

    start = min(photons, key=lambda end: np.sum(residual([end]) ** 2))
    fit = least_squares(residual, [start], x_scale=start * 1e-3, diff_step=1e-5)
    slope = float(np.sum(fit.jac**2))
    # effect of the line's own error, which scales the whole ratio
    moved = float(
        np.sum(fit.jac[:, 0] * (ratio * (gain.error / gain.value)) / np.sqrt(2 / pixels)) / slope
    )
    return Estimate(float(fit.x[0]), sqrt(1 / slope + moved**2))


def clipped_variance(t: np.ndarray) -> Any:
    """Return the variance of a standard normal that is clipped at `t` above its mean."""
    density = np.exp(-0.5 * t * t) / sqrt(2 * pi)
    tail = ndtr(-t)
    mean = t * tail - density
    return 1 - tail - t * density + t * t * tail - mean**2


def spatial(stack: Stack) -> Estimate:
    """Return the variance (DN^2) between the pixels of a stack, without temporal noise (section
    8.2).
    """
    raw = float(np.var(stack.mean_dn, ddof=1))
    return Estimate(
        raw - stack.left_dn2,
        sqrt(
            2 * raw**2 / stack.pixels
            + 2 * stack.left_dn2**2 / (stack.pixels * (stack.pictures - 1))
        ),
    )


def dsnu_e(dark: Stack, gain: Estimate, shared: float) -> Estimate:
    """Return the dark signal non-uniformity, electrons rms.

    Parameters
    ----------
    dark : average of dark pictures.
    gain : system gain, DN per electron.
    shared : relative standard error of the pattern's own variance, because a pattern of few columns
        is a small sample.
    """
    variance = spatial(dark)
    return root(
        variance.value / gain.value**2,
        sqrt(variance.error**2 + (shared * variance.value) ** 2) / gain.value**2,
    )


def root(square: float, error: float) -> Estimate:
    """Return the root of a measured variance, which may be negative by chance; then it is 0.

    Parameters
    ----------
    square : measured variance.
    error : its standard error.
    """
    value = sqrt(max(square, 0.0))
    return Estimate(
        value, sqrt(max(square, 0.0) + error) - value, square=square, square_error=error
    )


def prnu_percent(half: Stack, dark: Stack) -> Estimate:
    """Return the photo response non-uniformity, percent rms, from a stack at half saturation
    (section 8.3).

    Parameters
    ----------
    half : average of pictures at half saturation.
    dark : average of dark pictures.
    """
    lit = spatial(half)
    unlit = spatial(dark)
    signal = float(half.mean_dn.mean() - dark.mean_dn.mean())
    return root(
        (lit.value - unlit.value) * (100 / signal) ** 2,
        sqrt(lit.error**2 + unlit.error**2) * (100 / signal) ** 2,
    )


def linearity_error_percent(pairs: list[Pair], dark: Pair) -> Estimate:
    """Return the mean absolute deviation from a line, percent, at 5 to 95 % of saturation (section
    7). The line has the least squares of relative deviations.

    Parameters
    ----------
    pairs : pairs of pictures at levels up to saturation.
    dark : pair of pictures without light.
    """
    top = saturation(pairs).photons
    lit = [p for p in pairs if 0.05 * top <= p.photons <= 0.95 * top]
    photons = np.array([p.photons for p in lit])
    mean = np.array([p.mean_dn - dark.mean_dn for p in lit])
    relative = np.sqrt([p.variance_dn2 / (2 * p.pixels) for p in lit]) / mean
    design = np.stack([photons / mean, 1 / mean], 1)
    slope, offset = np.linalg.lstsq(design, np.ones(len(lit)), rcond=None)[0]
    deviation = mean / (slope * photons + offset) - 1
    return Estimate(100 * float(np.mean(np.abs(deviation))), 100 * float(np.mean(relative)))

"""The estimates of EMVA 1288 (release 4.0, linear model) from pictures alone, each with its
standard error.

The standard defines no errors of its estimates. The standard errors here follow from the scatter of
variances, so that an estimate can be compared with the known camera.
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


ROUNDING = 1 / 12  # DN^2, section 2.7
RESOLVED_DN2 = 0.24  # dark variance below which rounding hides the noise, section 6.6
TRANSFER_END = 0.7  # of saturation: range of the photon transfer fit, section 6.6
NODES, NODE_SHARE = np.polynomial.hermite_e.hermegauss(15)  # averages over normally spread pixels
NODE_SHARE = NODE_SHARE / NODE_SHARE.sum()


@dataclass(frozen=True)
class Estimate:
    """One measured figure; `bound`: the standard states an upper limit only.

    A figure that is the root of a difference of variances keeps that difference: near 0 only its
    error is normal.
    """

    value: float
    error: float
    bound: bool = False
    square: float | None = None  # may be negative
    square_error: float | None = None

    def off(self, true: float) -> float:
        """Return (found - true) in standard errors; 0 for a bound."""
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
    lower 70 % (section 6.6).

    Parameters
    ----------
    pairs : levels up to saturation.
    dark : the level without light.
    digital : whether codes are whole numbers, which rounding shows in.
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
    # weights from a first line, not from each measured variance: that would favour those found too
    # small
    first = np.polyfit(mean, variance, 1)
    weight = pixels / (2 * np.maximum(np.polyval(first, mean), variance.min()) ** 2)
    if resolved(dark, digital):
        slope = np.sum(weight * mean * (variance - dark.variance_dn2)) / np.sum(weight * mean**2)
        # the dark variance enters every level
        shared = np.sum(weight * mean) / np.sum(weight * mean**2)
        error = sqrt(
            1 / np.sum(weight * mean**2) + shared**2 * 2 * dark.variance_dn2**2 / dark.pixels
        )
    # rounding hides the dark noise, so its variance cannot be subtracted: the line finds its own
    # floor
    else:
        deviation = mean - np.average(mean, weights=weight)
        slope = np.sum(weight * deviation * variance) / np.sum(weight * deviation**2)
        error = sqrt(1 / np.sum(weight * deviation**2))
    photons = np.array([p.photons for p in lit])
    mean_error = variance / np.array([p.pixels for p in lit]) / 2
    per_photon = np.sum(photons * mean / mean_error) / np.sum(photons**2 / mean_error)
    return Estimate(slope, error), Estimate(per_photon, sqrt(1 / np.sum(photons**2 / mean_error)))


def quantum_efficiency(gain: Estimate, responsivity: Estimate) -> Estimate:
    """Return electrons per photon: R / K."""
    value = responsivity.value / gain.value
    return Estimate(
        value,
        value
        * sqrt((gain.error / gain.value) ** 2 + (responsivity.error / responsivity.value) ** 2),
    )


def resolved(dark: Pair, digital: bool) -> bool:
    """Return whether the dark noise stands out of rounding."""
    return not digital or dark.variance_dn2 >= RESOLVED_DN2


def dark_noise_e(dark: Pair, gain: Estimate, digital: bool) -> Estimate:
    """Return the temporal dark noise, electrons; its upper limit 0.40 DN if rounding hides it
    (section 6.6).

    Parameters
    ----------
    dark : the level without light.
    gain : system gain, DN per electron.
    digital : whether codes are whole numbers.
    """
    if not resolved(dark, digital):
        return Estimate(0.40 / gain.value, 0.0, bound=True)
    variance = dark.variance_dn2 - rounding_dn2(digital)
    # rounding adds 1/12 only on average over fractions of a step; the rest of its series (Widrow
    # 1961) is at most this
    rounding = (4 * variance + 1 / pi**2) * exp(-2 * pi**2 * variance) if digital else 0.0
    of_variance = sqrt(2 * dark.variance_dn2**2 / dark.pixels + rounding**2)
    noise = sqrt(variance) / gain.value
    return Estimate(
        noise, noise * sqrt((of_variance / (2 * variance)) ** 2 + (gain.error / gain.value) ** 2)
    )


def saturation(pairs: list[Pair]) -> Pair:
    """Return the level of largest temporal variance (section 6.6): beyond it, clipping takes noise
    away.
    """
    return max(pairs, key=lambda p: p.variance_dn2)


def full_well_e(blinded: Pair, dark: Pair, gain: Estimate, dark_noise: Estimate) -> Estimate:
    """Return the charge at which numbers end, electrons: the mean far beyond saturation.

    Parameters
    ----------
    blinded : a level far beyond saturation.
    dark : the level without light.
    gain : system gain, DN per electron.
    dark_noise : temporal dark noise, electrons.
    """
    value = (blinded.mean_dn - dark.mean_dn) / gain.value
    # at the top code only the lower half of the read noise is left, mean -0.4 of its rms
    clipped = 0.4 * dark_noise.value
    return Estimate(
        value, sqrt((value * gain.error / gain.value) ** 2 + clipped**2 + (0.5 / gain.value) ** 2)
    )


def saturation_photons(
    pairs: list[Pair], dark: Pair, gain: Estimate, responsivity: Estimate, prnu_percent: float
) -> Estimate:
    """Return the photons whose mean charge reaches the end of the scale, from the loss of temporal
    noise by clipping.

    The standard takes the level of largest variance, which is only known to a few percent, because
    the variance is flat below the end. Here the decrease itself is fitted: at the end, the noise of
    one pixel is 0.34 of the transfer line, for every gain.

    Parameters
    ----------
    pairs : levels, some of them within a few shot noises of the end.
    dark : pair of pictures in darkness.
    gain, responsivity : of the capture.
    prnu_percent : spread of the pixels' response: each reaches the end at a different light.
    """
    top = saturation(pairs).photons
    near = [p for p in pairs if p.photons > 0.9 * top]
    photons = np.array([p.photons for p in near])
    pixels = np.array([p.pixels for p in near])
    line = dark.variance_dn2 + gain.value * responsivity.value * photons
    ratio = np.array([p.variance_dn2 for p in near]) / line

    def fall(end: int) -> Any:
        spread = np.sqrt(line) / responsivity.value  # of one pixel's shot, photons
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
    # the line's own error moves the whole ratio; its effect by a finite step
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
    """Return the variance (DN^2) between pixels of a stack, freed of temporal noise (section
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
    shared : relative standard error of the pattern's own variance: of a few columns there are only
        a few draws.
    dark : average of dark pictures.
    gain : system gain, DN per electron.
    """
    variance = spatial(dark)
    return root(
        variance.value / gain.value**2,
        sqrt(variance.error**2 + (shared * variance.value) ** 2) / gain.value**2,
    )


def root(square: float, error: float) -> Estimate:
    """Return the rms of a variance that may be found negative."""
    value = sqrt(max(square, 0.0))
    return Estimate(
        value, sqrt(max(square, 0.0) + error) - value, square=square, square_error=error
    )


def prnu_percent(half: Stack, dark: Stack) -> Estimate:
    """Return the photo response non-uniformity, percent rms, from a stack at half saturation
    (section 8.3).
    """
    lit = spatial(half)
    unlit = spatial(dark)
    signal = float(half.mean_dn.mean() - dark.mean_dn.mean())
    return root(
        (lit.value - unlit.value) * (100 / signal) ** 2,
        sqrt(lit.error**2 + unlit.error**2) * (100 / signal) ** 2,
    )


def linearity_error_percent(pairs: list[Pair], dark: Pair) -> Estimate:
    """Return the mean deviation from the line of least relative deviations, 5 to 95 % of
    saturation, percent (section 7).
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

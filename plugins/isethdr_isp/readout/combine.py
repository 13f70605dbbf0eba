"""Combine: merge any number of captures of one shot into one mosaic of electrons, without bias.

Weights must depend on the noisy data, and such weights usually bias the result. For a charge
t = N + n with N Poisson(m) and n normal(0, v), and any smooth function G (Chen 1975; Stein 1981),

    E[t G(t)] = m E[G(t + 1)] + v E[G'(t)]

Let d be the known dark charge, and z an independent estimate of the signal m - d. Then

    x = t G(t) - v G'(t) - d G(t + 1) + z (1 - G(t + 1))

has exactly the mean m - d for every G. Here G is the weight by inverse variances, times a ramp that
ends just below saturation and is one standard deviation of the shot noise wide. Several readings of
one charge are averaged first, with constant weights. The weights depend on the temporal noise
alone; the fixed pattern is propagated with them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from .electrons import Readout, charge_variance
from .fixed_pattern import CAUSES, WeightedRead, fixed_pattern
from .noise_propagation import Alike, NoisePart, SampleNoise


@dataclass(frozen=True, eq=False)
class Merged:
    """One mosaic in electrons of the most sensitive charge, without dark charge."""

    signal_e: np.ndarray  # (y, x)
    variance_e2: np.ndarray  # (y, x) temporal variance
    valid: np.ndarray  # (y, x) bool, far enough below the top of some capture
    source: np.ndarray  # (y, x) uint8, number of the capture with the largest weight
    fixed: SampleNoise = field(default_factory=SampleNoise)  # fixed-pattern variance, e^2


def joined_rows(blocks: list[Merged]) -> Merged:
    """Return the mosaic of blocks of rows, joined one below the other."""
    if len(blocks) == 1:
        return blocks[0]
    signal = np.concatenate([block.signal_e for block in blocks])
    variance = np.concatenate([block.variance_e2 for block in blocks])
    valid = np.concatenate([block.valid for block in blocks])
    source = np.concatenate([block.source for block in blocks])
    ends = np.cumsum([0, *(len(block.signal_e) for block in blocks)])
    parts: dict[tuple[Alike, Alike], NoisePart] = {}
    for block, start, end in zip(blocks, ends[:-1], ends[1:], strict=True):
        for part in block.fixed.parts:
            # a block without this cause of noise keeps the variance 0
            joined = parts.setdefault(
                (part.rows, part.columns), part._replace(variance_e2=np.zeros(signal.shape))
            )
            joined.variance_e2[start:end] = part.variance_e2
    order = sorted(parts, key=CAUSES.index)
    return Merged(signal, variance, valid, source, SampleNoise(tuple(parts[k] for k in order)))


def single_capture(read: Readout) -> Merged:
    """Return one reading as a mosaic. All samples that are not saturated are valid."""
    signal = read.charge_e - read.dark_e
    variance = read.variance_e2()
    source = np.full(signal.shape, read.capture, np.uint8)
    return Merged(
        signal,
        variance,
        ~read.saturated,
        source,
        fixed_pattern([WeightedRead(read.spread, 1.0)], signal, variance),
    )


@dataclass(frozen=True, eq=False)
class Charge:
    """The best estimate of one charge from all its readings, for each pixel."""

    t_e: np.ndarray  # (y, x) estimate, dark charge included
    read_var_e2: np.ndarray  # (y, x) variance of the estimate without shot noise
    dark_e: float  # mean dark charge
    top_e: float  # largest charge still measured, minus the margin for clipped charge
    good: np.ndarray  # (y, x) bool, not saturated
    # (y, x) electrons per cd/m2 of the white, for the filter of each pixel
    per_light: np.ndarray
    source: np.ndarray  # (y, x) uint8, number of the capture of the reading with the largest weight
    reads: tuple[WeightedRead, ...] = ()  # the readings and their weights in `t_e`


def read_charge(reads: list[Readout], per_light: np.ndarray) -> Charge:
    """Return one charge from its readings. Readings below their top are weighted by 1 / read
    variance.

    These weights do not depend on the light, so there is no bias. The readings share their shot
    noise, which counts once.

    Parameters
    ----------
    reads : all readings of the charge.
    per_light : (y, x) electrons per cd/m2 of the white.
    """
    widest = max(reads, key=lambda r: r.top_e)
    total = np.zeros(widest.charge_e.shape)
    weight = np.zeros_like(total)
    largest = np.zeros_like(total)
    source = np.full(total.shape, widest.capture, np.uint8)
    usable = np.zeros(total.shape, bool)
    inverses = []
    for read in reads:
        # a full well is marked as saturated, although read noise may take it below the top
        use = (read.charge_e < read.clear_top_e) & ~read.saturated
        # a reading without noise gets a very large weight
        inverse = np.where(use, 1 / np.maximum(read.read_var_e2, 1e-12), 0.0)
        inverses.append(inverse)
        total += inverse * read.charge_e
        weight += inverse
        source[inverse > largest] = read.capture
        largest = np.maximum(largest, inverse)
        usable |= use
    safe = np.where(usable, weight, 1.0)
    t = np.where(usable, total / safe, widest.charge_e)
    variance = np.where(usable, 1 / safe, widest.read_var_e2)
    shares = [
        np.where(usable, inverse / safe, float(read is widest)) if len(reads) > 1 else 1.0
        for read, inverse in zip(reads, inverses)
    ]
    # The shares sum to 1. PRNU and dark spread, which the readings have in common, count once.
    weighted = [WeightedRead(read.spread.of_offsets(), share) for read, share in zip(reads, shares)]
    weighted.append(WeightedRead(widest.spread.of_silicon(), 1.0))
    return Charge(
        t, variance, widest.dark_e, widest.clear_top_e, usable, per_light, source, tuple(weighted)
    )


def fold(charges: list[Charge]) -> Merged:
    """Return the mosaic merged from `charges`, from the least to the most sensitive, in electrons
    of the last one.
    """
    short = charges[0]
    z = short.t_e - short.dark_e
    z_var = charge_variance(short.t_e, short.read_var_e2)
    valid = short.good
    source = short.source
    weights = [1.0]  # electrons of the mosaic per electron of each charge
    for charge in charges[1:]:
        ratio = short.per_light / charge.per_light
        z = z / ratio
        z_var = z_var / ratio**2
        g, slope = weight(charge.t_e, charge, short, ratio)
        g_next, _ = weight(charge.t_e + 1, charge, short, ratio)
        signal = (
            charge.t_e * g - charge.read_var_e2 * slope - charge.dark_e * g_next + z * (1 - g_next)
        )
        z_var = g**2 * charge_variance(charge.t_e, charge.read_var_e2) + (1 - g) ** 2 * z_var
        source = np.where(g > 0.5, charge.source, source)
        share_of_earlier = (1 - g) / ratio
        weights = [*(w * share_of_earlier for w in weights), g]
        z = signal
        valid = valid | charge.good
        short = charge
    reads = [
        WeightedRead(
            read.spread,
            w * read.weight,
            1.0 if charge is short else _relative(charge.per_light, short.per_light),
        )
        for charge, w in zip(charges, weights)
        for read in charge.reads
        if read.spread.any()
    ]
    return Merged(z, z_var, valid, source, fixed_pattern(reads, z, z_var))


def _relative(per_light: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Return the sensitivity of a charge relative to that of another; 1 where the latter is 0."""
    sensitive = np.asarray(reference) > 0
    return np.divide(per_light, reference, out=np.ones(np.shape(sensitive)), where=sensitive)


def weight(
    t: np.ndarray, charge: Charge, short: Charge, ratio: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the weight G (y, x) of the more sensitive charge, and its derivative (y, x), 1/e.

    Parameters
    ----------
    t : electrons (y, x) of the more sensitive charge, the argument of G.
    charge : the more sensitive charge.
    short : the less sensitive charge.
    ratio : electrons of `short` per electron of `charge`, a number or (y, x).
    """
    mean = np.maximum(t, 0.0)
    variance_long = mean + charge.read_var_e2
    # variance of the less sensitive charge at this light, in electrons of the more sensitive one
    variance_short = mean / ratio + (short.dark_e + short.read_var_e2) / ratio**2
    total = variance_long + variance_short
    dark = total <= 0  # without light and read noise, use the limit of the formula
    total = np.where(dark, 1.0, total)
    share = np.where(dark, 1 / (1 + ratio), variance_short / total)
    slope = np.where(t > 0, (variance_long / ratio - variance_short) / total**2, 0.0)
    width = np.sqrt(max(charge.top_e, 1.0))
    # with an infinite top, all charges are below the ramp
    s = np.clip((charge.top_e - t) / width, 0.0, 1.0) if np.isfinite(width) else np.ones_like(t)
    ramp = s * s * (3 - 2 * s)
    ramp_slope = -6 * s * (1 - s) / width
    usable = charge.good
    return np.where(usable, share * ramp, 0.0), np.where(
        usable, slope * ramp + share * ramp_slope, 0.0
    )

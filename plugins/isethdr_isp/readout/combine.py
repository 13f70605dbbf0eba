"""Combine: merge any number of captures of one shot into one mosaic of electrons, without bias.

Weights must follow the noisy data, and such weights usually bias the result. For a charge t = N + n
with N Poisson(m) and n normal(0, v), and any smooth G,

    E[t G(t)] = m E[G(t + 1)] + v E[G'(t)]                                    (Chen 1975; Stein
    1981)

so that, with z an independent estimate of the signal m - d and d the known dark charge,

    x = t G(t) - v G'(t) - d G(t + 1) + z (1 - G(t + 1))

has exactly the mean of the signal for every G. Here G is the weight of inverse variances, times a
ramp that ends just below saturation and is one standard deviation of the shot noise wide. Several
reads of one charge are averaged first, with constant weights. The weights follow the temporal noise
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
    """One mosaic of electrons, without dark charge, of the most sensitive charge."""

    signal_e: np.ndarray  # (y, x)
    variance_e2: np.ndarray  # (y, x)
    valid: np.ndarray  # (y, x) bool, unsaturated in some capture
    source: np.ndarray  # (y, x) uint8, the capture that weighs most
    fixed: SampleNoise = field(default_factory=SampleNoise)  # fixed-pattern variance, e^2


def joined_rows(blocks: list[Merged]) -> Merged:
    """Return the mosaic of these blocks of rows, one below the other."""
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
            # a block without this cause of noise has none of it
            joined = parts.setdefault(
                (part.rows, part.columns), part._replace(variance_e2=np.zeros(signal.shape))
            )
            joined.variance_e2[start:end] = part.variance_e2
    order = sorted(parts, key=CAUSES.index)
    return Merged(signal, variance, valid, source, SampleNoise(tuple(parts[k] for k in order)))


def single_capture(read: Readout) -> Merged:
    """Return one reading as a mosaic, without a margin below its top."""
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
    """One charge as best read: its estimate and the variance of the read, per pixel."""

    t_e: np.ndarray  # (y, x) dark charge included
    read_var_e2: np.ndarray  # (y, x)
    dark_e: float
    top_e: float  # less the margin for clipped charge
    good: np.ndarray  # (y, x) bool, not saturated
    # (y, x) electrons per cd/m2 of the white, each pixel through its own filter
    per_light: np.ndarray
    source: np.ndarray  # (y, x) uint8, the capture whose read weighs most
    reads: tuple[WeightedRead, ...] = ()  # the readings and their shares of `t_e`


def read_charge(reads: list[Readout], per_light: np.ndarray) -> Charge:
    """Return one charge from all reads of it: those below their top, weighted by 1 / read variance.

    The weights do not depend on the light, so there is no bias. Shot noise that the reads share is
    counted once.
    """
    widest = max(reads, key=lambda r: r.top_e)
    total = np.zeros(widest.charge_e.shape)
    weight = np.zeros_like(total)
    largest = np.zeros_like(total)
    source = np.full(total.shape, widest.capture, np.uint8)
    usable = np.zeros(total.shape, bool)
    inverses = []
    for read in reads:
        # a full well reads as saturated though its read noise may lie below the top
        use = (read.charge_e < read.clear_top_e) & ~read.saturated
        # a noiseless read simply outweighs the others
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
    # the shares add to 1, so PRNU and dark spread, which the readings have in common, count once
    weighted = [WeightedRead(read.spread.of_offsets(), share) for read, share in zip(reads, shares)]
    weighted.append(WeightedRead(widest.spread.of_silicon(), 1.0))
    return Charge(
        t, variance, widest.dark_e, widest.clear_top_e, usable, per_light, source, tuple(weighted)
    )


def fold(charges: list[Charge]) -> Merged:
    """Return the mosaic in electrons of the last charge; `charges` runs from least to most
    sensitive.
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
    """Return the sensitivity of a charge over that of another, 1 where both are 0."""
    sensitive = np.asarray(reference) > 0
    return np.divide(per_light, reference, out=np.ones(np.shape(sensitive)), where=sensitive)


def weight(
    t: np.ndarray, charge: Charge, short: Charge, ratio: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the weight G of the more sensitive charge, and its derivative.

    Parameters
    ----------
    t : electrons (y, x) of the more sensitive charge, at which G is taken.
    charge : the more sensitive charge.
    short : the less sensitive charge.
    ratio : electrons of `short` per electron of `charge`, a number or (y, x).
    """
    mean = np.maximum(t, 0.0)
    variance_long = mean + charge.read_var_e2
    # what the shorter capture's variance would be at this light, in electrons of the longer one
    variance_short = mean / ratio + (short.dark_e + short.read_var_e2) / ratio**2
    total = variance_long + variance_short
    dark = total <= 0  # no light, no read noise: the limit of the same formula
    total = np.where(dark, 1.0, total)
    share = np.where(dark, 1 / (1 + ratio), variance_short / total)
    slope = np.where(t > 0, (variance_long / ratio - variance_short) / total**2, 0.0)
    width = np.sqrt(max(charge.top_e, 1.0))
    # a sensor without a well has an infinite top: always below the ramp
    s = np.clip((charge.top_e - t) / width, 0.0, 1.0) if np.isfinite(width) else np.ones_like(t)
    ramp = s * s * (3 - 2 * s)
    ramp_slope = -6 * s * (1 - s) / width
    usable = charge.good
    return np.where(usable, share * ramp, 0.0), np.where(
        usable, slope * ramp + share * ramp_slope, 0.0
    )

"""Merge rules: the default rule and published rules for merging a shot, for comparison. All have
the same signature.

The arguments of a rule are the readings of every charge, least sensitive charge first, and for each
charge the electrons per cd/m2 of its pixels (y, x). A rule returns `Merged` in absolute electrons
of the most sensitive charge. In the published rules, a reading counts as good below 95 % of its
top, ISETCam's saturated fraction. Each rule states its own variance. Readings of one charge share
their shot noise.
"""

from __future__ import annotations

import numpy as np

from .combine import Merged, fold, joined_rows, read_charge
from .electrons import Readout, charge_variance
from .fixed_pattern import WeightedRead, fixed_pattern

AT_ONCE = 1 << 14  # number of pixels merged at a time
SHARE = 0.95  # share of the top below which a reading is good (sensorComputeArray.m)


def inverse_variance(groups: list[list[Readout]], per_light: list[np.ndarray]) -> Merged:
    """Return the merge by inverse variance without bias, the default rule.

    It is computed in blocks of rows, so that intermediate results stay in the processor's cache.
    The block size does not change the result.
    """
    height, width = per_light[0].shape
    step = max(1, AT_ONCE // width)
    blocks = [slice(top, top + step) for top in range(0, height, step)]
    return joined_rows([_inverse_variance(groups, per_light, rows) for rows in blocks])


def _inverse_variance(
    groups: list[list[Readout]], per_light: list[np.ndarray], rows: slice
) -> Merged:
    charges = [
        read_charge([read.of_rows(rows) for read in reads], light[rows])
        for reads, light in zip(groups, per_light)
    ]
    return fold(charges)


def isetcam(groups: list[list[Readout]], per_light: list[np.ndarray]) -> Merged:
    """Return the merge by ISETCam's rule 'saturated' (sensorComputeArray.m): for each charge, only
    the reading with the widest range counts, and the most sensitive charge with a good reading is
    used.

    Higher gains of one charge are never used. ISETCam does not test the saturation of the least
    sensitive charge; here it sets `valid`.
    """
    return _descend([[max(reads, key=lambda r: r.top_e)] for reads in groups], per_light)


def average(groups: list[list[Readout]], per_light: list[np.ndarray]) -> Merged:
    """Return the merge by the rule of the ISETHDR paper: the mean of the good readings of the most
    sensitive charge that has one.
    """
    return _descend(groups, per_light)


def poisson_sum(groups: list[list[Readout]], per_light: list[np.ndarray]) -> Merged:
    """Return the sum of the charges of all good readings divided by the sum of their sensitivities
    (Hanji et al. 2020, Poisson estimator).
    """
    least = _descend(groups[:1], per_light[:1])
    electrons, light, variance = (np.zeros(least.signal_e.shape) for _ in range(3))
    source = least.source.copy()
    weighted = []
    for reads, own in zip(groups, per_light):
        usable = [_good(read) for read in reads]
        count = sum(g.astype(float) for g in usable)
        light += count * own / per_light[-1]
        for read, g in zip(reads, usable):
            electrons += np.where(g, read.charge_e - read.dark_e, 0.0)
            variance += np.where(g, read.read_var_e2 + count * np.maximum(read.charge_e, 0.0), 0.0)
            weighted.append((read, g.astype(float), own / per_light[-1]))
            source[g] = read.capture
    some = light > 0
    safe = np.where(some, light, 1.0)
    ratio = per_light[0] / per_light[-1]
    signal = np.where(some, electrons / safe, least.signal_e / ratio)
    variance = np.where(some, variance / safe**2, least.variance_e2 / ratio**2)
    parts = [WeightedRead(read.spread, g / safe, sensitivity) for read, g, sensitivity in weighted]
    return Merged(signal, variance, some, source, fixed_pattern(parts, signal, variance))


RULES = {
    "inverse_variance": inverse_variance,
    "average": average,
    "poisson_sum": poisson_sum,
    "isetcam": isetcam,
}


def _good(read: Readout) -> np.ndarray:
    return read.charge_e < SHARE * read.top_e


def _descend(groups: list[list[Readout]], per_light: list[np.ndarray]) -> Merged:
    """Return the mean of the good readings of the most sensitive charge that has one. If there is
    none, return the reading of the least sensitive charge with the widest range.
    """
    merged = None
    chosen = []
    parts = []
    for reads, light in zip(groups, per_light):  # later, more sensitive charges replace earlier
        usable = np.array([_good(read) for read in reads])
        use = usable | (
            ~usable.any(0)
            & np.array([read is max(reads, key=lambda r: r.top_e) for read in reads])[:, None, None]
        )
        count = use.sum(0)
        charge = sum(np.where(u, read.charge_e, 0.0) for u, read in zip(use, reads)) / count
        read_var = sum(np.where(u, read.read_var_e2, 0.0) for u, read in zip(use, reads)) / count**2
        source = np.zeros(charge.shape, np.uint8)
        for u, read in zip(use, reads):
            source[u] = read.capture
        ratio = light / per_light[-1]
        mean_of_charge = (
            (charge - reads[0].dark_e) / ratio,
            charge_variance(charge, read_var) / ratio**2,
            usable.any(0),
            source,
        )
        chosen = [mine & ~usable.any(0) for mine in chosen] + [
            np.ones_like(usable[0]) if merged is None else usable.any(0)
        ]
        parts.append(
            [WeightedRead(read.spread, u / count / ratio, ratio) for u, read in zip(use, reads)]
        )
        if merged is None:
            merged = mean_of_charge
        else:
            merged = (
                *(
                    np.where(usable.any(0), new, old)
                    for new, old in zip(mean_of_charge[:2], merged[:2])
                ),
                mean_of_charge[2] | merged[2],
                np.where(usable.any(0), source, merged[3]),
            )
    reads = [
        part._replace(weight=part.weight * mine)
        for mine, of_charge in zip(chosen, parts)
        for part in of_charge
    ]
    return Merged(*merged, fixed_pattern(reads, *merged[:2]))

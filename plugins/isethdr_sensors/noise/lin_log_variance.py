"""The variance that is stated for each reading of a lin-log pixel. For uniform light, its mean over
the pixels of a shot equals the variance of the electrons over these pixels.

"Read back" means to convert a reading to electrons. At the knee, the variance of the electrons read
back increases twentyfold within three standard deviations of the noise, and a single reading cannot
tell on which side of the knee it lies. The table of variances is therefore the solution of
equations for many levels of light across the knee. The distribution of the readings at each level
is a quadrature over the arriving electrons (Poisson) and over the noise of the charge. The table
increases with the reading, and its mean is right at all levels.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

# The table is solved between these slopes of the response. This part of it is called the bend.
BENDS = 0.97
LOGARITHMIC = 0.002
# approximate number of levels of light across the bend, and of parts of the table that are scaled
# by a common factor
LEVELS = 160
# weight of the deviation of one factor from 1, compared with the relative error of one level; it
# keeps the table smooth
NEAR = 0.01
# nodes and weights of the quadrature over counts, in standard deviations from the mean
COUNTS, COUNT_SHARE = np.polynomial.hermite_e.hermegauss(21)
# nodes of the quadrature over noise, in standard deviations; even and close, because rounding to
# codes makes steps
NOISE = np.linspace(-5.0, 5.0, 81)
# probability (count, noise) of each node
SHARE = np.outer(COUNT_SHARE, np.exp(-(NOISE**2) / 2))
SHARE /= SHARE.sum()


class ReadBack(NamedTuple):
    """The table that converts readings of a lin-log pixel to electrons, and the noise of the
    readings.
    """

    dn: np.ndarray  # (entry,) readings, increasing
    electrons: np.ndarray  # (entry,) arrived electrons for each reading, increasing
    width_dn: np.ndarray  # (entry,) rms of the readings of these electrons, with rounding
    response: Callable  # function from arrived electrons to DN
    digital: bool  # whether entries are all whole codes, and readings are rounded to them


def scatter_of_readings(
    table: ReadBack, slopes: np.ndarray, plain_e2: np.ndarray, off_bend_e2: np.ndarray
) -> np.ndarray:
    """Return (entry,) the variance of the electrons read back minus these electrons (which is the
    Poisson part), e^2. The result increases through the bend.

    Parameters
    ----------
    table : table that converts readings to electrons.
    slopes : (entry,) slopes of the response, decreasing.
    plain_e2 : (entry,) variance of the electrons read back over the noise of a reading, e^2. The
        result keeps this shape where the levels of light do not determine it.
    off_bend_e2 : (entry,) the exact result where the response is a straight line or a logarithm,
        e^2.

    Notes
    -----
    The increments of the table are those of `plain_e2` times factors of 0 or more. The factors are
    the least-squares solution for the relative error (nonnegative least squares, Lawson and Hanson
    1974), with a ridge penalty that draws them to 1.
    """
    first, last = np.searchsorted(-slopes, (-BENDS, -LOGARITHMIC))
    # there is no bend between two entries, or light is too strong for floating-point numbers
    if last - first < 2 or not np.isfinite(off_bend_e2).all():
        return off_bend_e2
    dn = table.dn
    electrons = table.electrons
    lit = electrons[first : last + 1 : every(last - first)]
    at = readings(table, lit[lit > 0])
    read_e = np.interp(at, dn, electrons)
    entry_shares = shares_of_entries(dn, at)
    mean = np.sum(read_e * SHARE, axis=(1, 2))
    true_e2 = np.sum((read_e - mean[:, None, None]) ** 2 * SHARE, axis=(1, 2))
    bend = slice(first, last)
    rises = np.maximum(
        np.diff(plain_e2[first - 1 : last]) if first else np.diff(plain_e2[:last], prepend=0.0), 0.0
    )
    start = off_bend_e2[first - 1] if first else 0.0
    other_share = (
        entry_shares[:, :first] @ off_bend_e2[:first]
        + entry_shares[:, last:] @ off_bend_e2[last:]
        + start * entry_shares[:, bend].sum(1)
    )
    by_rise = np.cumsum(entry_shares[:, bend][:, ::-1], axis=1)[:, ::-1] * rises / true_e2[:, None]
    part = np.arange(len(rises)) // every(len(rises))
    by_part = np.add.reduceat(by_rise, np.flatnonzero(np.diff(part, prepend=-1)), axis=1)
    target = (true_e2 - entry_shares @ electrons - other_share) / true_e2
    # a level with the same code for all readings gives no equation
    finite = np.isfinite(target) & np.isfinite(by_part).all(1)
    count = part[-1] + 1
    from scipy.optimize import nnls  # slow to import

    factors, _ = nnls(
        np.vstack([by_part[finite], NEAR * np.eye(count)]),
        np.append(target[finite], np.full(count, NEAR)),
        maxiter=30 * count,
    )
    out = off_bend_e2.copy()
    out[bend] = start + np.cumsum(factors[part] * rises)
    return out


def every(entries: int) -> int:
    """Return the step between the entries that are used as levels or parts."""
    return max(entries // LEVELS, 1)


def readings(table: ReadBack, arrived_e: np.ndarray) -> np.ndarray:
    """Return the readings (level, count, noise), DN, at the nodes of the quadrature for mean
    arrived electrons (level,). `SHARE` has their probabilities.
    """
    count = np.maximum(arrived_e[:, None] + np.sqrt(arrived_e)[:, None] * COUNTS, 0.0)
    variance_dn2 = np.interp(count, table.electrons, table.width_dn) ** 2 - table.digital / 12
    width = np.sqrt(np.maximum(variance_dn2, 0.0))
    at = table.response(count)[:, :, None] + width[:, :, None] * NOISE
    return np.clip(np.floor(at + 0.5) if table.digital else at, table.dn[0], table.dn[-1])


def shares_of_entries(dn: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return the share (level, entry) of each entry of the table in the readings of each level. A
    reading between two entries is divided between them by linear interpolation.
    """
    entry = np.clip(np.searchsorted(dn, at, side="right") - 1, 0, len(dn) - 2)
    part = (at - dn[entry]) / (dn[entry + 1] - dn[entry])
    row = np.arange(len(at))[:, None, None] * len(dn) + entry
    out = np.bincount(row.ravel(), (SHARE * (1 - part)).ravel(), len(at) * len(dn))
    out += np.bincount(row.ravel() + 1, (SHARE * part).ravel(), len(at) * len(dn))
    return out.reshape(len(at), len(dn))
